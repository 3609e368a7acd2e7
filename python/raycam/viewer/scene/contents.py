"""Contents of a world, read without a record for each object.

Worlds may have many thousands of objects.
"""

from __future__ import annotations

import numpy as np

from ...arguments import Floats
from ...world import World

__all__ = ["matrix_of_object", "names_of_objects", "visibilities"]

NAME, MATRIX, VISIBLE = 0, 4, 5  # indices into an object's tuple in the core's description


def names_of_objects(world: World) -> list[str]:
    """The names of all objects, in the order of their ids."""
    return [str(each[NAME]) for each in world._core.objects]


def visibilities(world: World) -> list[bool]:
    """True for each object that is shown, in the order of their ids."""
    return [bool(each[VISIBLE]) for each in world._core.objects]


def matrix_of_object(world: World, number: int) -> Floats:
    """The matrix [4, 4] world_from_mesh of the object with this id."""
    return np.array(world._core.objects[number][MATRIX], dtype=np.float64)
