"""The command `raycam visible`."""

from __future__ import annotations

import argparse
import os
from typing import TYPE_CHECKING

from ..errors import SettingsError
from .options.command import Command
from .options.lidars import world_lidars
from .options.photographs import add_photograph_cameras, photograph_cameras
from .options.worlds import add_world, load_world, parse_animation

if TYPE_CHECKING:
    from ..photos import SurfaceVisibility
    from ..world import World

ENDINGS = (".ply", ".npz", ".glb")


def _add(command: argparse.ArgumentParser) -> None:
    add_world(command)
    add_photograph_cameras(command, required=False)
    command.add_argument(
        "--lidar",
        metavar="NAME",
        nargs="+",
        default=[],
        help="one or more lidars: the name of a lidar of the world file, or NAME=DEVICE@X,Y,Z, a device or "
        "calibration file at a position; a "
        "face is visible if a pulse of the first frame measures a point on it",
    )
    command.add_argument(
        "--at",
        metavar="SECONDS",
        type=float,
        help="time of the world's video or animation, in seconds (default: no motion)",
    )
    command.add_argument("--animation", metavar="NAME", help="animation of a glTF file (default: the first)")
    command.add_argument(
        "-o",
        "--output",
        metavar="FILE",
        help=".ply: faces with the properties views, fraction, best_view, best_resolution and angle; .npz: arrays; "
        ".glb: the model without invisible faces (requires --cull)",
    )
    command.add_argument(
        "--cull",
        action="store_true",
        help="omit faces that are visible to fewer than --min-views cameras and lidars",
    )
    command.add_argument(
        "--min-views",
        metavar="N",
        type=int,
        default=1,
        help="with --cull: keep faces that are visible to at least this number of cameras and lidars (default: 1)",
    )
    command.add_argument(
        "--samples",
        metavar="N",
        type=int,
        help="samples on each face (default: one per pixel or per 16 points of a lidar, but at least 4 and at "
        "most 256)",
    )
    command.add_argument(
        "--facing",
        metavar="SIDE",
        default="auto",
        help="front: ignore cameras behind a face; both: include these cameras; auto (default): front, unless the mesh "
        "is inside out",
    )
    command.add_argument(
        "--heat",
        metavar="PNG",
        help="image of the mesh, with each face coloured by the number of cameras and lidars to which it is visible",
    )
    command.add_argument("--threads", metavar="N", type=int, help="number of threads (default: all)")
    command.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> None:
    from ..photos import coverage_picture, surface_visibility

    ending = "" if options.output is None else os.path.splitext(options.output)[1].lower()
    if options.output is not None and ending not in ENDINGS:
        raise SettingsError(
            f"-o {options.output}: expected a name that ends in .ply, .npz or .glb", code="unknown_format"
        )
    if ending == ".glb" and not options.cull:
        raise SettingsError(
            f"-o {options.output}: a .glb file requires --cull; add it, or write .ply or .npz",
            code="missing_value",
        )
    if options.cameras is None and not options.lidar:
        raise SettingsError("no viewpoints; pass --cameras FILE, --lidar NAME, or both", code="missing_value")
    if options.animation is not None and options.at is None:
        raise SettingsError("--animation requires --at SECONDS", code="missing_value")
    world = load_world(options)
    cameras = {} if options.cameras is None else dict(photograph_cameras(options))
    if options.at is not None:
        world = world.at(options.at, parse_animation(world, options.animation))
    lidars = world_lidars(world, options.lidar)
    if common := cameras.keys() & lidars.keys():
        raise SettingsError(
            f"--lidar {min(common)}: a camera has the same name; give the lidar another name",
            code="duplicate_name",
        )
    seen = surface_visibility(
        world,
        {**cameras, **lidars},
        samples="faces" if options.samples is None else options.samples,
        facing=options.facing,
        threads=options.threads,
    )
    kept = seen.views >= options.min_views if options.cull else seen.views >= 0
    if options.output is not None:
        _write(world, seen, kept, options.output, ending)
    if options.heat is not None:
        coverage_picture(world, seen).save(options.heat)
    some = int((seen.views > 0).sum())
    eyes = [f"{len(one)} {name}" for one, name in ((cameras, "cameras"), (lidars, "lidars")) if one]
    print(
        f"{some} of {len(seen.views)} faces are visible to {' and '.join(eyes)} ({100 * some / len(kept):.3g} %)"
    )
    if options.output is not None and options.cull:
        print(f"{options.output}: {int(kept.sum())} faces")


def _write(world: World, seen: SurfaceVisibility, kept: object, path: str, ending: str) -> None:
    import numpy as np

    from ..photos.files import save_faces, save_visibility

    mask = np.asarray(kept)
    if ending == ".npz":
        save_visibility(path, seen)
    elif ending == ".ply":
        save_faces(path, world, seen, mask)
    else:
        for item in reversed(world.objects):
            own = mask[seen.of(item.id)]
            if len(own) and not own.any():
                world.remove_object(item.id)
            elif len(own):
                world = world.cull_faces(item.id, own)
        world.to_gltf(path)


COMMAND = Command(
    _add,
    "find the faces of a mesh that are visible to cameras and lidars",
    [
        "raycam visible scan.ply --cameras sparse/0                        the share of visible faces",
        "raycam visible scan.ply --cameras sparse/0 --cull -o seen.ply     only the visible faces",
        "raycam visible model.glb --cameras sparse/0 --heat coverage.png -o faces.npz",
        "raycam visible drive.toml --lidar car/top --at 2.0 --heat coverage.png",
        "raycam visible yard.glb --lidar a=vlp16@0,0,1.8 b=os1-128@9,4,1.8   two devices at given positions",
    ],
)
