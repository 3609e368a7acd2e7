"""The tables `[[robot]]` and `[[robot.camera]]` of world files."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import _core
from ..camera import Camera
from ..errors import Error, WorldError, nearest, with_code
from ..robots import Robot, place_camera

if TYPE_CHECKING:
    from .building import WorldBuilding

__all__ = ["add_robot_tables", "has_robots", "robot_lines", "split_robots"]

ROBOT_KEYS = (
    "name", "file", "location", "roll", "pitch", "yaw", "matrix", "joints", "clamp_joints", "packages", "geometry",
    "category", "missing", "up_axis", "xacro_args", "camera",
)  # fmt: skip
"""Keys of `[[robot]]`."""


def has_robots(description: Mapping[str, Any]) -> bool:
    """Returns True for a world's description with robots."""
    return isinstance(description, Mapping) and "robot" in description


def split_robots(
    description: Mapping[str, Any],
) -> tuple[dict[str, Any], list[dict[str, Any]], dict[str, Any]]:
    """Separates the robots from a world's description.

    Returns the rest of the description, the robots, and the video. If the video moves joints, the rest does not contain
    the video; otherwise, the returned video is empty.
    """
    rest = dict(description)
    tables = rest.pop("robot")
    if not isinstance(tables, Sequence) or not all(isinstance(table, Mapping) for table in tables):
        raise WorldError("robot: expected tables [[robot]]", code="wrong_type")
    video = rest.get("video")
    frames = video.get("keyframe", []) if isinstance(video, Mapping) else []
    moves = any(isinstance(frame, Mapping) and "robot" in frame for frame in frames)
    return rest, [dict(table) for table in tables], dict(rest.pop("video")) if moves else {}


def robot_lines(text: str) -> list[int]:
    """Returns the line of each `[[robot]]` of a world file."""
    # A search for the brackets is faster than a match of each line.
    starts = [found.start() for found in re.finditer(r"\[\[[ \t]*robot[ \t]*\]\]", text)]
    return [
        text.count("\n", 0, start) + 1
        for start in starts
        if not text[text.rfind("\n", 0, start) + 1 : start].strip()
    ]


def add_robot_tables(
    world: WorldBuilding,
    tables: Sequence[Mapping[str, Any]],
    folder: str | os.PathLike[str],
    lines: Sequence[int] = (),
) -> None:
    """Adds the robots of `[[robot]]` tables; `lines` are the tables' lines, for messages.

    Robots, packages, meshes and calibrations are read from `folder` only. Raises `WorldError`, and the errors of
    `World.add_robot` and of reading a calibration.
    """
    for number, table in enumerate(tables):
        line = f"line {lines[number]}: " if number < len(lines) else ""
        try:
            _add(world, dict(table), Path(folder))
        except Error as error:
            raise type(error)(f"{line}robot[{number}]: {error}", code=error.code) from None
        except OSError as error:
            text = f"{error.strerror} ({line}robot[{number}])"
            raise with_code(type(error)(error.errno, text, error.filename)) from None


def _add(world: WorldBuilding, table: dict[str, Any], folder: Path) -> None:
    for key in table:
        if key not in ROBOT_KEYS:
            raise WorldError(nearest("key", key, list(ROBOT_KEYS)), code="unknown_key")
    file = table.pop("file", None)
    if not isinstance(file, str):
        raise WorldError(f"file: expected the name of a robot file, got {file!r}", code="wrong_type")
    cameras = table.pop("camera", [])
    if not isinstance(cameras, Sequence) or not all(isinstance(one, Mapping) for one in cameras):
        raise WorldError("camera: expected tables [[robot.camera]]", code="wrong_type")
    packages = table.pop("packages", [])
    if not isinstance(packages, Sequence) or isinstance(packages, str):
        raise WorldError(f"packages: expected a list of folders, got {packages!r}", code="wrong_type")
    path = _inside(folder, file)
    robot = world.add_robot(path, folder=folder, packages=[folder / package for package in packages], **table)
    for camera in cameras:
        _mount(world, robot, dict(camera), folder)


def _inside(folder: Path, name: str) -> Path:
    """Returns the path of a file in the world's folder.

    Raises `WorldError` for a path outside of the folder, and `OSError` for a missing file.
    """
    path = folder / name
    if not Path(os.path.realpath(path)).is_relative_to(os.path.realpath(folder)):
        raise WorldError(f"{name!r} is outside the world's folder {folder}", code="outside_root")
    try:
        path.stat()
    except OSError as error:
        raise with_code(error) from None
    return path


def _mount(world: WorldBuilding, robot: Robot, table: dict[str, Any], folder: Path) -> None:
    """Adds a camera of a robot, named `robot/camera`.

    The camera's pose in the table is relative to the link.
    """
    link, name = table.pop("link", None), table.pop("name", "camera")
    if not isinstance(link, str) or not isinstance(name, str):
        raise WorldError(
            f"camera: name and link must be strings, got {name!r} and {link!r}", code="wrong_type"
        )
    calibration = table.pop("calibration", None)
    if calibration is None:
        if "C" in table:
            table.setdefault("R", np.eye(3).tolist())
        on_link = Camera.from_dict(table, up=world.up)
    else:
        on_link = _calibrated(_inside(folder, str(calibration)), table)
    full = f"{robot.name}/{name}"
    if full in world.cameras:
        raise WorldError(f"camera {full!r}: the name already exists", code="duplicate_name")
    world.add_camera(place_camera(on_link, robot.pose(link)), full)
    robot._cameras.append((full, link, on_link))


def _calibrated(path: Path, table: dict[str, Any]) -> Camera:
    """The first camera of a calibration file, with `R` and `C` of the table."""
    for key in table:
        if key not in ("R", "C"):
            raise WorldError(
                f"camera: {nearest('key', key, ['name', 'link', 'calibration', 'R', 'C'])}",
                code="unknown_key",
            )
    records, _ = _core.read_cameras(os.fspath(path), None, None, None)
    camera = Camera._of(records[0].camera(), "z")
    return camera.at_pose(table.get("R", camera.R), table.get("C", camera.location))
