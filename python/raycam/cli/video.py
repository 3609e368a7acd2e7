"""`raycam video`."""

from __future__ import annotations

import argparse

from .options import Command, add_camera, add_rendering, add_world, load_world, rendering, tell, view


def _add(command: argparse.ArgumentParser) -> None:
    add_world(command)
    command.add_argument(
        "-o", "--output", metavar="FILE", required=True, help=".mp4, .gif, or a folder for PNG pictures"
    )
    add_camera(command)
    command.add_argument(
        "--frames", metavar="A:B", help="only frames A up to but not B, from 0, as in 0:24 or 24:"
    )
    command.add_argument(
        "--fps", metavar="N", type=float, help="frames per second (default: the world's, or 24)"
    )
    command.add_argument("--seconds", metavar="N", type=float, help="play the same motion in N seconds")
    add_rendering(command)
    command.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> None:
    from ..progress import bar
    from ..video import frame_range, write_video

    frames = None if options.frames is None else frame_range(options.frames)
    world = load_world(options)
    with bar("rendering frames") as progress:
        film = write_video(
            world,
            options.output,
            camera=view(world, options),
            frames=frames,
            fps=options.fps,
            seconds=options.seconds,
            progress=progress,
            **rendering(options),
        )
    tell(film.notices)
    width, height = film.camera.size
    count = len(range(len(film))[slice(*frames)]) if frames else len(film)
    print(f"{options.output}: {count} frames of {width} x {height}, {film.fps:g} a second")


COMMAND = Command(
    _add,
    "make a video of a world as its [video] says",
    [
        "raycam video room.toml -o room.mp4",
        "raycam video room.toml -o room.gif --frames 0:24 --size 320x240",
    ],
)
