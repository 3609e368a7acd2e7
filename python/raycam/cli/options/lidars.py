"""Lidars on the command line: a device by name, or the file of a unit's calibration."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal

from ...errors import SettingsError

if TYPE_CHECKING:
    from ...lidar import Lidar
    from ...rig import Rig

__all__ = ["find_lidar", "mount_lidars"]


def find_lidar(text: str, settings: Mapping[str, Any], up: Literal["z", "y"] = "z") -> Lidar:
    """Returns the lidar of a device's name, or of a calibration file (FILE, or FILE:DEVICE).

    Raises `LidarError` for unknown devices and malformed files, and `FileNotFoundError`.
    """
    from ...lidar import Lidar, load_lidar

    path, _, device = text.rpartition(":")
    if path and os.path.exists(path):
        return load_lidar(path, device, up=up, **settings)
    if os.path.exists(text) or os.path.splitext(text)[1]:
        return load_lidar(text, up=up, **settings)
    return Lidar(text, up=up, **settings)


def mount_lidars(rig: Rig, texts: Sequence[str]) -> Rig:
    """Returns the rig with the lidars of `--lidar NAME=DEVICE@X,Y,Z`; raises `SettingsError` for malformed texts."""
    import numpy as np

    from ...rig import Rig

    if not texts:
        return rig
    body = rig.at_pose(np.eye(3), [0.0, 0.0, 0.0])
    sensors = dict(body.sensors)
    for text in texts:
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
        if name in sensors:
            raise SettingsError(
                f"--lidar {text}: the rig already has a sensor {name!r}", code="duplicate_name"
            )
        sensors[name] = find_lidar(device, {}).placed(place)
    return Rig(sensors, rig.R, rig.C, name=rig.name, up=rig.up)
