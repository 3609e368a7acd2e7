"""Exact intersections of rays with round geoms, whose meshes are inscribed in the exact surface."""

from __future__ import annotations

import numpy as np

from ...arguments import Floats
from .model import CAPSULE, CYLINDER, ELLIPSOID, SPHERE

__all__ = ["ROUND", "round_distances"]

ROUND = (SPHERE, CAPSULE, ELLIPSOID, CYLINDER)
"""Types of geoms with curved surfaces (`mjtGeom`)."""
Interval = tuple[Floats, Floats]
"""The distances [n] at which rays enter and leave a convex shape; (+inf, -inf) for rays that miss it."""


def round_distances(kind: int, size: Floats, pose: Floats, origins: Floats, directions: Floats) -> Floats:
    """Returns the distances [n] along rays to the surface of a round geom, in units of the directions' lengths.

    `size` [3] is `mjModel.geom_size`, and `pose` [4, 4] is world_from_geom. Rays that start inside the shape meet its
    surface where they leave it. Returns +inf for rays that miss the shape.
    """
    start, along = (origins - pose[:3, 3]) @ pose[:3, :3], directions @ pose[:3, :3]
    if kind in (SPHERE, ELLIPSOID):
        half_axes = size if kind == ELLIPSOID else size[0]
        enter, leave = _ball(start / half_axes, along / half_axes, 1.0)
    else:
        radius, half = float(size[0]), float(size[1])
        enter, leave = _cylinder(start, along, radius, half)
        if kind == CAPSULE:
            for height in (-half, half):
                first, last = _ball(start - [0.0, 0.0, height], along, radius)
                enter, leave = np.minimum(enter, first), np.maximum(leave, last)
    distance = np.where(enter >= 0, enter, leave)
    return np.where((enter <= leave) & (distance >= 0), distance, np.inf)


def _ball(start: Floats, along: Floats, radius: float) -> Interval:
    """Intersects rays with a ball around the origin, or with a disk if the vectors have two components."""
    a = np.einsum("nc,nc->n", along, along)
    with np.errstate(divide="ignore", invalid="ignore"):
        closest = -np.einsum("nc,nc->n", start, along) / a
        foot = start + closest[:, None] * along
        half = np.sqrt((radius**2 - np.einsum("nc,nc->n", foot, foot)) / a)
    enter, leave = closest - half, closest + half
    missed = ~np.isfinite(half)
    enter[missed], leave[missed] = np.inf, -np.inf
    return enter, leave


def _cylinder(start: Floats, along: Floats, radius: float, half: float) -> Interval:
    """Intersects rays with a cylinder along z, from -`half` to `half`."""
    enter, leave = _ball(start[:, :2], along[:, :2], radius)
    is_axial = ~along[:, :2].any(axis=1)
    inside = is_axial & (np.einsum("nc,nc->n", start[:, :2], start[:, :2]) <= radius**2)
    enter[inside], leave[inside] = -np.inf, np.inf
    with np.errstate(divide="ignore", invalid="ignore"):
        ends = (np.array([[-half], [half]]) - start[:, 2]) / along[:, 2]
    low, high = ends.min(axis=0), ends.max(axis=0)
    level = along[:, 2] == 0
    between = abs(start[:, 2]) <= half
    low[level] = np.where(between[level], -np.inf, np.inf)
    high[level] = -low[level]
    enter, leave = np.maximum(enter, low), np.minimum(leave, high)
    missed = enter > leave
    enter[missed], leave[missed] = np.inf, -np.inf
    return enter, leave
