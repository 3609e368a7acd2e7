"""The motion of a world's surfaces while a lidar scans them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from .. import _core
from ..arguments import Floats

if TYPE_CHECKING:
    from ..world import World

__all__ = ["surface_velocities", "world_moves"]


def world_moves(world: World) -> bool:
    """True if objects may move after the world's time."""
    return world._core.time is not None and world._core.is_animated


def surface_velocities(
    world: World, fields: dict[str, npt.NDArray[Any]], times: Floats | None, threads: int | None
) -> Floats:
    """Returns the velocities [n, 3] of hit points that move with their surfaces, in m/s.

    Velocities are in world axes, and 0 for instance -1. `times` [n] are seconds after the world's time.
    """
    count = len(fields["instance"])
    if times is None or not count or not world_moves(world):
        return np.broadcast_to(np.zeros(3), (count, 3))
    points = {
        "instance": np.ascontiguousarray(fields["instance"]),
        "triangle": np.ascontiguousarray(fields["triangle"]),
        "barycentric": np.ascontiguousarray(fields["barycentric"], np.float64),
        "time": np.ascontiguousarray(times, np.float64),
        "threads": threads,
    }
    return _core.world_velocities(world._core, points)
