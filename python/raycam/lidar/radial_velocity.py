"""The rate of change of the distance between a lidar and a surface.

FMCW lidars measure this rate.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from ..arguments import Floats
from .pose import Track
from .surface_motion import surface_velocities

if TYPE_CHECKING:
    from ..world import World

__all__ = ["radial_velocities", "sensor_drift"]


def sensor_drift(track: Track, times: Floats, origins: Floats, directions: Floats) -> Floats:
    """Returns the rate [n, k] in m/s at which a sensor's motion on `track` lengthens its rays.

    `origins` [n, k, 3] are the starts of the rays relative to the sensor's position, and `directions` [n, k, 3] are
    unit vectors; both are in world axes. The rate is negative if the sensor moves along the ray.
    """
    linear, angular = track.velocity_at(times)
    moved = linear[:, None] + np.cross(angular[:, None], origins)
    drift: Floats = -(moved * directions).sum(axis=-1)
    return drift


def radial_velocities(
    world: World,
    drift: Floats,
    arrival: Floats,
    fields: dict[str, npt.NDArray[Any]],
    times: Floats,
    threads: int | None,
) -> npt.NDArray[np.float32]:
    """Returns the rates at which the distances of hits change, in m/s, float32 [n].

    `fields` describes the hits, and `times` [n] are their times. The rate is positive if the distance increases.
    `drift` [n] is the rate caused by the motion of the sensor, mirrors and glass; `arrival` [n, 3] is the direction of
    the light at the surface times the refractive index. Only the motion of the surface's point and of the points on
    mirrors and glass counts. The path may also meet mirrors and glass at other points than before, but by Fermat's
    principle such a shift does not change the path's length.
    """
    moved = surface_velocities(world, fields, times, threads)
    rate: npt.NDArray[np.float32] = (drift + (moved * arrival).sum(axis=1)).astype(np.float32)
    return rate
