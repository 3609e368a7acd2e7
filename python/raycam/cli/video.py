"""The command `raycam video`."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import Notice, SettingsError
from ._job_options import add_job, job_pool, shard_of
from ._options import (
    Command,
    add_camera,
    add_rendering,
    add_world,
    load_world,
    print_notices,
    print_result,
    rendering,
    turning_view,
    view,
)
from .options.framing import is_framed, reject_look
from .options.look import add_look, dressed
from .options.rigs import add_rig, per_camera_path, require_rig_only

if TYPE_CHECKING:
    from ..camera import Camera
    from ..world import World


def _add(command: argparse.ArgumentParser) -> None:
    add_world(command)
    command.add_argument(
        "-o",
        "--output",
        metavar="FILE",
        help=".mp4, .mov, .mkv, .webm, .gif, or a folder for PNG pictures (default: the name of WORLD with .mp4)",
    )
    add_camera(command)
    add_look(command)
    add_rendering(command)
    group = command.add_argument_group("motion and sound")
    group.add_argument(
        "--turntable",
        action="store_true",
        help="turn once around the world, in --seconds (4), whatever its file says of motion",
    )
    group.add_argument("--seconds", metavar="N", type=float, help="play the same motion in N seconds")
    group.add_argument(
        "--fps", metavar="N", type=float, help="frames per second (default: the world's, or 24)"
    )
    group.add_argument(
        "--frames",
        metavar="A:B",
        help="only frames A up to but not B, from 0, as in 0:24, 24: or -24: for the last 24",
    )
    group.add_argument(
        "--animation", metavar="NAME", help="of a glTF file: a name, or a number from 0 (default: the first)"
    )
    add_rig(group)
    group.add_argument(
        "--audio", metavar="FILE", help="a file whose first track of sound goes along, as long as the video"
    )
    group.add_argument(
        "--lossless",
        action="store_true",
        help="keep every bit: .mp4 (H.264 in RGB), .mov (PNG), .webm (VP9 in RGB); .mkv (FFV1) always does",
    )
    group.add_argument(
        "--keep-frames", action="store_true", help="leave the frames in FILE.job when the file is complete"
    )
    add_job(command)
    command.set_defaults(run=_run)


def run_turntable(options: argparse.Namespace, output: Path) -> None:
    """Makes the video of `raycam render --turntable SECONDS`."""
    values = vars(options)
    own = {
        "frames": None,
        "fps": None,
        "animation": None,
        "audio": None,
        "lossless": False,
        "keep_frames": False,
    }
    _run(argparse.Namespace(**{**values, **own, "output": str(output), "seconds": options.turntable}))


def _seen(
    world: World, options: argparse.Namespace, settings: dict[str, Any]
) -> tuple[World, Camera, dict[str, Any]]:
    """The world in its light, turned around if the options say so, the camera and the settings of rendering."""
    from ..video import with_orbit

    still = options.turntable and is_framed(world, options)
    camera = turning_view(world, options) if still else view(world, options, moving=not options.turntable)
    lit, settings = dressed(world, camera, options, settings)
    if options.turntable:
        lit = with_orbit(lit, target=world.bounds)
    return lit, camera, settings


def _run(options: argparse.Namespace) -> None:
    from ..progress import frames_bar
    from ..video import VideoPlan, frame_range
    from ..video.job import make_video

    target = options.output or Path(options.world).with_suffix(".mp4").name
    frames = None if options.frames is None else frame_range(options.frames)
    shard = shard_of(options)
    if options.background == "transparent":
        options.transparent_background, options.background = True, None
    reject_look(options, ("background",), "a colour or picture is for pictures; a video takes transparent")
    world = load_world(options)
    rig = require_rig_only(world, options)
    camera, settings = None, rendering(options)
    if rig is None:
        world, camera, settings = _seen(world, options, settings)
    elif options.turntable:
        raise SettingsError("--turntable moves one camera; a rig moves as the world's video says")
    told: set[Notice] = set()
    with job_pool(options) as pool:
        for name in [None] if rig is None else list(rig):
            output = target if name is None else str(per_camera_path(Path(target), name))
            film = VideoPlan(
                world,
                camera,
                rig=None if rig is None or name is None else (rig, name),
                fps=options.fps,
                seconds=options.seconds,
                animation=options.animation,
                **settings,
            )
            with frames_bar("rendering" if name is None else f"rendering {name}") as progress:
                count = make_video(
                    film,
                    output,
                    pool,
                    frames=frames,
                    shard=shard,
                    resume=options.resume,
                    retry_failed=options.retry_failed,
                    keep_frames=options.keep_frames,
                    lossless=options.lossless,
                    audio=options.audio,
                    progress=progress,
                )
            print_notices([notice for notice in film.notices if notice not in told])
            told.update(film.notices)
            width, height = film.camera.size
            if count is None:
                print_result(f"shard {options.shard} is finished; {output} is made when all are")
            else:
                print_result(f"{output}: {count} frames of {width} x {height}, {film.fps:g} a second")


COMMAND = Command(
    _add,
    "make a video of a world as its [video] or its animation says",
    [
        "raycam video room.toml -o room.mp4                          again after Ctrl-C: goes on",
        "raycam video fox.glb --animation Run                        fox.mp4",
        "raycam video model.glb -o model.mp4 --turntable --seconds 6",
        "raycam video room.toml -o room.gif --frames 0:24 --size 320x240",
        "raycam video room.toml -o room.webm --transparent-background  over a page; .mov for editors",
        "raycam video room.toml -o room.mp4 --audio steps.wav",
        "raycam video car.toml --rig stereo -o car.mp4               car_left.mp4, car_right.mp4",
        "raycam video room.toml -o frames --shard 3/16               one of sixteen machines",
        "raycam video room.toml -o room.mp4 --cluster tcp://scheduler:8786",
    ],
)
