"""The objects of a stage in the order of their prims, with `world_from_mesh`."""

from __future__ import annotations

from typing import Any

import numpy as np

from .handover import MAX_OBJECTS, Handover
from .instancers import Instances, interleave
from .meshes import Appearance

__all__ = ["Placement", "is_solid"]


class Placement:
    """Objects with the numbers of their prims; the objects are sorted by these numbers.

    Raises `MemoryError` beyond the maximum number of objects.
    """

    def __init__(self, turned_to: str | None, up: str) -> None:
        self._pieces: list[tuple[Any, Instances]] = []
        self._count = 0
        self._turn = np.eye(4)
        if turned_to is not None and turned_to != up:
            # A quarter turn about x, for row vectors.
            sine = 1.0 if turned_to == "z" else -1.0
            self._turn[1:3, 1:3] = [[0.0, sine], [-sine, 0.0]]

    def turn(self, world_from_local: Any) -> Any:
        """Matrices [..., 4, 4] for row vectors, turned to the requested up axis."""
        return np.asarray(world_from_local, float) @ self._turn

    def add(self, number: int, name: str, appearance: Appearance, matrix: Any) -> None:
        """Adds one object with its matrix [4, 4] for row vectors."""
        own = Instances([name], [appearance.mesh], [appearance.materials], np.asarray(matrix, float)[None])
        self.add_many(np.array([number]), own)

    def add_many(self, numbers: Any, objects: Instances) -> None:
        """Adds objects, each with the number of its prim."""
        self._count += len(numbers)
        if self._count > MAX_OBJECTS:
            raise MemoryError
        self._pieces.append((numbers, objects))

    def hand_over(self, handover: Handover) -> None:
        """Adds all objects to `handover`, in the order of the numbers of their prims."""
        found = interleave(self._pieces)
        handover.add_objects(found.names, found.meshes, found.materials, found.matrices.transpose(0, 2, 1))


def is_solid(matrices: Any) -> Any:
    """Mask [n] of the matrices [n, 4, 4] that certainly have an inverse."""
    lengths = np.linalg.norm(matrices[:, :3, :3], axis=2).prod(axis=1)
    return np.abs(np.linalg.det(matrices[:, :3, :3])) > 1e-12 * lengths
