"""The polygons of a prim as arrays."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

__all__ = ["Faces", "find_fault", "find_unusable_faces", "order_corners"]


class Faces(NamedTuple):
    """The arrays of a polygon mesh."""

    points: Any
    """The points of the mesh [n, 3]."""
    counts: Any
    """The number of corners of each face."""
    indices: Any
    """The point of each corner, counterclockwise from outside."""
    normals: Any = None
    """Unit normals [corners, 3] of a curved surface; None for flat faces."""


def find_fault(faces: Faces) -> str | None:
    """The reason why the arrays are invalid; None for valid faces."""
    points, counts, indices = faces.points, faces.counts, faces.indices
    if (counts < 0).any() or counts.sum() != len(indices):
        return f"faceVertexCounts add up to {counts.sum()}, but faceVertexIndices has {len(indices)} values"
    if len(indices) and not (indices.min() >= 0 and indices.max() < len(points)):
        return f"faceVertexIndices has values outside 0 to {len(points) - 1}"
    return None if len(indices) else "the mesh has no faces"


def find_unusable_faces(faces: Faces) -> Any:
    """A mask of the faces with fewer than three corners or with a point that is not finite."""
    finite = np.isfinite(faces.points).all(axis=1)
    unusable = faces.counts < 3
    if finite.all():
        return unusable
    odd = np.append(~finite[faces.indices], False)
    ends = np.cumsum(faces.counts)
    sums = np.concatenate([[0], np.cumsum(odd)])
    return unusable | (sums[ends] > sums[ends - faces.counts])


def order_corners(counts: Any, faces: Any, left_handed: bool, mirrored: bool) -> Any:
    """The corners of the faces in order, each face counterclockwise as seen from outside."""
    ends = np.cumsum(counts)
    sizes = counts[faces]
    starts = ends[faces] - sizes
    total = int(sizes.sum())
    place = np.arange(total) - np.repeat(np.cumsum(sizes) - sizes, sizes)
    if mirrored or left_handed:
        size = np.repeat(sizes, sizes)
        if mirrored:
            place = (size - place) % size
        if left_handed:
            place = size - 1 - place
    return place + np.repeat(starts, sizes)
