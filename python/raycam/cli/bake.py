"""The command `raycam bake`."""

from __future__ import annotations

import argparse
from pathlib import Path

from .options.command import Command
from .options.worlds import add_world, load_world


def _add(command: argparse.ArgumentParser) -> None:
    add_world(command)
    command.add_argument(
        "--maps",
        metavar="NAME",
        nargs="+",
        default=["ao"],
        help="maps to bake: ao (default), bent_normal, thickness, curvature, position, normal, shading_normal, "
        "tangent_normal, irradiance, direct, radiance, instance, material, triangle; with --from: albedo, "
        "roughness, metallic, emission",
    )
    command.add_argument(
        "-o",
        "--output",
        metavar="PATH",
        required=True,
        help="output folder, or the output file of a single map: .png or .exr (depends on the map), or .glb with "
        "--to vertices",
    )
    command.add_argument(
        "--to",
        choices=("texture", "vertices"),
        default="texture",
        help="bake to texture (default) or to vertices (one mesh with vertex colours for each map)",
    )
    command.add_argument("--object", metavar="NAME", default=None, help="object to bake (default: the first)")
    command.add_argument(
        "--size",
        metavar="N",
        type=int,
        default=1024,
        help="side of the square texture in texels (default: 1024)",
    )
    command.add_argument(
        "--uv-set", metavar="N", type=int, default=0, help="index of the UV set, from 0 (default: 0)"
    )
    command.add_argument(
        "--from",
        dest="source",
        metavar="FILE",
        help="detailed model whose surface the maps show (default: the object)",
    )
    command.add_argument(
        "--cage",
        metavar="METRES",
        type=float,
        help="largest distance in metres between the object and the detailed model, along the object's normals "
        "(default: 2 %% of the object's diagonal)",
    )
    command.add_argument(
        "--atlas",
        metavar="NAME",
        help="new texture coordinates: xatlas (requires raycam[atlas]) or cells (default: use the mesh's own)",
    )
    command.add_argument(
        "--samples", metavar="N", type=int, default=64, help="rays or paths per texel (default: 64)"
    )
    command.add_argument(
        "--distance",
        metavar="METRES",
        type=float,
        help="ignore surfaces beyond this distance in metres (default: no limit)",
    )
    _add_ray_options(command)
    command.add_argument("--threads", metavar="N", type=int, help="number of threads (default: all)")
    command.set_defaults(run=_run)


def _add_ray_options(command: argparse.ArgumentParser) -> None:
    command.add_argument(
        "--cone",
        metavar="DEGREES",
        type=float,
        default=180.0,
        help="opening angle in degrees of the cone of rays that measure thickness "
        "(default: 180; 120 gives the shape diameter function)",
    )
    command.add_argument(
        "--green",
        choices=("up", "down"),
        default="up",
        help="direction of the green channel in tangent_normal: up (default; glTF, OpenGL) or down (DirectX)",
    )
    command.add_argument(
        "--max-depth",
        metavar="N",
        type=int,
        help="maximum number of segments of a light path (default: no limit)",
    )
    command.add_argument(
        "--denoise",
        action="store_true",
        help="denoise irradiance, direct and radiance with Open Image Denoise (requires raycam[denoise])",
    )


def _run(options: argparse.Namespace) -> None:
    from ..baking import bake
    from ..errors import SettingsError

    if Path(options.output).suffix in (".png", ".exr", ".glb") and len(set(options.maps)) > 1:
        raise SettingsError(
            f"--output {options.output} is the file of a single map, got {len(set(options.maps))} maps; use a folder",
            code="conflicting_values",
        )
    world = load_world(options)
    maps = bake(
        world,
        options.maps,
        object=0 if options.object is None else options.object,
        to=options.to,
        size=options.size,
        uv_set=options.uv_set,
        source=options.source,
        cage=options.cage,
        atlas=options.atlas,
        samples=options.samples,
        distance=float("inf") if options.distance is None else options.distance,
        cone=options.cone,
        green=options.green,
        max_depth=options.max_depth,
        denoise=options.denoise,
        threads=options.threads,
    )
    if Path(options.output).suffix in (".png", ".exr", ".glb"):
        maps.save_map(options.maps[0], options.output)
        print(options.output)
        return
    for path in maps.save(options.output):
        print(path)


COMMAND = Command(
    _add,
    "bake maps of a surface into textures or vertex colours: ambient occlusion, normals, light",
    [
        "raycam bake model.glb -o maps                                     maps/ao.png",
        "raycam bake model.glb --maps ao bent_normal --samples 256 --size 2048 -o maps",
        "raycam bake low.glb --from high.obj --maps tangent_normal ao -o maps",
        "raycam bake room.toml --maps irradiance --samples 256 -o lightmap.exr",
        "raycam bake model.glb --to vertices -o ao.glb                        ambient occlusion as vertex colours",
        "raycam bake room.toml --object chair --maps thickness --distance 0.1 -o maps",
    ],
)
