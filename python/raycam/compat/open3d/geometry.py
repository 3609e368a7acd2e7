"""Open3D's older mesh, as far as rays and distances need it."""

from __future__ import annotations

from typing import Any

from .utility import Vector3dVector, Vector3iVector

__all__ = ["TriangleMesh"]


class TriangleMesh:
    """`vertices` float64 [n, 3] and `triangles` int32 [m, 3]."""

    def __init__(self, vertices: Any = (), triangles: Any = ()) -> None:
        self.vertices = Vector3dVector(vertices)
        self.triangles = Vector3iVector(triangles)

    def transform(self, matrix: Any) -> TriangleMesh:
        """Moves the vertices by a matrix [4, 4]; returns the mesh."""
        import numpy as np

        moved = np.asarray(matrix, dtype=np.float64)
        self.vertices = Vector3dVector(self.vertices) @ moved[:3, :3].T + moved[:3, 3]
        return self

    def translate(self, offset: Any) -> TriangleMesh:
        """Moves the vertices by [3]; returns the mesh."""
        self.vertices = Vector3dVector(self.vertices) + Vector3dVector(offset)
        return self

    def has_triangles(self) -> bool:
        """True if the mesh has triangles."""
        return len(self.triangles) > 0
