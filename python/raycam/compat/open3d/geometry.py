"""Open3D's legacy mesh, with the methods used for rays and distances."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from . import mesh_math as math
from .absent import Hints, raise_missing
from .arguments import matrix
from .shapes import SHAPES
from .utility import Vector3dVector, Vector3iVector

__all__ = ["TriangleMesh"]

Floats = npt.NDArray[np.float64]
PARTS = ("vertices", "triangles", "vertex_normals", "triangle_normals", "vertex_colors")
"""The names of a mesh's arrays."""


class TriangleMesh(Hints):
    """A triangle mesh with normals and colours, as in Open3D.

    `vertices` are float64 [n, 3], and `triangles` int32 [m, 3]. `create_box`, `create_sphere`,
    `create_cylinder`, `create_cone`, `create_torus`, `create_tetrahedron`, `create_octahedron` and
    `create_icosahedron` return the vertices and triangles of Open3D, in its order.
    """

    def __init__(self, vertices: Any = (), triangles: Any = ()) -> None:
        """Creates a mesh from arrays, or a copy of another mesh."""
        if isinstance(vertices, TriangleMesh):
            for name in PARTS:
                setattr(self, name, getattr(vertices, name).copy())
            return
        self.vertices = Vector3dVector(vertices)
        self.triangles = Vector3iVector(triangles)
        self.vertex_normals = Vector3dVector()
        self.triangle_normals = Vector3dVector()
        self.vertex_colors = Vector3dVector()

    def __add__(self, other: TriangleMesh) -> TriangleMesh:
        """Returns a mesh with the triangles of both meshes.

        Normals and colours are kept if both meshes have them.
        """
        if not isinstance(other, TriangleMesh):
            return NotImplemented
        both = TriangleMesh(
            np.concatenate([self.vertices, other.vertices]),
            np.concatenate([self.triangles, np.asarray(other.triangles) + len(self.vertices)]),
        )
        for name in PARTS[2:]:
            parts = (getattr(self, name), getattr(other, name))
            if all(len(part) for part in parts):
                setattr(both, name, Vector3dVector(np.concatenate(parts)))
        return both

    def compute_triangle_normals(self, normalized: bool = True) -> TriangleMesh:
        """Sets `triangle_normals` and returns the mesh.

        Without `normalized`, the normals' lengths are twice the triangles' areas.
        """
        vectors = math.face_vectors(self.vertices, self.triangles)
        self.triangle_normals = math.normalize(vectors) if normalized else vectors
        return self

    def compute_vertex_normals(self, normalized: bool = True) -> TriangleMesh:
        """Sets `vertex_normals` and `triangle_normals`, and returns the mesh.

        Vertex normals are area-weighted means of the triangles' normals.
        """
        vectors = math.face_vectors(self.vertices, self.triangles)
        self.triangle_normals = vectors
        self.vertex_normals = math.sum_at_vertices(len(self.vertices), self.triangles, vectors)
        return self.normalize_normals() if normalized else self

    def normalize_normals(self) -> TriangleMesh:
        """Sets the lengths of all normals to 1; returns the mesh."""
        self.vertex_normals = math.normalize(Vector3dVector(self.vertex_normals))
        self.triangle_normals = math.normalize(Vector3dVector(self.triangle_normals))
        return self

    def transform(self, transformation: Any) -> TriangleMesh:
        """Moves vertices and normals by a matrix [4, 4]; returns the mesh."""
        moved = matrix("transformation", transformation, 4)
        return self._move(moved[:3, :3], moved[:3, 3])

    def translate(self, translation: Any, relative: bool = True) -> TriangleMesh:
        """Moves the vertices by `translation` [3], or with `relative=False` their centre to it."""
        offset = math.check_vector("translation", translation)
        self.vertices = Vector3dVector(self.vertices) + (offset if relative else offset - self.get_center())
        return self

    def scale(self, scale: float, center: Any) -> TriangleMesh:
        """Scales the vertices about a point [3]; returns the mesh."""
        fixed = math.check_vector("center", center)
        self.vertices = (Vector3dVector(self.vertices) - fixed) * float(scale) + fixed
        return self

    def rotate(self, R: Any, center: Any = None) -> TriangleMesh:
        """Rotates vertices and normals by a matrix [3, 3] about a point [3], by default the centre."""
        rotation = math.check_rotation(R)
        fixed = self.get_center() if center is None else math.check_vector("center", center)
        return self._move(rotation, fixed - rotation @ fixed)

    def _move(self, linear: Floats, offset: Floats) -> TriangleMesh:
        self.vertices = math.move_points(self.vertices, linear, offset)
        self.vertex_normals = math.move_points(self.vertex_normals, linear)
        self.triangle_normals = math.move_points(self.triangle_normals, linear)
        return self

    def paint_uniform_color(self, color: Any) -> TriangleMesh:
        """Sets the colour [3], 0 to 1, of all vertices; returns the mesh."""
        self.vertex_colors = np.tile(math.check_vector("color", color), (len(self.vertices), 1))
        return self

    def get_center(self) -> Floats:
        """Returns the mean [3] of the vertices."""
        vertices = Vector3dVector(self.vertices)
        return vertices.mean(axis=0) if len(vertices) else np.zeros(3)

    def get_min_bound(self) -> Floats:
        """Returns the smallest coordinates [3]."""
        vertices = Vector3dVector(self.vertices)
        return vertices.min(axis=0) if len(vertices) else np.zeros(3)

    def get_max_bound(self) -> Floats:
        """Returns the largest coordinates [3]."""
        vertices = Vector3dVector(self.vertices)
        return vertices.max(axis=0) if len(vertices) else np.zeros(3)

    def get_surface_area(self) -> float:
        """Returns the area of all triangles."""
        return float(np.linalg.norm(math.face_vectors(self.vertices, self.triangles), axis=1).sum() / 2)

    def is_empty(self) -> bool:
        """True if the mesh has no vertices."""
        return not self.has_vertices()

    def has_vertices(self) -> bool:
        """Returns True if the mesh has vertices."""
        return len(self.vertices) > 0

    def has_triangles(self) -> bool:
        """Returns True if the mesh has triangles."""
        return self.has_vertices() and len(self.triangles) > 0

    def has_vertex_normals(self) -> bool:
        """Returns True if every vertex has a normal."""
        return self.has_vertices() and len(self.vertex_normals) == len(self.vertices)

    def has_triangle_normals(self) -> bool:
        """Returns True if every triangle has a normal."""
        return self.has_triangles() and len(self.triangle_normals) == len(self.triangles)

    def has_vertex_colors(self) -> bool:
        """Returns True if every vertex has a colour."""
        return self.has_vertices() and len(self.vertex_colors) == len(self.vertices)


def _creator(shape: str) -> Any:
    """The static method `create_...` of a shape."""

    def create(*sizes: Any, **keys: Any) -> TriangleMesh:
        return TriangleMesh(*SHAPES[shape](*sizes, **keys))

    create.__name__ = f"create_{shape}"
    create.__doc__ = SHAPES[shape].__doc__
    return staticmethod(create)


for _shape in SHAPES:
    setattr(TriangleMesh, f"create_{_shape}", _creator(_shape))


def __getattr__(name: str) -> Any:
    """Raises an `AttributeError` that names an alternative."""
    return raise_missing("open3d.geometry", name, "install Open3D, or use trimesh")
