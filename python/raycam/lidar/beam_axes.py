"""The axes of beams: directions with the encoder's noise, in the world."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from ..arguments import Floats
from ..elementary import cos, sin
from .pattern import Pattern
from .pose import transform
from .random_numbers import standard_normals

if TYPE_CHECKING:
    from .lidar import Lidar

__all__ = ["azimuth_errors", "rotate_about_z", "world_axes"]


def world_axes(
    lidar: Lidar, pattern: Pattern, frame: int, pulses: npt.NDArray[np.int64]
) -> tuple[Floats, Floats]:
    """Returns the starts and the unit directions [n, 3] of the beams of `pulses` in the world.

    Each beam is given at the time of its pulse.
    """
    turns, places = lidar.track.at(pattern.times[pulses])
    errors = azimuth_errors(lidar, pattern, frame)[pulses]
    directions = transform(turns, rotate_about_z(pattern.directions[pulses], errors))
    return transform(turns, pattern.origins[pulses]) + places, directions


def azimuth_errors(lidar: Lidar, pattern: Pattern, frame: int) -> Floats:
    """Returns the error of each pulse's azimuth in radians [n].

    The encoder has one error per column.
    """
    settings = lidar.settings
    sigma = math.radians(settings["azimuth_noise"]) if settings["noise"] else 0.0
    if sigma == 0.0 or not len(pattern):
        return np.zeros(len(pattern))
    columns = int(pattern.columns.max()) + 1
    errors: Floats = sigma * standard_normals(columns, settings["seed"], frame, "azimuth")
    return errors[pattern.columns]


def rotate_about_z(directions: Floats, angles: Floats) -> Floats:
    """Returns the directions [n, 3] rotated about z by `angles` [n], in radians."""
    if not angles.any():
        return directions
    c, s = cos(angles), sin(angles)
    x, y = directions[:, 0], directions[:, 1]
    return np.stack([c * x - s * y, s * x + c * y, directions[:, 2]], axis=1)
