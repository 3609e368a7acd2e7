"""`raycam render`."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

from ..errors import SettingsError
from .options import Command, add_camera, add_rendering, add_world, load_world, numbers, rendering, tell, view


def _add(command: argparse.ArgumentParser) -> None:
    add_world(command)
    command.add_argument(
        "-o",
        "--output",
        metavar="FILE",
        help=".png, .exr, .hdr or .npz (default: the world's name with .png, here)",
    )
    add_camera(command)
    command.add_argument(
        "--channels",
        metavar="NAME",
        nargs="+",
        help="what the file holds: names as in the table of raycam.Frame (color depth normal instance ...), or "
        "all (default: color; for .exr and .npz color depth instance triangle)",
    )
    command.add_argument("--region", metavar="X,Y,W,H", type=numbers, help="render a part of the picture")
    command.add_argument("--bits", type=int, metavar="N", help="8 (default) or 16 bits per channel, for .png")
    command.add_argument(
        "--half", action="store_true", default=None, help="float16 instead of float32, for .exr"
    )
    add_rendering(command)
    command.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> None:
    from ..frame import check_save
    from ..progress import bar
    from ..render import DEFAULT_CHANNELS, channel_names, render

    output = Path(options.output or Path(options.world).with_suffix(".png").name)
    names: Sequence[str] = ("color",) if output.suffix.lower() in (".png", ".hdr") else DEFAULT_CHANNELS
    if options.channels is not None:
        words = [name for part in options.channels for name in part.split(",") if name]
        names = channel_names("all" if words == ["all"] else words)
    check_save(output, names, (1, 1), bits=options.bits, half=options.half)
    world = load_world(options)
    camera = view(world, options)
    if options.output is None and output.exists() and output.name in world.textures:
        raise SettingsError(f"{output} is a texture of this world: choose another name with -o")
    check_save(output, names, camera.size)
    settings = rendering(options)
    with bar("rendering") as progress:
        frame = render(world, camera, channels=names, region=options.region, progress=progress, **settings)
    tell(frame.notices)
    frame.save(output, bits=options.bits, half=options.half)
    _, _, width, height = frame.region
    print(f"{output}: {width} x {height}, {', '.join(frame.channels)}")


COMMAND = Command(
    _add,
    "make a picture of a world",
    [
        "raycam render room.toml                                   a lit picture, room.png",
        "raycam render room.toml -o room.exr --channels all         with all ground truth",
        "raycam render bunny.ply -o bunny.png --size 1920x1080      a bare mesh, framed and lit",
        "raycam render room.toml --integrator flat --samples 1      the lecture's picture",
    ],
)
