"""Lidars on the command line: a device by name, or the file of a unit's calibration."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Literal

if TYPE_CHECKING:
    from ...lidar import Lidar

__all__ = ["find_lidar"]


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
