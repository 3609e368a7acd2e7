"""Options that select cameras from worlds and calibrations."""

from __future__ import annotations

import argparse
import os
from typing import TYPE_CHECKING

from ...errors import SettingsError, with_code
from .command import parse_size
from .messages import print_notices
from .worlds import find_file

if TYPE_CHECKING:
    from ...calibration import Cameras
    from ...camera import Camera
    from ...world import World

__all__ = [
    "WORLD_ENDINGS",
    "add_calibration",
    "add_camera",
    "add_known",
    "add_size",
    "find_calibration",
    "load_calibration",
    "load_camera",
    "select_camera",
]

WORLD_ENDINGS = (".toml", ".glb", ".gltf")
"""Endings of world files that may contain cameras."""
MAX_ASPECT_CHANGE = 0.01
"""Relative change of the aspect ratio up to which `--size` resizes a camera."""


def add_camera(command: argparse.ArgumentParser) -> None:
    """Adds `--camera`, `--size` and the options of `add_calibration`."""
    command.add_argument(
        "--camera",
        metavar="NAME|FILE[:NAME]",
        help="camera to render: the name of a camera in the world, or a calibration or world file with cameras "
        "(default: the first camera that is not on a robot's link)",
    )
    add_size(command, "image size in pixels; the field of view stays the camera's")
    add_calibration(command)


def add_size(command: argparse.ArgumentParser, help_text: str) -> None:
    """Adds `--size`."""
    command.add_argument("--size", metavar="WxH", type=parse_size, help=help_text)


def add_known(command: argparse.ArgumentParser) -> None:
    """Adds `--format`, `--size` and the options of `add_calibration`, for commands whose subject is a calibration."""
    add_size(command, "image size in pixels; cameras in FILE that have another size are resized")
    add_calibration(command, "--format")


def add_calibration(command: argparse.ArgumentParser, *format_names: str) -> None:
    """Adds options for a calibration's format and for values that its file may lack.

    Messages about calibrations recommend these options, so every command that reads calibrations needs all of them.
    `format_names` are further names of `--camera-format`.
    """
    command.add_argument(
        *format_names,
        "--camera-format",
        dest="camera_format",
        metavar="FORMAT",
        help="format of the files that contain cameras (default: detected from their contents)",
    )
    command.add_argument(
        "--intrinsics",
        metavar="FILE",
        help="calibration file whose first camera provides the intrinsics if the calibration contains only poses",
    )
    command.add_argument(
        "--direction",
        metavar="NAME",
        help="direction of the calibration's poses, if the file does not specify it: world_from_camera or "
        "camera_from_world (lists of poses without a direction are read as world_from_camera)",
    )
    command.add_argument(
        "--axes",
        metavar="NAME",
        help="camera axes of the calibration's poses, if the file does not specify them: opencv (default) or opengl",
    )
    command.add_argument(
        "--lens",
        metavar="MODEL",
        help="lens model of the calibration's coefficients, if the file does not specify it: opencv, fisheye, ...",
    )


def load_calibration(path: str, options: argparse.Namespace) -> Cameras:
    """Loads the cameras of a file with `--size` and the options of `add_calibration`; prints the notices."""
    from ...calibration import load_cameras

    size, lens, intrinsics = options.size, options.lens, None
    if options.intrinsics is not None:
        intrinsics = next(iter(load_cameras(options.intrinsics, size=size, model=lens).values()))
        lens = None
    cameras = load_cameras(
        path,
        options.camera_format,
        size=size,
        intrinsics=intrinsics,
        model=lens,
        direction=options.direction,
        axes=options.axes,
    )
    print_notices(cameras.notices)
    return cameras


def find_calibration(text: str) -> tuple[str, str] | None:
    """Splits FILE or FILE:NAME into file and name; None if there is no such file."""
    file, _, name = text.rpartition(":")
    for path, camera in ((text, ""), (file, name)):
        if path and os.path.exists(found := find_file(path)):
            return os.fspath(found), camera
    return None


def load_camera(text: str, options: argparse.Namespace) -> Camera:
    """Loads the first camera of FILE, or the camera FILE:NAME.

    FILE is a calibration or a world file.
    """
    from ...world.load import load

    found = find_calibration(text)
    if found is None:
        from ...world.missing_files import nearest_names

        raise with_code(
            FileNotFoundError(
                f"{text}: file not found; expected a calibration or a world file{nearest_names(text)}"
            )
        )
    file, name = found
    if os.path.isfile(file) and file.endswith(WORLD_ENDINGS):
        world = load(file)
        return world.camera(name) if name else world.default_camera()
    cameras = load_calibration(file, options)
    return cameras.find(name) if name else next(iter(cameras.values()))


def select_camera(world: World, options: argparse.Namespace) -> Camera:
    """Returns the camera of `--camera` and `--size` at its own pose."""
    given = options.camera
    if given is None:
        camera = world.default_camera()
    elif given in world.cameras:
        camera = world.camera(given)
    elif find_calibration(given) is not None:
        camera = load_camera(given, options)
    elif os.sep in given or os.path.splitext(given)[1]:
        from ...world.missing_files import nearest_names

        raise SettingsError(
            f"--camera {given}: file not found, and the world has no camera with this name{nearest_names(given)}",
            code="unknown_name",
        )
    else:
        camera = world.camera(given)
    if options.size is None:
        return camera
    (width, height), (new_width, new_height) = camera.size, options.size
    if width * new_height and abs(new_width * height / (width * new_height) - 1.0) > MAX_ASPECT_CHANGE:
        raise SettingsError(
            f"--size {new_width}x{new_height}: the aspect ratio differs from the camera's, {width}x{height}",
            code="conflicting_values",
        )
    return camera.resized(options.size)
