"""Normals and areas of triangles given by their corners."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ..arguments import Floats

__all__ = ["face_areas", "face_normals", "interpolate", "unique_rows"]


def face_normals(corners: Floats) -> Floats:
    """Returns unit normals [n, 3] of triangles [n, 3, 3].

    Corners are counter-clockwise seen from outside; the normal is 0 for a triangle without area.
    """
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.sqrt((across**2).sum(axis=1, keepdims=True))
    normals: Floats = np.divide(across, length, out=np.zeros_like(across), where=length > 0)
    return normals


def face_areas(corners: Floats) -> Floats:
    """Returns the areas [n] of triangles [n, 3, 3], in the square of their unit."""
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas: Floats = np.sqrt((across**2).sum(axis=1)) / 2
    return areas


def interpolate(weights: Floats, values: Floats) -> Floats:
    """Returns the values [n, k] at points of triangles, from barycentric weights [n, 3] and corner values [n, 3, k].

    The values are bit-identical on every processor, unlike those of `np.einsum`.
    """
    each = weights[:, :, None] * values
    found: Floats = each[:, 0] + each[:, 1] + each[:, 2]
    return found


def unique_rows(rows: Floats) -> tuple[Floats, npt.NDArray[np.int64]]:
    """Returns the different rows [u, k] of an array [n, k], and the number of each row [n].

    The different rows are in ascending order. The function equals `np.unique(rows, axis=0, return_inverse=True)`, in a
    quarter of the time.
    """
    order = np.lexsort(rows.T[::-1])
    ordered = rows[order]
    is_new = np.ones(len(rows), bool)
    is_new[1:] = (ordered[1:] != ordered[:-1]).any(axis=1)
    number = np.empty(len(rows), np.int64)
    number[order] = np.cumsum(is_new) - 1
    return ordered[is_new], number
