"""Visibility of surface points from a camera.

Results are the pixel, the incidence, the occlusion, and the resolution on the surface.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from ..arguments import Bools, Floats
from ..camera import Camera
from ..world import World

__all__ = ["Facing", "Sight", "find_sight", "footprints"]

Facing = Literal["front", "both"]
RELATIVE_STEP = 1e-4
"""Step of the finite differences of `footprints`, relative to the distance of the camera."""


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


def find_sight(
    world: World,
    camera: Camera,
    points: Floats,
    normals: Floats,
    *,
    facing: Facing = "front",
    min_cosine: float = 0.0,
    threads: int | None = None,
) -> Sight:
    """Returns which of the points [n, 3] with unit normals [n, 3] are visible from the camera.

    A point is visible if three conditions hold. It projects through the lens into the image. Its front (with `facing`
    "both", either side) faces the camera at a cosine above `min_cosine`. No triangle is between the point and the
    origin of its pixel's ray.
    """
    pixels, ok = camera.project(points)
    low = camera.corner
    with np.errstate(invalid="ignore"):
        ok = ok & (pixels >= low).all(axis=1) & (pixels < np.array(camera.size) + low).all(axis=1)
    index = np.flatnonzero(ok)
    pixels = pixels[index]
    origins, directions = camera.rays(pixels)
    towards = origins - points[index]
    length = np.sqrt((towards**2).sum(axis=1))
    with np.errstate(invalid="ignore", divide="ignore"):
        cosine = (towards * normals[index]).sum(axis=1) / length
    if facing == "both":
        cosine = np.abs(cosine)
    kept = np.isfinite(directions[:, 0]) & (cosine > min_cosine)
    index, pixels, origins, cosine = index[kept], pixels[kept], origins[kept], cosine[kept]
    clear = world.visible(points[index], origins, threads=threads)
    return Sight(index[clear], pixels[clear], cosine[clear], origins[clear])


def footprints(camera: Camera, points: Floats, normals: Floats, distance: Floats) -> Floats:
    """Returns derivatives [n, 2, 2] of pixels along two surface directions, in pixels per metre.

    They are computed by central differences. `distance` [n] is the distance to the camera. The result is NaN if the
    lens cannot project the neighbourhood of a point.
    """
    # Orthonormal basis after Duff et al., Building an orthonormal basis, revisited, 2017.
    x, y, z = normals.T
    sign = np.where(z >= 0, 1.0, -1.0)
    a = -1.0 / (sign + z)
    b = x * y * a
    tangents = (
        np.stack([1 + sign * x * x * a, sign * b, -sign * x], axis=1),
        np.stack([b, sign + y * y * a, -y], axis=1),
    )
    step = RELATIVE_STEP * distance[:, None]
    found = np.empty((len(points), 2, 2))
    for axis, tangent in enumerate(tangents):
        ahead, _ = camera.project(points + step * tangent)
        behind, _ = camera.project(points - step * tangent)
        found[:, :, axis] = (ahead - behind) / (2 * step)
    return found


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
