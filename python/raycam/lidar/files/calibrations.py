"""`load_lidar`: calibrations of individual units, and patterns from tables."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, Literal

from ...errors import LidarError
from ..device import device_description
from ..lidar import Lidar
from .hesai import read_hesai
from .ouster import read_ouster
from .tables import read_table
from .velodyne import read_velodyne_xml, read_velodyne_yaml

__all__ = ["load_lidar"]

MAX_FILE_BYTES = 1 << 28
"""The largest calibration file."""

READERS: dict[str, Callable[[Path, str | None], dict[str, Any]]] = {
    ".json": read_ouster,
    ".yaml": read_velodyne_yaml,
    ".yml": read_velodyne_yaml,
    ".xml": read_velodyne_xml,
    ".csv": read_hesai,
    ".txt": read_table,
    ".npy": read_table,
    ".npz": read_table,
    ".mat3x4f": read_table,
}
"""The reader of each extension: (path, device) -> description."""


def load_lidar(
    path: str | os.PathLike[str],
    device: str | None = None,
    *,
    up: Literal["z", "y"] = "z",
    **settings: Any,
) -> Lidar:
    """Returns the lidar of a calibration file.

    The file contains the angles, offsets and times of an individual unit.

    ================= ==========================================================================================
    .json             Ouster metadata, flat or nested, of all firmware versions since 1.12
    .yaml, .yml       Velodyne, of the ROS driver: all corrections
    .xml              Velodyne's db.xml
    .csv              Hesai's angle correction (Channel, Elevation, Azimuth); or a table
    .csv, .txt        table: time, azimuth, elevation (or zenith), with a header; degrees, seconds
    .npy, .npz        table: directions [n, 3], or arrays "directions", "times", "rings", "origins"
    .mat3x4f          table of RGL: float32 matrices [n, 3, 4], with the rays along their z axes
    ================= ==========================================================================================

    `device` is a device name (`raycam lidars`), whose other settings apply (default: by the number of lasers in the
    file, and Ouster's product line); `up` and `settings` as for `Lidar`. Raises `LidarError` with file, line and value
    for a malformed file or the calibration of another device, and `FileNotFoundError`.
    """
    file = Path(path)
    reader = READERS.get(file.suffix.lower())
    if reader is None:
        raise LidarError(f"{file}: unknown extension; supported: {', '.join(READERS)}", code="unknown_format")
    size = file.stat().st_size
    if size > MAX_FILE_BYTES:
        raise LidarError(
            f"{file}: the calibration file is too large: {size} bytes; the limit is {MAX_FILE_BYTES}",
            code="budget_exceeded",
        )
    if device is not None:
        device_description(device)
    description = reader(file, device)
    return Lidar._described(description, settings, up)
