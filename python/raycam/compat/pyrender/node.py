"""Nodes of pyrender's scenes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from .camera import Camera
from .light import Light
from .mesh import Mesh
from .values import Converted, LiveArray, text

__all__ = ["Node"]

Floats = npt.NDArray[Any]


def _kept(what: str, kind: type) -> Converted:
    """Returns an attribute that accepts None and objects of the class `kind`.

    Assigning another value raises `TypeError`.
    """

    def convert(value: Any) -> Any:
        if value is not None and not isinstance(value, kind):
            raise TypeError(f"{what} is a {type(value).__name__}: expected a {kind.__name__}")
        return value

    return Converted(convert)


class Node:
    """A node of the scene graph: a pose relative to its parent, with a mesh, camera or light.

    The pose is a matrix, or translation, rotation (x, y, z, w) and scale. A matrix is stored unchanged, including
    mirroring and shear.
    """

    name = Converted(text)
    camera = _kept("camera", Camera)
    mesh = _kept("mesh", Mesh)
    light = _kept("light", Light)

    def __init__(
        self,
        name: str | None = None,
        camera: Camera | None = None,
        children: Sequence[Node] | None = None,
        skin: Any = None,
        matrix: npt.ArrayLike | None = None,
        mesh: Mesh | None = None,
        rotation: npt.ArrayLike | None = None,
        scale: npt.ArrayLike | None = None,
        translation: npt.ArrayLike | None = None,
        weights: Any = None,
        light: Light | None = None,
    ) -> None:
        self.name, self.camera, self.mesh, self.light = name, camera, mesh, light
        self.children = list(children or ())
        self.skin, self.weights = skin, weights
        self._matrix = np.eye(4)
        self._turn_and_scale: tuple[Floats, Floats] | None = None
        if matrix is not None:
            self.matrix = matrix
        elif not (translation is None and rotation is None and scale is None):
            self._compose(
                np.zeros(3) if translation is None else translation,
                [0, 0, 0, 1] if rotation is None else rotation,
                1.0 if scale is None else scale,
            )

    @property
    def matrix(self) -> Any:
        """A copy of parent_from_node [4, 4].

        Only assigning a whole matrix moves the node, as in pyrender.
        """
        return self._matrix.copy()

    @matrix.setter
    def matrix(self, value: npt.ArrayLike) -> None:
        matrix = np.array(value, dtype=np.float64)
        if matrix.shape != (4, 4):
            raise ValueError(f"matrix of shape {list(matrix.shape)}: expected [4, 4]")
        if not np.allclose(matrix[3], [0, 0, 0, 1]):
            raise ValueError(f"the last row of the matrix is {matrix[3]}: expected 0 0 0 1")
        self._matrix, self._turn_and_scale = matrix, None

    @property
    def translation(self) -> Any:
        """The translation [3]; assigned elements move the node."""
        return LiveArray(self._matrix[:3, 3], lambda value: setattr(self, "translation", value))

    @translation.setter
    def translation(self, value: npt.ArrayLike) -> None:
        place = np.asarray(value, dtype=np.float64)
        if place.shape != (3,) or not np.isfinite(place).all():
            raise ValueError(f"translation is {value!r}: expected three finite numbers")
        # The rest of the matrix, including mirroring and shear, is unchanged.
        matrix = self._matrix.copy()
        matrix[:3, 3] = place
        self._matrix = matrix

    @property
    def rotation(self) -> Any:
        """The unit quaternion x, y, z, w.

        Assigned elements turn the node. Raises `ValueError` for a quaternion of another length.
        """
        unit, _ = self._rotation_and_scale()
        return LiveArray(unit, lambda value: setattr(self, "rotation", value))

    @rotation.setter
    def rotation(self, value: npt.ArrayLike) -> None:
        self._compose(self.translation, value, self.scale)

    @property
    def scale(self) -> Any:
        """The scale [3] along the axes; assigned elements scale the node.

        The scale along x of a mirroring matrix is negative.
        """
        _, factors = self._rotation_and_scale()
        return LiveArray(factors, lambda value: setattr(self, "scale", value))

    @scale.setter
    def scale(self, value: npt.ArrayLike) -> None:
        self._compose(self.translation, self.rotation, value)

    def _rotation_and_scale(self) -> tuple[Floats, Floats]:
        """The unit quaternion x, y, z, w and the scale [3], as assigned or as in the matrix."""
        if self._turn_and_scale is None:
            columns = self._matrix[:3, :3]
            factors = np.linalg.norm(columns, axis=0)
            factors[0] *= -1.0 if np.linalg.det(columns) < 0 else 1.0
            self._turn_and_scale = (_quaternion(columns / np.where(factors == 0, 1, factors)), factors)
        return self._turn_and_scale

    def _compose(self, translation: npt.ArrayLike, rotation: npt.ArrayLike, scale: npt.ArrayLike) -> None:
        quaternion = np.asarray(rotation, dtype=np.float64)
        if quaternion.shape != (4,) or abs(np.linalg.norm(quaternion) - 1) > 1e-3:
            raise ValueError(f"rotation is {rotation!r}: expected a unit quaternion x, y, z, w")
        x, y, z, w = quaternion / np.linalg.norm(quaternion)
        turn = np.array(
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
            ]
        )
        factors = np.array(scale, dtype=np.float64)
        if factors.shape not in ((), (3,)) or not np.isfinite(factors).all():
            raise ValueError(f"scale is {scale!r}: expected one or three finite numbers")
        factors = np.broadcast_to(factors, 3).copy()
        matrix = np.eye(4)
        matrix[:3, :3] = turn * factors
        matrix[:3, 3] = translation
        self._matrix, self._turn_and_scale = matrix, (np.array([x, y, z, w]), factors)


def _quaternion(columns: Floats) -> Floats:
    """Returns the unit quaternion x, y, z, w of the rotation nearest to a matrix [3, 3].

    The matrix may be singular.
    """
    left, _, right = np.linalg.svd(columns)
    left[:, 2] *= np.sign(np.linalg.det(left @ right))
    turn = left @ right
    trace = np.trace(turn)
    # The largest component is computed first, to avoid division by a small number.
    squares = np.array([turn[0, 0], turn[1, 1], turn[2, 2], trace]) * 2 - np.array([*[trace] * 3, trace]) + 1
    k = int(np.argmax(squares))
    quaternion = np.empty(4)
    quaternion[k] = squares[k]
    if k == 3:
        quaternion[:3] = [turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]
    else:
        i, j = (k + 1) % 3, (k + 2) % 3
        quaternion[i], quaternion[j] = turn[i, k] + turn[k, i], turn[j, k] + turn[k, j]
        quaternion[3] = turn[j, i] - turn[i, j]
    return np.asarray(quaternion / np.linalg.norm(quaternion))
