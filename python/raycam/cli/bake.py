"""The command `raycam bake`."""

from __future__ import annotations

import argparse

from .options.command import Command
from .options.worlds import add_world, load_world


def _add(command: argparse.ArgumentParser) -> None:
    add_world(command)
    command.add_argument(
        "--maps",
        metavar="NAME",
        nargs="+",
        default=["ao"],
        help="ao (default), position, normal, shading_normal, tangent_normal, bent_normal, thickness, albedo, "
        "instance, triangle",
    )
    command.add_argument("-o", "--output", metavar="DIR", required=True, help="folder to write to")
    command.add_argument("--object", metavar="NAME", default=None, help="object to bake (default: the first)")
    command.add_argument(
        "--size",
        metavar="N",
        type=int,
        default=1024,
        help="side of the square texture in texels (default: 1024)",
    )
    command.add_argument(
        "--uv-set", metavar="N", type=int, default=0, help="set of texture coordinates (default: 0)"
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
        help="distance within which the detailed model is looked for (default: 2 %% of the object's diagonal)",
    )
    command.add_argument(
        "--atlas",
        metavar="NAME",
        help="new texture coordinates: xatlas (requires raycam[atlas]) or cells (default: those of the mesh)",
    )
    command.add_argument("--samples", metavar="N", type=int, default=64, help="rays per texel (default: 64)")
    command.add_argument(
        "--distance",
        metavar="METRES",
        type=float,
        help="ignore surfaces beyond this distance (default: no limit)",
    )
    command.add_argument("--threads", metavar="N", type=int, help="number of threads (default: all)")
    command.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> None:
    from ..baking import bake
    from ..notices import collected
    from .options.messages import print_notices

    world = load_world(options)
    with collected() as notices:
        maps = bake(
            world,
            options.maps,
            object=0 if options.object is None else options.object,
            size=options.size,
            uv_set=options.uv_set,
            source=options.source,
            cage=options.cage,
            atlas=options.atlas,
            samples=options.samples,
            distance=float("inf") if options.distance is None else options.distance,
            threads=options.threads,
        )
    print_notices(notices)
    for path in maps.save(options.output):
        print(path)


COMMAND = Command(
    _add,
    "bake maps of a surface into textures: ambient occlusion, normals, thickness",
    [
        "raycam bake model.glb -o maps                                     maps/ao.png",
        "raycam bake model.glb --maps ao bent_normal --samples 256 --size 2048 -o maps",
        "raycam bake low.glb --from high.obj --maps tangent_normal ao -o maps",
        "raycam bake room.toml --object chair --maps thickness --distance 0.1 -o maps",
    ],
)
