"""Lidars on the command line: a device by name, or the file of a unit's calibration."""

from __future__ import annotations

import argparse
import os
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal

from ...errors import LidarError, SettingsError, nearest

if TYPE_CHECKING:
    from ...lidar import Lidar
    from ...rig import Rig
    from ...world import World

__all__ = ["add_lidar_pose", "chosen_lidar", "find_lidar", "mount_lidars", "world_lidars"]


def add_lidar_pose(command: argparse._ActionsContainer) -> None:
    """Adds the pose of the lidar in the world."""
    pose = command.add_argument_group("pose")
    pose.add_argument(
        "--location",
        metavar=("X", "Y", "Z"),
        nargs=3,
        type=float,
        help="position of the lidar in the world in metres (default: the world file's pose, or 0 0 0)",
    )
    for name, text in (
        ("yaw", "rotate the lidar counterclockwise, seen from above"),
        ("pitch", "tilt the lidar's front downwards"),
        ("roll", "rotate the lidar clockwise about its forward axis, seen from behind"),
    ):
        pose.add_argument(f"--{name}", metavar="DEGREES", type=float, help=f"{text}, in degrees (default: 0)")


def find_lidar(text: str, settings: Mapping[str, Any], up: Literal["z", "y"] = "z") -> Lidar:
    """Returns the lidar for a device name or a calibration file (FILE, or FILE:DEVICE).

    Raises `LidarError` for unknown devices and malformed files, and `FileNotFoundError` for missing files.
    """
    from ...lidar import Lidar, load_lidar

    path, _, device = text.rpartition(":")
    if path and os.path.exists(path):
        return load_lidar(path, device, up=up, **settings)
    if _is_file(text):
        return load_lidar(text, up=up, **settings)
    return Lidar(text, up=up, **settings)


def _is_file(text: str) -> bool:
    """Returns True if `text` is an existing file, FILE:DEVICE, or a name with an extension."""
    path = text.rpartition(":")[0]
    return os.path.exists(path) or os.path.exists(text) or bool(os.path.splitext(text)[1])


def mount_lidars(rig: Rig | None, texts: Sequence[str]) -> Rig:
    """Returns the rig with the lidars of `--lidar NAME=DEVICE@X,Y,Z`.

    Without a rig, returns a rig of these lidars only. Raises `SettingsError` for malformed texts, and for names that
    the rig already contains.
    """
    import numpy as np

    from ...rig import Rig

    if rig is not None and not texts:
        return rig
    sensors = {} if rig is None else dict(rig.at_pose(np.eye(3), [0.0, 0.0, 0.0]).sensors)
    for text in texts:
        name, lidar = _placed_lidar(text)
        if name in sensors:
            raise SettingsError(
                f"--lidar {text}: the rig already has a sensor {name!r}", code="duplicate_name"
            )
        sensors[name] = lidar
    return Rig(sensors) if rig is None else Rig(sensors, rig.R, rig.C, name=rig.name, up=rig.up)


def _placed_lidar(text: str, up: Literal["z", "y"] = "z") -> tuple[str, Lidar]:
    """Returns the name and the lidar of NAME=DEVICE@X,Y,Z.

    Raises `SettingsError` for other texts.
    """
    name, equals, rest = text.partition("=")
    device, at, numbers = rest.rpartition("@")
    try:
        place = [float(number) for number in numbers.split(",")]
    except ValueError:
        place = []
    if not (name and equals and device and at and len(place) == 3):
        raise SettingsError(
            f"--lidar {text}: expected NAME=DEVICE@X,Y,Z, as in LIDAR_TOP=vlp16@0,0,1.8",
            code="invalid_value",
        )
    return name, find_lidar(device, {}, up).placed(place)


def world_lidars(world: World, texts: Sequence[str]) -> dict[str, Lidar]:
    """Returns lidars by name: lidars of the world, and devices placed in the world.

    A lidar of the world is given as NAME, and a placed device as NAME=DEVICE@X,Y,Z. Raises `SettingsError`
    for malformed texts and names used twice, and `LidarError` for unknown names.
    """
    from ...lidar import lidar_named

    found: dict[str, Lidar] = {}
    for text in texts:
        name, lidar = _placed_lidar(text, world.up) if "=" in text else (text, lidar_named(world, text))
        if name in found:
            raise SettingsError(f"--lidar {text}: {name!r} is given twice", code="duplicate_name")
        found[name] = lidar
    return found


def chosen_lidar(world: World, options: argparse.Namespace, settings: dict[str, Any]) -> Lidar:
    """The lidar of the world file, of a device or of a calibration, at its pose.

    Raises `SettingsError` if `--lidar` is not given and the world has no lidar or several lidars. Raises
    `LidarError` for a name that is neither a lidar of the world, nor a device, nor a file.
    """
    from ...lidar import Lidar, device_names, lidar_named

    own = {name: sensor for name, sensor in world.sensors.items() if isinstance(sensor, Lidar)}
    name = options.lidar
    if name is None:
        if len(own) != 1:
            found = f"the world has the lidars {', '.join(own)}" if own else "the world file has no lidar"
            raise SettingsError(f"{found}; select a lidar with --lidar NAME", code="missing_value")
        name = next(iter(own))
    is_own = any(name in (key, key.rpartition("/")[2]) for key in own)
    angles = [getattr(options, angle) for angle in ("roll", "pitch", "yaw")]
    is_placed = options.location is not None or any(angle is not None for angle in angles)
    if is_own:
        lidar = lidar_named(world, name).replace(**settings)
        if not is_placed:
            return lidar
    elif own and name not in device_names() and not _is_file(name):
        known = nearest("lidar", name, [*own, *device_names()])
        raise LidarError(f"{known}; to list all devices, run: raycam lidars", code="unknown_name")
    else:
        lidar = find_lidar(name, settings, world.up)
    return lidar.placed(options.location or (0.0, 0.0, 0.0), *(angle or 0.0 for angle in angles))
