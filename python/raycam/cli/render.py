"""The command `raycam render`."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import SettingsError
from ._job_options import add_job, job_pool, lower_priority, shard_of
from ._options import (
    Command,
    add_camera,
    add_rendering,
    add_world,
    load_world,
    numbers,
    print_notices,
    rendering,
    view,
)
from ._rigs import add_rig, require_rig_only, save_all

if TYPE_CHECKING:
    from ..camera import Camera
    from ..render.frame import Frame
    from ..rig import Rig
    from ..world import World


def _add(command: argparse.ArgumentParser) -> None:
    add_world(command)
    command.add_argument(
        "-o",
        "--output",
        metavar="FILE",
        help=".png, .jpg, .exr, .hdr, .npz or .html (default: the world's name with .png, here); "
        "- is the standard output, a PNG, or -.exr and so on",
    )
    add_camera(command)
    add_rig(command)
    command.add_argument(
        "--at",
        metavar="SECONDS",
        type=float,
        help="the world, and the camera, at a time of its video or animation; shutters see it move on",
    )
    command.add_argument("--animation", metavar="NAME", help="of --at, where a glTF file has several")
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
    add_job(command)
    command.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> None:
    from ..progress import bar
    from ..render import DEFAULT_CHANNELS, channel_names, render
    from ..render.frame import PICTURES, check_save, encoded

    output = Path(options.output or Path(options.world).with_suffix(".png").name)
    streamed = output.stem == "-" and output.parent == Path()
    if streamed:
        output = output if output.suffix else Path("-.png")
    pictures = (*PICTURES, ".hdr")
    names: Sequence[str] = ("color",) if output.suffix.lower() in pictures else DEFAULT_CHANNELS
    if options.channels is not None:
        words = [name for part in options.channels for name in part.split(",") if name]
        paired = options.rig is not None and "disparity" in words
        words = [word for word in words if word != "disparity" or not paired]
        names = channel_names("all" if words == ["all"] else words) if words else []
    else:
        paired = False
    if names or not paired:
        check_save(output, names, (1, 1), bits=options.bits, half=options.half)
    world = load_world(options)
    world, camera, rig = _moment(world, options)
    if rig is not None and not streamed:
        _render_rig(options, output, world, rig, [*names, "disparity"] if paired else names)
        return
    if streamed and rig is not None:
        raise SettingsError("-o - holds one picture; a rig has several")
    if options.output is None and output.exists() and output.name in world.textures:
        raise SettingsError(f"{output} is a texture of this world: choose another name with -o")
    check_save(output, names, camera.size)
    by_job = any(value is not None for value in (options.workers, options.cluster, options.shard))

    def save(frame: Frame) -> None:
        print_notices(frame.notices)
        if streamed:
            sys.stdout.buffer.write(encoded(frame, output, bits=options.bits, half=options.half))
            return
        frame.save(output, bits=options.bits, half=options.half)
        _, _, width, height = frame.region
        print(f"{output}: {width} x {height}, {', '.join(frame.channels)}")

    if by_job:
        if _by_job(options, output, world, camera, names, save) is None:
            print(f"shard {options.shard} is finished; {output} is made when all are")
    else:
        if options.retry_failed or not options.resume:
            raise SettingsError("--retry-failed and --no-resume go with --workers, --cluster or --shard")
        lower_priority(options)
        settings = rendering(options)
        with bar("rendering") as progress:
            frame = render(
                world, camera, channels=names, region=options.region, progress=progress, **settings
            )
        save(frame)


def _moment(world: World, options: argparse.Namespace) -> tuple[World, Camera, Rig | None]:
    """The world, the camera and the rig at the requested time."""
    rig = require_rig_only(world, options)
    if options.at is None:
        if options.animation is not None:
            raise SettingsError("--animation goes with --at SECONDS")
        return world, view(world, options) if rig is None else next(iter(rig.values())), rig
    moment = world.at(options.at, options.animation)
    # An animation also moves the world's cameras. The camera that frames a world without cameras does not move.
    seen = moment if world.cameras else world
    camera = view(seen, options) if rig is None else next(iter(rig.values()))
    if world.video is not None:
        camera = world.camera_at(camera, options.at)
        rig = None if rig is None else world.rig_at(rig, options.at)
    return moment, camera, rig


def _render_rig(
    options: argparse.Namespace, output: Path, world: World, rig: Rig, names: Sequence[str]
) -> None:
    """Renders and saves a frame for each camera of the rig."""
    if any(value is not None for value in (options.workers, options.cluster, options.shard)):
        raise SettingsError(
            "--rig goes without --workers, --cluster and --shard: raycam dataset shares pictures out"
        )
    lower_priority(options)
    frames = rig.render(world, channels=names, region=options.region, **rendering(options))
    for path, (name, frame) in zip(
        save_all(frames, output, options.bits, options.half), frames.items(), strict=True
    ):
        print_notices([f"{name}: {notice}" for notice in frame.notices])
        _, _, width, height = frame.region
        print(f"{path}: {width} x {height}, {', '.join(frame.channels)}")


def _by_job(
    options: argparse.Namespace,
    output: Path,
    world: World,
    camera: Camera,
    names: Sequence[str],
    save: Callable[[Frame], object],
) -> Frame | None:
    """Renders the picture in tiles and saves it; returns None if other shards still have tiles to render."""
    from ..jobs import tiled_picture
    from ..progress import frames_bar

    shard = shard_of(options)
    package = tiled_picture.job_package(
        world, camera, channels=names, region=options.region, **rendering(options)
    )
    with job_pool(options) as pool, frames_bar("rendering", "tiles") as progress:
        return tiled_picture.render_tiled(
            package,
            output.with_name(output.name + ".job"),  # holds the tiles until the picture is complete
            pool,
            shard=shard,
            resume=options.resume,
            retry_failed=options.retry_failed,
            progress=progress,
            save=save,
        )


COMMAND = Command(
    _add,
    "make a picture of a world",
    [
        "raycam render room.toml                                   a lit picture, room.png",
        "raycam render room.toml -o room.exr --channels all         with all ground truth",
        "raycam render bunny.ply -o bunny.png --size 1920x1080      a bare mesh, framed and lit",
        "raycam render room.toml -o room.exr --workers 4            in tiles, by processes; goes on after Ctrl-C",
        "raycam render room.toml -o room.exr --cluster tcp://scheduler:8786",
        "raycam render room.toml --integrator flat --samples 1      the lecture's picture",
        "raycam render car.toml --rig stereo -o car.exr --channels depth disparity    car_left.exr ...",
        "raycam render car.toml --at 1.5 -o car.png                 as its video has it after 1.5 s",
    ],
)
