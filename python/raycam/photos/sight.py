"""Visibility of surface points from a camera.

Results are the pixel, the incidence, the occlusion, and the resolution on the surface.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from .._core import world_points_in_sight
from ..arguments import Bools, Floats
from ..camera import Camera
from ..io.fork_guard import no_fork
from ..world import World

__all__ = ["Facing", "Sight", "find_sight"]

Facing = Literal["front", "both"]


@dataclass(frozen=True)
class Sight:
    """The points that are visible from a camera."""

    index: npt.NDArray[np.int64]
    """The visible points' numbers [k], ascending."""
    pixels: Floats
    """The pixel coordinates of the visible points [k, 2]."""
    cosine: Floats
    """The cosines [k] of their angles of incidence, more than 0."""
    origins: Floats
    """Origins of the pixels' rays [k, 3]: the camera's centre (with a rolling shutter, at the time of the pixel's
    line).
    """
    footprints: Floats
    """Derivatives of the pixels along two orthonormal surface directions [k, 2, 2], in pixels per metre, by central
    differences; NaN if the lens cannot project the neighbourhood of a point. Empty unless requested.
    """


def find_sight(
    world: World,
    camera: Camera,
    points: Floats,
    normals: Floats,
    *,
    facing: Facing = "front",
    min_cosine: float = 0.0,
    footprints: bool = False,
    threads: int | None = None,
) -> Sight:
    """Returns which of the points [n, 3] with unit normals [n, 3] are visible from the camera.

    A point is visible if it projects through the lens into the image, if its front (with `facing` "both", either
    side) faces the camera at a cosine above `min_cosine`, and if no triangle is between it and the origin of its
    pixel's ray. The footprints are computed if `footprints` is True.
    """
    query = {
        "positions": np.ascontiguousarray(points, np.float64),
        "normals": np.ascontiguousarray(normals, np.float64),
        "both_sides": facing == "both",
        "min_cosine": min_cosine,
        "footprints": footprints,
        "threads": threads,
    }
    with no_fork():
        world._core.prepare(threads)
    return Sight(**world_points_in_sight(world._core, camera._core, query))


def in_morton_order(points: Floats) -> npt.NDArray[np.int64]:
    """Returns the order [n] of points along a Morton curve.

    Rays to neighbouring points are then traced together.
    """
    low, high = points.min(axis=0), points.max(axis=0)
    extent = max(float((high - low).max()), 1e-300)
    cells = np.clip((points - low) / extent * 1023, 0, 1023).astype(np.uint64)
    code = np.zeros(len(points), np.uint64)
    for bit in range(10):
        for axis in range(3):
            code |= ((cells[:, axis] >> np.uint64(bit)) & np.uint64(1)) << np.uint64(3 * bit + axis)
    order: npt.NDArray[np.int64] = np.argsort(code, kind="stable")
    return order


def meets_front(world: World, camera: Camera, grid: Floats, threads: int | None = None) -> Bools:
    """Returns True for each ray whose first surface faces the camera, False for other hits.

    The rays pass through the pixels `grid` [n, 2]; rays that miss the world are omitted.
    """
    found = world.cast_rays(*camera.rays(grid), fields=("t", "front"), threads=threads)
    front: Bools = found["front"][np.isfinite(found["t"])]
    return front
