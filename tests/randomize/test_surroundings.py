"""The fixed objects among which a recipe places other objects."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import raycam
from raycam import Recipe, WorldError
from raycam.randomize import recipe as recipes
from raycam.randomize.surroundings import Surroundings
from support.raises import raises

TABLE: dict[str, Any] = {"name": "table", "box": {"size": [2, 2, 0.1]}}
CUP = {"name": "cup", "cylinder": {"radius": 0.1, "height": 0.2}, "on": "table", "count": 3}


def box_world() -> raycam.World:
    world = raycam.World()
    world.add_object(name="low", box={"size": [2, 2, 2]})
    world.add_object(name="high", box={"size": [1, 1, 1]}, location=[5, 0, 3])
    return world


def test_ground_contains_the_level_triangles_of_the_named_object() -> None:
    around = Surroundings(box_world())
    ground = around.ground("high")
    assert ground.triangles[..., 2].tolist() == [[3.5] * 3] * 2
    assert ground.areas[-1] / 2 == pytest.approx(1)
    assert ground.owners.tolist() == [1]
    assert ground.hull.area == pytest.approx(1)
    assert around.ground(None).areas[-1] / 2 == pytest.approx(5)
    assert around.ground(None).relief == pytest.approx(2.5)
    with raises(WorldError, code="unknown_name", mentions=["hihg", "high"]):
        around.ground("hihg")


def test_near_returns_the_triangles_whose_boxes_intersect() -> None:
    around = Surroundings(box_world())
    assert len(around.near(np.array([4.0, -1, 2]), np.array([6.0, 1, 4]))) == 12
    assert len(around.near(np.array([1.1, -1, 0]), np.array([4.4, 1, 4]))) == 0


def count_surroundings(monkeypatch: pytest.MonkeyPatch, recipe: Recipe, worlds: int) -> int:
    made = 0

    def make(world: raycam.World) -> Surroundings:
        nonlocal made
        made += 1
        return Surroundings(world)

    monkeypatch.setattr(recipes, "Surroundings", make)
    for number in range(worlds):
        recipe.world(number)
    return made


def test_worlds_share_surroundings_if_only_colors_are_drawn(monkeypatch: pytest.MonkeyPatch) -> None:
    table = {**TABLE, "color": {"uniform": [[0, 0, 0], [1, 1, 1]]}}
    assert count_surroundings(monkeypatch, Recipe({"object": [table, CUP]}), 3) == 1


def test_placed_objects_follow_the_drawn_height_of_their_surface(monkeypatch: pytest.MonkeyPatch) -> None:
    table = {"name": "table", "box": {"size": {"uniform": [[2, 2, 0.1], [2, 2, 1]]}}}
    recipe = Recipe({"object": [table, CUP]})
    assert count_surroundings(monkeypatch, recipe, 3) == 3
    for number in range(3):
        world = recipe.world(number)
        corners = world.triangles()
        owners = world.triangle_ids()[:, 0]
        top = corners[owners == 0][..., 2].max()
        assert corners[owners == 1][..., 2].min() == pytest.approx(top, abs=1e-6)


def test_worlds_do_not_depend_on_previous_worlds() -> None:
    objects = {
        "object": [TABLE, CUP, {"name": "wall", "box": {"size": [1, 0.1, 1]}, "location": [0, 0, 0.55]}]
    }
    recipe = Recipe(objects)
    together = [recipe.world(number).to_bytes() for number in range(3)]
    assert together == [Recipe(objects).world(number).to_bytes() for number in range(3)]


def test_large_drawn_arrays_with_equal_texts_are_distinguished() -> None:
    """NumPy abbreviates arrays of more than 1,000 numbers, so the texts of these two are equal."""
    grid = np.stack(np.meshgrid(np.linspace(-0.1, 0.1, 20), np.linspace(-0.1, 0.1, 20)), -1).reshape(-1, 2)
    flat = np.column_stack([grid, np.zeros(400)])
    index = np.arange(400).reshape(20, 20)
    a, b, c = index[:-1, :-1].ravel(), index[:-1, 1:].ravel(), index[1:, :-1].ravel()
    deep = flat.copy()
    deep[200:210, 2] = -0.3
    thing = {"name": "thing", "triangles": np.column_stack([a, b, c]), "on": "table"}
    for vertices, low in ((flat, 0.0), (deep, -0.3)):
        assert vertices[:, 2].min() == low
    recipe = Recipe({"object": [TABLE, {**thing, "vertices": {"choice": [flat, deep]}}]})
    heights = {
        round(float(world.triangles()[world.triangle_ids()[:, 0] == 1][..., 2].min()), 6)
        for world in map(recipe.world, range(6))
    }
    assert heights == {0.05}
