"""Selection of objects by number or name."""

from __future__ import annotations

import raycam
from raycam.world.chosen import object_number
from support.raises import raises


def test_error_of_an_unknown_number_contains_the_count() -> None:
    world = raycam.World()
    world.add_object(box={"size": 1})
    with raises(
        raycam.WorldError, code="index_out_of_range", mentions=["the world has 1 object, numbered from 0"]
    ):
        object_number(world._core, 1)
    world.add_object(box={"size": 1})
    with raises(
        raycam.WorldError, code="index_out_of_range", mentions=["the world has 2 objects, numbered from 0"]
    ):
        object_number(world._core, 2)
