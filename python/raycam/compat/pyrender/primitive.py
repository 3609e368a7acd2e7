"""Primitives of pyrender: triangles, lines or points with a material."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from .colors import format_color_array
from .constants import GLTF
from .material import Material, MetallicRoughnessMaterial
from .values import Converted

__all__ = ["Bounded", "Primitive"]

Floats = npt.NDArray[Any]


class Bounded:
    """Base class for objects with bounds in their own coordinates."""

    @property
    def bounds(self) -> Floats:
        """The lower and upper corner [2, 3]."""
        raise NotImplementedError

    @property
    def centroid(self) -> Floats:
        """The centre of the bounds."""
        return np.asarray(self.bounds.mean(axis=0))

    @property
    def extents(self) -> Floats:
        """The lengths of the sides of the bounds."""
        return np.asarray(np.diff(self.bounds, axis=0)[0])

    @property
    def scale(self) -> float:
        """The length of the diagonal of the bounds."""
        return float(np.linalg.norm(self.extents))


class Primitive(Bounded):
    """Triangles, lines or points with one material, shown once or at each of `poses` [n, 4, 4].

    `mode` is the constant of `GLTF` for triangles, lines or points. The default material is white metal, as in
    pyrender; `Mesh.from_trimesh` uses a grey material.
    """

    positions = Converted(lambda value: _positions(value))
    indices = Converted(lambda value: None if value is None else np.asarray(value).astype(np.int64))
    mode = Converted(lambda value: _mode(value))
    material = Converted(lambda value: _material(value))
    poses = Converted(lambda value: _poses(value))

    def __init__(
        self,
        positions: npt.ArrayLike,
        normals: npt.ArrayLike | None = None,
        tangents: Any = None,
        texcoord_0: npt.ArrayLike | None = None,
        texcoord_1: Any = None,
        color_0: npt.ArrayLike | None = None,
        joints_0: Any = None,
        weights_0: Any = None,
        indices: npt.ArrayLike | None = None,
        material: Material | None = None,
        mode: int | None = None,
        targets: Any = None,
        poses: npt.ArrayLike | None = None,
    ) -> None:
        if targets is not None or joints_0 is not None:
            raise NotImplementedError(
                "morph targets and joints are not supported; deform the vertices and create a Primitive from them"
            )
        self.mode, self.positions, self.indices = mode, positions, indices
        self.normals, self.tangents = normals, tangents
        self.texcoord_0, self.texcoord_1, self.color_0 = texcoord_0, texcoord_1, color_0
        self.joints_0, self.weights_0, self.targets = joints_0, weights_0, targets
        self.material, self.poses = material, poses

    def _of_vertices(self, name: str, value: Any, columns: int) -> Any:
        """Vertex values [n, columns], or None; raises `ValueError` for other shapes."""
        if value is None:
            return None
        array = np.asarray(value, dtype=np.float64)
        if array.ndim != 2 or len(array) != len(self.positions) or array.shape[1] < columns:
            raise ValueError(
                f"{name} of shape {list(array.shape)}: expected [{len(self.positions)}, {columns}]"
            )
        return np.ascontiguousarray(array[:, :columns])

    @property
    def normals(self) -> Any:
        """The normals [n, 3], or None."""
        return self._normals

    @normals.setter
    def normals(self, value: Any) -> None:
        self._normals = self._of_vertices("normals", value, 3)

    @property
    def tangents(self) -> Any:
        """The tangents [n, 4], or None; they have no effect, as in pyrender."""
        return self._tangents

    @tangents.setter
    def tangents(self, value: Any) -> None:
        self._tangents = self._of_vertices("tangents", value, 4)

    @property
    def texcoord_0(self) -> Any:
        """The texture coordinates [n, 2] with v up, or None."""
        return self._texcoord_0

    @texcoord_0.setter
    def texcoord_0(self, value: Any) -> None:
        self._texcoord_0 = self._of_vertices("texcoord_0", value, 2)

    @property
    def texcoord_1(self) -> Any:
        """The second texture coordinates [n, 2], or None; they have no effect, as in pyrender."""
        return self._texcoord_1

    @texcoord_1.setter
    def texcoord_1(self, value: Any) -> None:
        self._texcoord_1 = self._of_vertices("texcoord_1", value, 2)

    @property
    def color_0(self) -> Any:
        """The colours [n, 4], float32, or None."""
        return self._color_0

    @color_0.setter
    def color_0(self, value: Any) -> None:
        self._color_0 = None if value is None else format_color_array(value, (len(self.positions), 4))

    def delete(self) -> None:
        """Does nothing, because no graphics memory is used."""

    @property
    def faces(self) -> npt.NDArray[np.int64]:
        """The vertex indices [m, 3] of the triangles."""
        order = np.arange(len(self.positions)) if self.indices is None else self.indices.reshape(-1)
        if self.mode == GLTF.TRIANGLE_FAN:
            first = np.full(max(0, len(order) - 2), order[0] if len(order) else 0)
            return np.stack([first, order[1:-1], order[2:]], axis=1)
        if self.mode == GLTF.TRIANGLE_STRIP:
            odd = np.arange(max(0, len(order) - 2)) % 2
            pairs = np.stack([order[:-2], order[1:-1]], axis=1)
            pairs[odd == 1] = pairs[odd == 1][:, ::-1]
            return np.concatenate([pairs, order[2:, np.newaxis]], axis=1)
        return np.asarray(order[: len(order) // 3 * 3].reshape(-1, 3))

    @property
    def segments(self) -> npt.NDArray[np.int64]:
        """The vertex indices [m, 2] of the lines, or of the edges of triangles."""
        order = np.arange(len(self.positions)) if self.indices is None else self.indices.reshape(-1)
        if self.mode == GLTF.LINES:
            return np.asarray(order[: len(order) // 2 * 2].reshape(-1, 2))
        if self.mode in (GLTF.LINE_STRIP, GLTF.LINE_LOOP):
            order = np.append(order, order[:1]) if self.mode == GLTF.LINE_LOOP else order
            return np.stack([order[:-1], order[1:]], axis=1)
        return np.asarray(self.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2))

    @property
    def has_faces(self) -> bool:
        """True if the primitive consists of triangles."""
        return self.mode in (GLTF.TRIANGLES, GLTF.TRIANGLE_STRIP, GLTF.TRIANGLE_FAN)

    @property
    def buf_flags(self) -> int:
        """The `BufFlags` of the vertex arrays."""
        arrays = (self.normals, self.tangents, self.texcoord_0, self.texcoord_1, self.color_0)
        return sum(1 << bit for bit, each in enumerate(arrays) if each is not None)

    @property
    def places(self) -> Floats:
        """The poses [n, 4, 4] at which the primitive is shown."""
        return np.eye(4)[np.newaxis] if self.poses is None else self.poses

    @property
    def bounds(self) -> Floats:
        """The lower and upper corner [2, 3] around all poses."""
        if len(self.positions) == 0:
            return np.zeros((2, 3))
        low, high = self.positions.min(axis=0), self.positions.max(axis=0)
        corners = np.array(
            [[x, y, z, 1] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])]
        )
        placed = (corners @ self.places.transpose(0, 2, 1)).reshape(-1, 4)[:, :3]
        return np.stack([placed.min(axis=0), placed.max(axis=0)])

    @property
    def is_transparent(self) -> bool:
        """True if surfaces behind the primitive may be visible."""
        return bool(self.material.is_transparent) or (
            self.color_0 is not None and bool((self.color_0[:, 3] != 1).any())
        )


def _positions(value: npt.ArrayLike) -> Floats:
    """Positions [n, 3]; an empty list means no points, and one point [3] is accepted."""
    array = np.ascontiguousarray(value, dtype=np.float64)
    array = array.reshape(0, 3) if array.size == 0 else np.atleast_2d(array)
    if array.ndim != 2 or array.shape[1] != 3:
        raise ValueError(f"positions of shape {list(array.shape)}: expected [n, 3]")
    return array


def _mode(value: Any) -> int:
    mode = GLTF.TRIANGLES if value is None else int(value)
    if not GLTF.POINTS <= mode <= GLTF.TRIANGLE_FAN:
        raise ValueError(f"mode is {value}: expected one of GLTF.POINTS (0) to GLTF.TRIANGLE_FAN (6)")
    return mode


def _material(value: Any) -> Material:
    if value is None:
        return MetallicRoughnessMaterial()
    if not isinstance(value, Material):
        raise TypeError(f"material is a {type(value).__name__}: expected a Material")
    return value


def _poses(value: Any) -> Floats | None:
    if value is None:
        return None
    poses = np.asarray(value, dtype=np.float64)
    poses = poses[np.newaxis] if poses.ndim == 2 else poses
    if poses.ndim != 3 or poses.shape[1:] != (4, 4):
        raise ValueError(f"poses of shape {list(poses.shape)}: expected [n, 4, 4]")
    return poses
