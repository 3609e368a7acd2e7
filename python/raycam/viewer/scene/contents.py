"""Contents of a world, read without a record for each object.

Worlds may have many thousands of objects.
"""

from __future__ import annotations

import json
from typing import Any

import numpy as np

from ...arguments import Floats
from ...errors import WorldError
from ...one_line import counted
from ...world import World

__all__ = ["check_object", "materials_of_object", "matrix_of_object", "names_of_objects", "visibilities"]

NAME, MATRIX, VISIBLE = 0, 4, 5  # indices into an object's tuple in the core's description


def names_of_objects(world: World) -> list[str]:
    """The names of all objects, in the order of their ids."""
    return [str(each[NAME]) for each in world._core.objects]


def visibilities(world: World) -> list[bool]:
    """True for each object that is shown, in the order of their ids."""
    return [bool(each[VISIBLE]) for each in world._core.objects]


def check_object(world: World, number: int) -> None:
    """Raises `WorldError` if the world has no object with this id."""
    count = world._core.object_count
    if number >= count:
        raise WorldError(
            f"object {number} does not exist; the world has {counted(count, 'object')}, numbered from 0",
            code="index_out_of_range",
        )


def materials_of_object(world: World, number: int) -> list[dict[str, Any]]:
    """The material in each slot of the object with this id; empty for an unknown object."""
    found: list[dict[str, Any]] = json.loads(world._core.materials(number))
    return found


def matrix_of_object(world: World, number: int) -> Floats:
    """The matrix [4, 4] world_from_mesh of the object with this id."""
    return np.array(world._core.objects[number][MATRIX], dtype=np.float64)
