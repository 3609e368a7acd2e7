"""The command `raycam video`."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import Notice, SettingsError
from .options.cameras import add_camera
from .options.command import Command
from .options.framing import find_camera, find_orbit_camera, is_framed, reject_options
from .options.jobs import add_job, job_pool, parse_shard
from .options.look import add_look, apply_look
from .options.messages import print_notices, print_result
from .options.rendering import add_render_options, given_render_options
from .options.rigs import add_rig, per_camera_path, require_rig_only
from .options.worlds import add_world, load_world

if TYPE_CHECKING:
    from ..camera import Camera
    from ..world import World


def _add(command: argparse.ArgumentParser) -> None:
    add_world(command)
    command.add_argument(
        "-o",
        "--output",
        metavar="FILE",
        help="output: .mp4, .mov, .mkv, .webm, .gif, or a folder for PNG images (default: the name of WORLD with .mp4)",
    )
    add_camera(command)
    add_look(command)
    add_render_options(command)
    group = command.add_argument_group("motion and sound")
    group.add_argument(
        "--turntable",
        action="store_true",
        help="turn once around the world, in --seconds (default: 4), instead of the motion in the file",
    )
    group.add_argument(
        "--seconds",
        metavar="N",
        type=float,
        help="length of the video in seconds (default: the motion's duration); the motion is played faster or slower "
        "to fit",
    )
    group.add_argument(
        "--fps", metavar="N", type=float, help="frames per second (default: the world's, or 24)"
    )
    group.add_argument(
        "--frames",
        metavar="A:B",
        help="render only frames A to B, B excluded, as in 0:24, 24:, or -24: for the last 24",
    )
    group.add_argument(
        "--animation",
        metavar="NAME",
        help="animation of a glTF file: a name, or a number from 0 (default: the first)",
    )
    add_rig(group)
    group.add_argument(
        "--audio",
        metavar="FILE",
        help="file whose first audio track is added, cut or padded to the length of the video",
    )
    group.add_argument(
        "--lossless",
        action="store_true",
        help="lossless compression: .mp4 (H.264 in RGB), .mov (PNG), .webm (VP9 in RGB); .mkv (FFV1) is always "
        "lossless",
    )
    group.add_argument(
        "--keep-frames", action="store_true", help="keep the frames in FILE.job when the video is complete"
    )
    group.add_argument(
        "--trajectory",
        metavar="FILE",
        help="file with the robot's joint values over time: .csv (header time, JOINT, ...), .npy (rows of time and "
        "all joint values) or ROS 2 bag (FILE, or FILE:/TOPIC if several topics contain joint states)",
    )
    add_job(command)
    command.set_defaults(run=_run)


def run_turntable(options: argparse.Namespace, output: Path) -> None:
    """Renders the video of `raycam render --turntable SECONDS`."""
    values = vars(options)
    own = {
        "frames": None,
        "fps": None,
        "animation": None,
        "audio": None,
        "lossless": False,
        "keep_frames": False,
        "trajectory": None,
    }
    _run(argparse.Namespace(**{**values, **own, "output": str(output), "seconds": options.turntable}))


def _seen(
    world: World, options: argparse.Namespace, settings: dict[str, Any]
) -> tuple[World, Camera, dict[str, Any]]:
    """The world with its look and motion, the camera and the render options."""
    from ..video import with_orbit

    still = options.turntable and is_framed(world, options)
    camera = (
        find_orbit_camera(world, options)
        if still
        else find_camera(world, options, moving=not options.turntable)
    )
    lit, settings = apply_look(world, camera, options, settings)
    if options.turntable:
        lit = with_orbit(lit, target=world.bounds)
    return lit, camera, settings


def _follow(world: World, options: argparse.Namespace) -> None:
    """Replaces the world's video by the motion of `--trajectory`."""
    from ..world.joint_keyframes import read_trajectory

    if len(world.robots) != 1:
        names = ", ".join(world.robots) or "none"
        raise SettingsError(
            f"--trajectory requires a world with one robot; robots: {names}", code="missing_value"
        )
    (robot,) = world.robots.values()
    times, vectors = read_trajectory(robot, options.trajectory)
    starts = robot._kinematics.starts
    ends = [*list(starts.values())[1:], vectors.shape[1]]
    frames = []
    for time, vector in zip(times, vectors, strict=True):
        parts = {name: vector[start:end] for (name, start), end in zip(starts.items(), ends, strict=True)}
        joints = {name: part if len(part) > 1 else part[0] for name, part in parts.items()}
        frames.append({"time": float(time), "robot": robot.name, "joints": joints})
    world.set_video(fps=options.fps or 24.0, keyframe=frames)


def _run(options: argparse.Namespace) -> None:
    from ..progress import frames_bar
    from ..video import VideoPlan, frame_range
    from ..video.job import make_video

    target = options.output or Path(options.world).with_suffix(".mp4").name
    frames = None if options.frames is None else frame_range(options.frames)
    shard = parse_shard(options)
    if options.background == "transparent":
        options.transparent_background, options.background = True, None
    reject_options(options, ("background", "orientation"), "videos support only --background transparent")
    world = load_world(options)
    if options.trajectory is not None:
        _follow(world, options)
    rig = require_rig_only(world, options)
    camera, settings = None, given_render_options(options)
    if rig is None:
        world, camera, settings = _seen(world, options, settings)
    elif options.turntable:
        raise SettingsError("--turntable cannot be combined with --rig", code="conflicting_values")
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
                print_result(f"shard {options.shard} is finished; {output} is written after the last shard")
            else:
                print_result(f"{output}: {count} frames of {width} x {height}, {film.fps:g} a second")


COMMAND = Command(
    _add,
    "render a video of a world: its [video], its animation, or a turn around it",
    [
        "raycam video room.toml -o room.mp4                          run again after Ctrl-C to resume",
        "raycam video fox.glb --animation Run                        fox.mp4",
        "raycam video model.glb -o model.mp4 --turntable --seconds 6",
        "raycam video room.toml -o room.gif --frames 0:24 --size 320x240",
        "raycam video room.toml -o room.webm --transparent-background  with an alpha channel; .mov for editors",
        "raycam video room.toml -o room.mp4 --audio steps.wav",
        "raycam video arm.urdf --trajectory joints.csv -o arm.mp4",
        "raycam video car.toml --rig stereo -o car.mp4               car_left.mp4, car_right.mp4",
        "raycam video room.toml -o frames --shard 3/16               one of sixteen machines",
        "raycam video room.toml -o room.mp4 --cluster tcp://scheduler:8786",
    ],
)
