"""Hesai's angle correction files (CSV).

Source: HesaiLidar_SDK_2.0, correction/angle_correction.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ...errors import LidarError
from .reading import base_description, finite, read_text
from .tables import read_table

__all__ = ["read_hesai"]

BY_CHANNELS = {32: "pandar-xt32", 64: "pandar64"}


def read_hesai(path: Path, device: str | None) -> dict[str, Any]:
    """Returns the description of a unit from a CSV file with "Channel,Elevation,Azimuth".

    Other CSV files are read as tables of pulses.
    """
    lines = [line.strip() for line in read_text(path).splitlines()]
    names = [name.strip().lower() for name in lines[0].split(",")] if lines else []
    if not names or not names[0].startswith(("channel", "laser id")):
        return read_table(path, device)
    for wanted in ("elevation", "azimuth"):
        if not any(name.startswith(wanted) for name in names):
            raise LidarError(
                f"{path}, line 1: column {wanted} is missing; found: {', '.join(names)}", code="missing_value"
            )
    tilt = next(i for i, name in enumerate(names) if name.startswith("elevation"))
    turn = next(i for i, name in enumerate(names) if name.startswith("azimuth"))
    channels: dict[int, tuple[float, float]] = {}
    for number, line in enumerate(lines[1:], 2):
        if not line:
            continue
        cells, where = line.split(","), f"{path}, line {number}"
        if len(cells) != len(names):
            raise LidarError(f"{where}: {len(cells)} values; expected {len(names)}", code="wrong_shape")
        channel = int(finite(cells[0], f"{where}: channel"))
        elevation, azimuth = (
            finite(cells[tilt], f"{where}: elevation"),
            finite(cells[turn], f"{where}: azimuth"),
        )
        if abs(elevation) > 90.0:
            raise LidarError(
                f"{where}: elevation is {elevation}; expected degrees within +-90", code="out_of_range"
            )
        if channel in channels:
            raise LidarError(f"{where}: channel {channel} is listed twice", code="duplicate_name")
        channels[channel] = (elevation, azimuth)
    if sorted(channels) != list(range(1, len(channels) + 1)):
        raise LidarError(
            f"{path}: channels must be 1 to {len(channels)}, each once, got {min(channels)} to {max(channels)}",
            code="duplicate_name",
        )
    description = base_description(path, device, "hesai", len(channels), BY_CHANNELS)
    rows = [channels[channel] for channel in sorted(channels)]
    description["hesai"] = {
        **description["hesai"],
        "elevations": [row[0] for row in rows],
        "azimuths": [row[1] for row in rows],
    }
    return description
