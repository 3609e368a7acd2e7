"""The command `raycam info`."""

from __future__ import annotations

import argparse
from pathlib import Path

from .options.cameras import add_known, load_calibration
from .options.command import Command
from .options.worlds import add_folder, find_file

CALIBRATION_ENDINGS = {".yaml", ".yml", ".json", ".xml", ".txt", ".bin"}


def _add(command: argparse.ArgumentParser) -> None:
    command.add_argument("world", metavar="FILE", help="world, mesh or calibration to describe")
    add_folder(command)
    add_known(command)
    command.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> None:
    from ..info import info, info_cameras
    from ..world.load import load_with_assumed_axis

    path = Path(find_file(options.world))
    if path.is_dir() or options.camera_format is not None or _is_calibration(path):
        cameras = load_calibration(options.world, options)
        print(info_cameras(cameras, cameras.rigs))
    else:
        print(info(load_with_assumed_axis(path, folder=options.folder)))


def _is_calibration(path: Path) -> bool:
    """Returns True for endings of calibration files, but False for a robot in an .xml file."""
    from ..robots import has_robot_root

    ending = path.suffix.lower()
    return ending in CALIBRATION_ENDINGS and not (ending == ".xml" and has_robot_root(path))


COMMAND = Command(
    _add,
    "show the contents of a world or a calibration: counts, bounds, cameras",
    [
        "raycam info room.toml",
        "raycam info camchain.yaml",
        "raycam info panda.urdf                  joints, limits and links",
    ],
)
