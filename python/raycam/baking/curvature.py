"""Mean curvature of triangle meshes."""

from __future__ import annotations

import numpy as np

from ..arguments import Floats
from ..world.face_geometry import face_normals, unique_rows

__all__ = ["corner_curvatures"]


def corner_curvatures(corners: Floats) -> Floats:
    """Returns the mean curvature [f, 3], 1/metre, at the corners of triangles [f, 3, 3].

    It is positive where the surface is convex (1 / radius for a ball), and 0 at vertices on open borders. Corners with
    equal positions are one vertex. The curvature is the area gradient of a vertex's one-ring, relative to the vertex's
    mixed Voronoi area. Source: Meyer, Desbrun, Schröder and Barr, Discrete differential-geometry operators for
    triangulated 2-manifolds, 2003.
    """
    positions, vertex = unique_rows(corners.reshape(-1, 3))
    vertex, count = vertex.reshape(-1, 3), len(positions)
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    double_area = np.sqrt((across**2).sum(axis=1))
    flat = double_area <= 0
    safe = np.where(flat, 1.0, double_area)
    # Edge i is opposite to corner i, from corner i + 1 to corner i + 2.
    edge = np.roll(corners, -2, axis=1) - np.roll(corners, -1, axis=1)
    squared = (edge**2).sum(axis=2)
    dots = -(np.roll(edge, -1, axis=1) * np.roll(edge, -2, axis=1)).sum(axis=2)
    cotangent = np.where(flat[:, None], 0.0, dots / safe[:, None])
    gradient, area, normal = np.zeros((count, 3)), np.zeros(count), np.zeros((count, 3))
    obtuse = dots < 0
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        # Both corners of the edge from j to k get its vector times the cotangent of the angle at corner i.
        pull = cotangent[:, i, None] * (corners[:, j] - corners[:, k])
        _add(gradient, vertex[:, j], pull)
        _add(gradient, vertex[:, k], -pull)
        voronoi = (squared[:, j] * cotangent[:, j] + squared[:, k] * cotangent[:, k]) / 8
        part = np.where(obtuse.any(axis=1), np.where(obtuse[:, i], 1 / 4, 1 / 8) * double_area, voronoi)
        area += np.bincount(vertex[:, i], weights=np.where(flat, 0.0, part), minlength=count)
        _add(normal, vertex[:, i], face_normals(corners) * double_area[:, None])
    size = np.sqrt((gradient**2).sum(axis=1)) / np.maximum(4 * area, 1e-300)
    signed = np.where((gradient * normal).sum(axis=1) < 0, -size, size)
    signed[(area <= 0) | _on_border(vertex, count)] = 0
    found: Floats = signed[vertex]
    return found


def _add(sums: Floats, place: np.ndarray, values: Floats) -> None:
    """Adds each row of `values` [n, 3] to the row of `sums` whose index is in `place` [n]."""
    for axis in range(3):
        sums[:, axis] += np.bincount(place, weights=values[:, axis], minlength=len(sums))


def _on_border(vertex: np.ndarray, count: int) -> np.ndarray:
    """True [count] for vertices of edges that belong to one face only."""
    ends = np.sort(np.stack([vertex, np.roll(vertex, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
    key, inverse, uses = np.unique(ends[:, 0] * count + ends[:, 1], return_inverse=True, return_counts=True)
    del key
    border = np.zeros(count, bool)
    border[ends[uses[inverse] == 1].ravel()] = True
    return border
