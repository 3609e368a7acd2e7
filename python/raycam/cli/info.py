"""The command `raycam info`."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from .options.cameras import add_known, load_calibration
from .options.command import Command
from .options.worlds import add_folder, find_file

if TYPE_CHECKING:
    from ..calibration import Cameras


def _add(command: argparse.ArgumentParser) -> None:
    command.add_argument("world", metavar="FILE", help="world, mesh or calibration to describe")
    add_folder(command)
    add_known(command)
    command.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> None:
    from ..errors import FormatError, WorldError
    from ..info import info, info_cameras
    from ..world.load import load_with_assumed_axis

    path = Path(find_file(options.world))
    if path.is_dir() or options.camera_format is not None or _is_calibration(path):
        cameras = load_calibration(options.world, options)
        print(info_cameras(cameras, cameras.rigs))
        return
    try:
        world = load_with_assumed_axis(path, folder=options.folder)
    except (FormatError, WorldError):
        if path.suffix.lower() != ".toml" or (found := _calibration_in_toml(options)) is None:
            raise
        print(info_cameras(found, found.rigs))
    else:
        print(info(world))


def _calibration_in_toml(options: argparse.Namespace) -> Cameras | None:
    """The cameras of a TOML file that is not a world, such as Anipose's; None for other files."""
    from ..errors import FormatError

    try:
        return load_calibration(options.world, options)
    except FormatError:
        return None


def _is_calibration(path: Path) -> bool:
    """Returns True for endings of calibration files, but False for a robot in an .xml file."""
    from .._core import calibration_endings
    from ..robots import has_robot_root

    ending = path.suffix.lower()
    is_known = ending in (".bin", ".gz") or ending.removeprefix(".") in calibration_endings()
    return is_known and not (ending == ".xml" and has_robot_root(path))


COMMAND = Command(
    _add,
    "show the contents of a world or a calibration: counts, bounds, cameras",
    [
        "raycam info room.toml",
        "raycam info camchain.yaml",
        "raycam info panda.urdf                  joints, limits and links",
    ],
)
