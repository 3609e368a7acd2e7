"""Tests all triangles of a world against one ray, in blocks.

The results are counts, and the details of a few triangles.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from .. import reference
from ..reference.units import Bools, Floats

__all__ = ["BLOCK", "Indices", "TriangleTests", "intersect_all_triangles"]

Indices = npt.NDArray[np.int64]

# The numbers of triangles with full details: the closest hits, and the nearest misses.
HITS_SHOWN = 3
MISSES_SHOWN = 1
MISSES_SHOWN_WITHOUT_A_HIT = 2
BLOCK = 1 << 15
"""Triangles processed at a time, which limits temporary arrays to a few megabytes."""


@dataclass(frozen=True)
class TriangleTests:
    """The results of testing a ray against all triangles.

    The results contain counts for each test, and the details of a few triangles.
    """

    triangles: int
    without_area: int
    parallel: int
    behind: int
    outside: int
    shown: Indices
    """The triangles with full details, by t."""
    nearest: int
    """The index of the closest hit; -1 for a miss."""


def intersect_all_triangles(
    world_corners: Floats, points: Callable[[Floats], Floats], C: Floats, r: Floats
) -> TriangleTests:
    """Tests triangles [n, 3, 3] against the ray C + t r, with `C` and `r` [3].

    `points` converts the triangles' corners to the ray's units.
    """
    counts = np.zeros(4, dtype=np.int64)
    hits, misses = _Smallest(HITS_SHOWN), _Smallest(max(MISSES_SHOWN, MISSES_SHOWN_WITHOUT_A_HIT))
    for start in range(0, len(world_corners), BLOCK):
        corners = points(world_corners[start : start + BLOCK])
        n = reference.normals(corners)
        t = reference.plane_distances(n, corners[:, 0], C, r[None])[0]
        hit_t = reference.hit_distances(corners, n, C, r[None])[0]
        flat, inside = ~n.any(axis=1), np.isfinite(hit_t)
        outside = (t >= 0) & ~inside
        counts += [flat.sum(), (np.isnan(t) & ~flat).sum(), (t < 0).sum(), outside.sum()]
        hits.add(start + np.nonzero(inside)[0], hit_t[inside], t[inside])
        misses.add(start + np.nonzero(outside)[0], _narrowness(corners, t, outside, C, r), t[outside])
    most = MISSES_SHOWN if len(hits.index) else MISSES_SHOWN_WITHOUT_A_HIT
    shown = np.concatenate([hits.index, misses.index[:most]])
    t = np.concatenate([hits.t, misses.t[:most]])
    without_area, parallel, behind, outside_count = (int(count) for count in counts)
    return TriangleTests(
        triangles=len(world_corners),
        without_area=without_area,
        parallel=parallel,
        behind=behind,
        outside=outside_count,
        shown=shown[np.lexsort([shown, t])],
        nearest=int(hits.index[0]) if len(hits.index) else -1,
    )


def _narrowness(corners: Floats, t: Floats, missed: Bools, C: Floats, r: Floats) -> Floats:
    """Returns the distances between the ray and the centres of missed triangles.

    Each distance is measured in the triangle's plane and is relative to the triangle's size. `missed` selects
    the triangles.
    """
    corners = corners[missed]
    middle = (corners[:, 0] + corners[:, 1] + corners[:, 2]) / 3
    f = C + t[missed, None] * r
    radius = np.maximum.reduce([reference.length(corners[:, corner] - middle) for corner in range(3)])
    return np.asarray(reference.length(f - middle) / radius)


class _Smallest:
    """The triangles with the smallest keys; among equal keys, the first triangles."""

    def __init__(self, most: int) -> None:
        self.index = np.empty(0, np.int64)
        self.t = np.empty(0)
        self._most = most
        self._keys = np.empty(0)

    def add(self, index: Indices, keys: Floats, t: Floats) -> None:
        """Adds the next triangles, which have larger indices."""
        if len(keys) > self._most:
            found = np.partition(keys, self._most - 1)[self._most - 1]
            kept = ~(keys > found)
            index, keys, t = index[kept], keys[kept], t[kept]
        all_keys = np.concatenate([self._keys, keys])
        order = np.argsort(all_keys, kind="stable")[: self._most]
        self._keys = all_keys[order]
        self.index = np.concatenate([self.index, index])[order]
        self.t = np.concatenate([self.t, t])[order]
