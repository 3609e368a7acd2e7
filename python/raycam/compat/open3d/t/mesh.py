"""The mesh of tensors that `RaycastingScene` accepts."""

from __future__ import annotations

from typing import Any

import numpy as np

from .. import geometry
from .. import mesh_math as math
from ..absent import Hints
from ..arguments import array_of, matrix
from ..core import Device, Tensor
from ..shapes import SHAPES

__all__ = ["TriangleMesh"]


class Attributes(dict[str, Any]):
    """The attributes of a mesh, as a dict whose keys are also Python attributes."""

    def __getattr__(self, name: str) -> Any:
        """The attribute of this name; raises `AttributeError` that lists the attributes."""
        try:
            return self[name]
        except KeyError:
            listed = ", ".join(self) or "none"
            raise AttributeError(f"the mesh has no attribute {name!r}; available: {listed}") from None

    def __setattr__(self, name: str, value: Any) -> None:
        self[name] = value


class TriangleMesh(Hints):
    """A mesh of tensors: `vertex.positions` float32 [n, 3] and `triangle.indices` int64 [m, 3].

    The shapes of the older mesh (`create_box`, `create_sphere`, ...) exist here too, with `float_dtype`, `int_dtype`
    and `device`.
    """

    def __init__(
        self, vertex_positions: Any = None, triangle_indices: Any = None, device: Device | None = None
    ) -> None:
        self.vertex = Attributes()
        self.triangle = Attributes()
        if vertex_positions is not None and not isinstance(vertex_positions, Device):
            self.vertex["positions"] = Tensor(array_of("vertex_positions", vertex_positions))
            self.triangle["indices"] = Tensor(array_of("triangle_indices", triangle_indices))

    @classmethod
    def from_legacy(
        cls, mesh_legacy: Any, vertex_dtype: Any = None, triangle_dtype: Any = None, device: Any = None
    ) -> TriangleMesh:
        """Converts a mesh with `vertices` and `triangles`.

        By default, positions become float32 and indices int64, as in Open3D.
        """
        floats = vertex_dtype or np.float32
        mesh = cls(
            np.asarray(mesh_legacy.vertices, dtype=floats),
            np.asarray(mesh_legacy.triangles, dtype=triangle_dtype or np.int64),
        )
        for attributes, name, source in (
            (mesh.vertex, "normals", "vertex_normals"),
            (mesh.vertex, "colors", "vertex_colors"),
            (mesh.triangle, "normals", "triangle_normals"),
        ):
            values = np.asarray(getattr(mesh_legacy, source, ()), dtype=floats)
            if len(values):
                attributes[name] = Tensor(values)
        return mesh

    def to_legacy(self) -> geometry.TriangleMesh:
        """The older mesh with the same positions, indices, normals and colours."""
        mesh = geometry.TriangleMesh(self._positions(), self._indices())
        for attributes, name, target in (
            (self.vertex, "normals", "vertex_normals"),
            (self.vertex, "colors", "vertex_colors"),
            (self.triangle, "normals", "triangle_normals"),
        ):
            if name in attributes:
                setattr(mesh, target, np.asarray(attributes[name], dtype=np.float64))
        return mesh

    @property
    def device(self) -> Device:
        """The CPU."""
        return Device()

    @property
    def is_cpu(self) -> bool:
        """True: every mesh is on the CPU."""
        return True

    @property
    def is_cuda(self) -> bool:
        """False: every mesh is on the CPU."""
        return False

    def cpu(self) -> TriangleMesh:
        """The mesh itself."""
        return self

    def to(self, device: Any, copy: bool = False) -> TriangleMesh:
        """The mesh itself, or a copy; `device` must be the CPU."""
        Device(str(device))
        return self.clone() if copy else self

    def clone(self) -> TriangleMesh:
        """A copy."""
        mesh = type(self)()
        mesh.vertex.update({name: Tensor(values) for name, values in self.vertex.items()})
        mesh.triangle.update({name: Tensor(values) for name, values in self.triangle.items()})
        return mesh

    def compute_triangle_normals(self, normalized: bool = True) -> TriangleMesh:
        """Sets `triangle.normals` and returns the mesh.

        Without `normalized`, the normals' lengths are twice the triangles' areas.
        """
        vectors = math.face_vectors(self._positions(), self._indices())
        self._set(self.triangle, "normals", math.normalize(vectors) if normalized else vectors)
        return self

    def compute_vertex_normals(self, normalized: bool = True) -> TriangleMesh:
        """Sets `vertex.normals` (area-weighted means) and `triangle.normals`; returns the mesh."""
        vectors = math.face_vectors(self._positions(), self._indices())
        total = math.sum_at_vertices(len(self._positions()), self._indices(), vectors)
        self._set(self.triangle, "normals", vectors)
        self._set(self.vertex, "normals", total)
        return self.normalize_normals() if normalized else self

    def normalize_normals(self) -> TriangleMesh:
        """Sets the lengths of all normals to 1; returns the mesh."""
        for attributes in (self.vertex, self.triangle):
            if "normals" in attributes:
                self._set(attributes, "normals", math.normalize(np.asarray(attributes["normals"], float)))
        return self

    def compute_triangle_areas(self) -> TriangleMesh:
        """Sets `triangle.areas` [m]; returns the mesh."""
        self._set(self.triangle, "areas", np.linalg.norm(self._vectors(), axis=1) / 2)
        return self

    def get_surface_area(self) -> float:
        """Returns the area of all triangles."""
        return float(np.linalg.norm(self._vectors(), axis=1).sum() / 2)

    def get_center(self) -> Tensor:
        """Returns the mean [3] of the positions."""
        return self._point(self._positions().mean(axis=0))

    def get_min_bound(self) -> Tensor:
        """Returns the smallest coordinates [3]."""
        return self._point(self._positions().min(axis=0))

    def get_max_bound(self) -> Tensor:
        """Returns the largest coordinates [3]."""
        return self._point(self._positions().max(axis=0))

    def is_empty(self) -> bool:
        """True if the mesh has no vertices."""
        return not ("positions" in self.vertex and len(self.vertex["positions"]))

    def transform(self, transformation: Any) -> TriangleMesh:
        """Moves positions and normals by a matrix [4, 4]; returns the mesh."""
        moved = matrix("transformation", transformation, 4)
        return self._move(moved[:3, :3], moved[:3, 3])

    def translate(self, translation: Any, relative: bool = True) -> TriangleMesh:
        """Moves the positions by `translation` [3], or with `relative=False` their centre to it."""
        offset = math.check_vector("translation", translation)
        center = 0.0 if relative else self._positions().mean(axis=0)
        self._set(self.vertex, "positions", self._positions() + offset - center)
        return self

    def scale(self, scale: float, center: Any) -> TriangleMesh:
        """Scales the positions about a point [3]; returns the mesh."""
        fixed = math.check_vector("center", center)
        self._set(self.vertex, "positions", (self._positions() - fixed) * float(scale) + fixed)
        return self

    def rotate(self, R: Any, center: Any) -> TriangleMesh:
        """Rotates positions and normals by a matrix [3, 3] about a point [3]; returns the mesh."""
        rotation, fixed = math.check_rotation(R), math.check_vector("center", center)
        return self._move(rotation, fixed - rotation @ fixed)

    def _move(self, linear: Any, offset: Any) -> TriangleMesh:
        self._set(self.vertex, "positions", math.move_points(self._positions(), linear, offset))
        for attributes in (self.vertex, self.triangle):
            if "normals" in attributes:
                self._set(attributes, "normals", math.move_points(attributes["normals"], linear))
        return self

    def _positions(self) -> Any:
        return np.asarray(self.vertex.positions, dtype=np.float64)

    def _indices(self) -> Any:
        return np.asarray(self.triangle.indices, dtype=np.int64)

    def _vectors(self) -> Any:
        return math.face_vectors(self._positions(), self._indices())

    def _point(self, values: Any) -> Tensor:
        return Tensor(values, dtype=np.asarray(self.vertex.positions).dtype)

    def _set(self, attributes: Attributes, name: str, values: Any) -> None:
        """Stores an attribute with the dtype of the positions."""
        attributes[name] = self._point(values)


def _creator(shape: str) -> Any:
    """The static method `create_...` of a shape."""

    def create(
        *sizes: Any,
        float_dtype: Any = np.float32,
        int_dtype: Any = np.int64,
        device: Any = None,
        **keys: Any,
    ) -> TriangleMesh:
        if device is not None:
            Device(str(device))
        vertices, triangles = SHAPES[shape](*sizes, **keys)
        return TriangleMesh(vertices.astype(float_dtype), triangles.astype(int_dtype))

    create.__name__ = f"create_{shape}"
    create.__doc__ = SHAPES[shape].__doc__
    return staticmethod(create)


for _shape in SHAPES:
    setattr(TriangleMesh, f"create_{_shape}", _creator(_shape))
