"""`raycam dataset`."""

from __future__ import annotations

import argparse
import json
from typing import Any

from ..errors import SettingsError
from .options import Command, add_rendering, add_world, load_world, rendering


def _add(command: argparse.ArgumentParser) -> None:
    add_world(command)
    command.add_argument("-o", "--output", metavar="DIR", required=True, help="the folder to write to")
    command.add_argument(
        "--format",
        metavar="NAME",
        default="coco",
        help="coco (default), bop, kitti, colmap, nerf, tum, scannet or webdataset",
    )
    command.add_argument(
        "--cameras",
        metavar="FILE",
        help="a world file whose cameras to use; else every frame of the world's video, or its own cameras",
    )
    command.add_argument(
        "--option",
        metavar="KEY=VALUE",
        action="append",
        default=[],
        help="an option of the format, as in segmentation=polygon, baseline=0.54 or flow=true; may be given again",
    )
    command.add_argument(
        "--no-resume", action="store_true", help="begin anew where the folder holds views already"
    )
    add_rendering(command)
    command.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> None:
    from ..dataset import write
    from ..progress import bar
    from ..world import load

    chosen = dict(_option(text) for text in options.option)
    world = load_world(options)
    cameras = None if options.cameras is None else load(options.cameras).cameras
    if cameras is not None and not cameras:
        raise SettingsError(f"{options.cameras} has no cameras")
    with bar("rendering views") as progress:
        written = write(
            world,
            options.output,
            options.format,
            cameras=cameras,
            resume=not options.no_resume,
            progress=progress,
            **rendering(options),
            **chosen,
        )
    print(f"{options.output}: {written.frames} views, {options.format}")


def _option(text: str) -> tuple[str, Any]:
    """A key and its value: JSON, or a word."""
    key, equals, value = text.partition("=")
    if not equals:
        raise SettingsError(f"--option {text}: expected KEY=VALUE")
    try:
        return key, json.loads(value)
    except ValueError:
        return key, value


COMMAND = Command(
    _add,
    "write a data set: pictures with their ground truth",
    [
        "raycam dataset room.toml -o room --format coco --option segmentation=polygon",
        "raycam dataset room.toml -o room --format kitti --cameras rig.toml --option baseline=0.54",
        "raycam dataset room.toml -o room --format bop --samples 64 --integrator path",
    ],
)
