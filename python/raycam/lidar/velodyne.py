"""Velodyne's spinning devices: each laser fires at its own time, while the azimuth advances.

Sources: VLP-16 User Manual 63-9243, chapter 9; `rawdata.cpp` of ros-drivers/velodyne.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from ..arguments import Floats
from ..elementary import cos, sin
from ..errors import LidarError
from .pattern import Pattern, check_count, grid_pattern

__all__ = ["Laser", "velodyne_pattern", "velodyne_rings"]

NEAR_X, NEAR_Y, FAR = 2.4, 1.93, 25.04
"""Distances in metres at which Velodyne's two-point corrections are measured."""
ANGLES = ("vert_correction", "rot_correction")
"""The corrections in radians."""
MAX_CORRECTION = 100.0
"""The largest correction of a distance or position, in metres."""


@dataclass(frozen=True)
class Laser:
    """The calibration of one laser, in radians and metres, with the names of the ROS driver."""

    vert_correction: float
    """The elevation in radians."""
    rot_correction: float = 0.0
    """The angle by which the beam lags behind the azimuth."""
    dist_correction: float = 0.0
    """The constant added to the measured distance."""
    vert_offset_correction: float = 0.0
    """The offset of the beam across its direction, upwards."""
    horiz_offset_correction: float = 0.0
    """The offset of the beam across its direction, to the left."""
    dist_correction_x: float | None = None
    """The distance correction of x at 2.4 m; None without two-point corrections."""
    dist_correction_y: float | None = None
    """The distance correction of y at 1.93 m."""
    height: float = 0.0
    """The height of the beam's origin above the sensor's."""


def velodyne_rings(lasers: Sequence[Laser]) -> list[int]:
    """Returns the ring of each laser: 0 has the lowest elevation, as in the ROS driver."""
    order = sorted(range(len(lasers)), key=lambda laser: lasers[laser].vert_correction)
    rings = [0] * len(lasers)
    for ring, laser in enumerate(order):
        rings[laser] = ring
    return rings


def velodyne_pattern(lasers: Sequence[Laser], offsets: Sequence[float], cycle: float, rate: float) -> Pattern:
    """Returns one turn, made of complete firing cycles.

    A cycle takes `cycle` seconds, and laser i fires `offsets[i]` seconds after the cycle's start. The azimuth of the
    rotor in degrees is 360 * rate * time, clockwise as seen from above; the azimuth 0 is the x axis.
    """
    columns = math.floor(1.0 / rate / cycle)
    check_count(columns * len(lasers))
    times = np.arange(columns)[:, None] * cycle + np.asarray(offsets)[None, :]
    turn = 2.0 * math.pi * rate * times
    angles = turn - np.array([laser.rot_correction for laser in lasers])
    cos_a, sin_a = cos(angles), sin(angles)
    near, far = _decode(lasers, cos_a, sin_a, None), _decode(lasers, cos_a, sin_a, FAR)
    per_metre = far - near
    size = np.sqrt(per_metre[..., 0] ** 2 + per_metre[..., 1] ** 2 + per_metre[..., 2] ** 2)
    start = np.array([-laser.dist_correction for laser in lasers])
    metres = FAR - start
    scale = metres / size
    return grid_pattern(times, per_metre / size[..., None], near, velodyne_rings(lasers), start, scale)


def _decode(lasers: Sequence[Laser], cos_a: Floats, sin_a: Floats, distance: float | None) -> Floats:
    """Returns the position [columns, lasers, 3] that the driver computes for a distance.

    `distance` is the measured distance in metres; None means the distance whose corrected value is 0. A
    two-point correction depends on the sign of the position, for which the position at the distance `FAR` is
    used. Positions are therefore linear in the distance, and each beam is a line.
    """
    column = {name: np.array([asdict(laser)[name] for laser in lasers], dtype=float) for name in _NUMBERS}
    cos_v = cos(column["vert_correction"])
    sin_v = sin(column["vert_correction"])
    left, up, constant = (
        column["horiz_offset_correction"],
        column["vert_offset_correction"],
        column["dist_correction"],
    )
    measured = -constant if distance is None else np.full(len(lasers), distance)
    corrected = measured + constant

    def along(length: Floats) -> tuple[Floats, Floats]:
        flat = length * cos_v - up * sin_v
        return flat * cos_a + left * sin_a, flat * sin_a - left * cos_a

    forward, right = along(corrected)
    far_forward, far_right = along(np.full(len(lasers), FAR) + constant)
    more_right, more_forward = np.zeros_like(cos_a), np.zeros_like(cos_a)
    two_point = np.array([laser.dist_correction_x is not None for laser in lasers])
    if two_point.any():
        at_x, at_y = np.nan_to_num(column["dist_correction_x"]), np.nan_to_num(column["dist_correction_y"])
        x, y = right * np.sign(far_right), forward * np.sign(far_forward)
        shift_x = (constant - at_x) * (x - NEAR_X) / (FAR - NEAR_X) + at_x - constant
        shift_y = (constant - at_y) * (y - NEAR_Y) / (FAR - NEAR_Y) + at_y - constant
        more_right, more_forward = np.where(two_point, shift_x, 0.0), np.where(two_point, shift_y, 0.0)
    x = along(corrected + more_forward)[0]
    y = -along(corrected + more_right)[1]
    z = (corrected + more_forward) * sin_v + up * cos_v + column["height"]
    return np.stack([x, y, np.broadcast_to(z, x.shape)], axis=-1)


_NUMBERS = tuple(Laser.__dataclass_fields__)


def laser_from_keys(keys: dict[str, float], where: str) -> Laser:
    """Returns the laser in a calibration file.

    Raises `LidarError`, with `where`, for missing or impossible values.
    """
    for name in ANGLES:
        if name not in keys:
            raise LidarError(f"{where}: key {name} is missing", code="missing_value")
    if not abs(keys["vert_correction"]) <= math.pi / 2:
        raise LidarError(
            f"{where}: vert_correction is {keys['vert_correction']}; expected radians within +-pi/2 (90 degrees)",
            code="out_of_range",
        )
    known = {name: value for name, value in keys.items() if name in _NUMBERS and name != "height"}
    for name, value in known.items():
        if name not in ANGLES and not abs(value) <= MAX_CORRECTION:
            raise LidarError(
                f"{where}: {name} is {value:g}; expected metres within +-{MAX_CORRECTION:g}",
                code="out_of_range",
            )
    if not (known.get("dist_correction_x") or known.get("dist_correction_y")):
        known.pop("dist_correction_x", None)
        known.pop("dist_correction_y", None)
    numbers: dict[str, Any] = known
    return Laser(**numbers)
