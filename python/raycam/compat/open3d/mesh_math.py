"""Normals, areas and transforms of meshes given as arrays.

Both of Open3D's mesh classes use these functions.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from .arguments import RaycastingError, array_of, matrix

__all__ = [
    "check_rotation",
    "check_vector",
    "face_vectors",
    "move_points",
    "normalize",
    "sum_at_vertices",
]

Floats = npt.NDArray[np.float64]


def face_vectors(vertices: Any, triangles: Any) -> Floats:
    """Returns the triangles' normals [m, 3], with twice their areas as lengths."""
    corners = np.asarray(vertices, np.float64).reshape(-1, 3)[np.asarray(triangles, np.int64).reshape(-1, 3)]
    return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


def sum_at_vertices(count: int, triangles: Any, vectors: Floats) -> Floats:
    """Returns for each of `count` vertices the sum [count, 3] of its triangles' vectors."""
    total = np.zeros((count, 3))
    for corner in np.asarray(triangles, np.int64).reshape(-1, 3).T:
        np.add.at(total, corner, vectors)
    return total


def normalize(vectors: Floats) -> Floats:
    """Returns the vectors [n, 3] with length 1.

    A vector of length 0 becomes (0, 0, 1), as in Open3D.
    """
    lengths = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.where(lengths > 0, vectors / np.where(lengths > 0, lengths, 1), [0.0, 0.0, 1.0])


def check_vector(name: str, values: Any) -> Floats:
    """Returns three finite numbers as float64 [3]; otherwise raises `RaycastingError`."""
    array = array_of(name, values)
    if array.size != 3 or array.dtype.kind not in "fiu" or not np.isfinite(array).all():
        raise RaycastingError(f"{name}: expected three finite numbers, got {array.tolist()}")
    return array.reshape(3).astype(np.float64)


def check_rotation(values: Any) -> Floats:
    """Returns an invertible matrix [3, 3] as float64; otherwise raises `RaycastingError`."""
    return matrix("R", values, 3)


def move_points(points: Any, linear: Floats, offset: Any = 0.0) -> Floats:
    """Returns the points [n, 3], multiplied by a matrix [3, 3] and moved by an offset [3]."""
    moved: Floats = np.asarray(points, np.float64).reshape(-1, 3) @ linear.T + offset
    return moved
