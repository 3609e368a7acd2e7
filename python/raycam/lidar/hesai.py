"""Hesai's spinning devices: channels with an elevation, an azimuth offset and a firing time.

Source: HesaiLidar_SDK_2.0, parsers and correction files.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ..elementary import cos, sin
from .pattern import Pattern, check_count, grid_pattern

__all__ = ["hesai_pattern"]


def hesai_pattern(
    elevations: Sequence[float],
    azimuths: Sequence[float],
    fire_times: Sequence[float],
    columns: int,
    rate: float,
) -> Pattern:
    """Returns one turn of `columns` equal steps.

    `elevations`, `azimuths` (in degrees) and `fire_times` (in seconds after the column's start) have one value for
    each channel. `rate` is the number of turns per second. The azimuth runs clockwise as seen from above, from x.
    Ring numbers are the channels, counted from 0.
    """
    check_count(columns * len(elevations))
    times = np.arange(columns)[:, None] / (columns * rate) + np.asarray(fire_times)[None, :]
    offset = np.array([math.radians(angle) for angle in azimuths])
    angles = 2.0 * math.pi * rate * times + offset
    cos_a, sin_a = cos(angles), sin(angles)
    tilt = [math.radians(angle) for angle in elevations]
    cos_p, sin_p = cos(tilt), sin(tilt)
    directions = np.stack([cos_a * cos_p, -sin_a * cos_p, np.broadcast_to(sin_p, cos_a.shape)], axis=-1)
    return grid_pattern(times, directions, np.zeros(3), np.arange(len(elevations)))
