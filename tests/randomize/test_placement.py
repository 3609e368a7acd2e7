"""Placement of objects on surfaces.

Objects that cannot fit are refused before positions are tried.
"""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
import pytest
import raycam
import trimesh
from raycam import Recipe, WorldError
from raycam.randomize import placement
from raycam.randomize.convex_prism import ConvexPrism, outline
from raycam.randomize.draws import RandomStream
from raycam.randomize.surroundings import Surroundings
from support.raises import raises

GROUND = {"name": "ground", "box": {"size": [2, 2, 0.1]}}


def build_recipe(size: Any, count: int, gap: float) -> Recipe:
    thing = {"name": "thing", "box": {"size": size}, "on": "ground", "count": count, "gap": gap}
    return Recipe({"object": [GROUND, thing]})


@pytest.mark.parametrize(
    ("size", "count", "gap"),
    [
        ([30, 30, 30], 1, 0.001),  # the object is far too large
        ([2.9, 0.01, 0.1], 1, 0.001),  # the object is longer than the ground's diagonal
        ([2.01, 2.01, 0.1], 1, 0.001),  # the object is wider than the ground at any rotation
        ([1.5, 1.5, 0.1], 2, 0.001),  # the areas of two objects together exceed the ground's area
        ([0.5, 0.5, 0.1], 2, 3.0),  # the gap is larger than the ground
    ],
)
def test_objects_that_cannot_fit_are_refused_without_tries(
    size: Any, count: int, gap: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    tries = 0
    sample = placement.PlacementSampler._try

    def count_tries(*arguments: Any) -> Any:
        nonlocal tries
        tries += 1
        return sample(*arguments)

    monkeypatch.setattr(placement.PlacementSampler, "_try", count_tries)
    with pytest.raises(WorldError) as fault:
        build_recipe(size, count, gap).world(0)
    assert "ground" in str(fault.value)
    # Only the first of several objects is tried; it finds a position quickly in each of the ten draws.
    assert tries < (1 if count == 1 else 10 * 1000)


@pytest.mark.parametrize(
    ("size", "count"), [([1.99, 1.99, 0.1], 1), ([2.7, 0.01, 0.1], 1), ([0.9, 0.9, 0.1], 2)]
)
def test_objects_that_barely_fit_are_not_too_large(size: Any, count: int) -> None:
    sampler = placement.PlacementSampler(Surroundings(Recipe({"object": [GROUND]}).world(0)))
    corners = np.array([[x, y, z] for x in (0, size[0]) for y in (0, size[1]) for z in (0, size[2])], float)
    shape = ConvexPrism(outline(corners[:, :2]), 0.0, size[2])
    for _ in range(count):
        assert not sampler._is_too_large(shape, "ground", 0.001)
        sampler._reserve(shape, "ground")


def test_first_tries_together_equal_the_first_tries_of_each_object() -> None:
    """The results do not depend on which objects are checked together."""
    recipe = Recipe({"object": [GROUND, {"name": "wall", "box": {"size": [0.2, 2, 1]}}]})
    around = Surroundings(recipe.world(0))
    corners = np.array([[x, y] for x in (0.0, 0.3) for y in (0.0, 0.2)])
    shape, large = ConvexPrism(outline(corners), 0.0, 0.1), ConvexPrism(outline(100 * corners), 0.0, 0.1)
    requests = [(shape, "ground", RandomStream(7, "object", number)) for number in range(40)]
    together = placement.PlacementSampler(around).sample_first_tries(
        [*requests, (large, "ground", RandomStream(7))]
    )
    assert together[-1] is None
    for request, found in zip(requests, together[:-1], strict=True):
        (alone,) = placement.PlacementSampler(around).sample_first_tries([request])
        assert found is not None
        assert alone is not None
        assert (found.pose == alone.pose).all()
        assert found.supported == alone.supported
    assert {found.supported for found in together[:-1] if found is not None} == {False, True}
    poses = [placement.PlacementSampler(around).sample_pose(*request, 0.001, "x") for request in requests[:9]]
    known = [
        placement.PlacementSampler(around).sample_pose(*request, 0.001, "x", first)
        for request, first in zip(requests[:9], together[:9], strict=True)
    ]
    np.testing.assert_array_equal(poses, known)


def test_batches_of_tries_contain_each_try_once() -> None:
    numbers = [number for first, last in placement._batches() for number in range(first, last)]
    assert numbers == list(range(placement.MAX_TRIES))


@pytest.mark.parametrize("extra", [{}, {"upright": True}, {"category": "cow", "count": 2}])
def test_placed_file_stands_upright_on_its_surface(extra: dict[str, Any]) -> None:
    """The file's up axis is y: its height is the extent along y, whatever the world's axis."""
    path = raycam.data.path("spot.glb")
    height = trimesh.load(path, force="mesh").extents[1]
    cow = {"name": "cow", "mesh": path.name, "on": "ground", **extra}
    ground = {"name": "ground", "box": {"size": [12, 12, 0.1]}}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", raycam.Notice)
        world = Recipe({"object": [ground, cow]}, folder=path.parent).world(0)
    owners = world.triangle_ids()[:, 0]
    for number in range(1, len(world.objects)):
        corners = world.triangles()[owners == number].reshape(-1, 3)
        assert corners[:, 2].min() == pytest.approx(0.05, abs=1e-6)
        assert np.ptp(corners[:, 2]) == pytest.approx(height, abs=1e-6)


def test_placed_file_with_upright_false_keeps_its_axes() -> None:
    path = raycam.data.path("spot.glb")
    depth = trimesh.load(path, force="mesh").extents[2]
    cow = {"name": "cow", "mesh": path.name, "on": "ground", "upright": False}
    world = Recipe(
        {"object": [{"name": "ground", "box": {"size": [12, 12, 0.1]}}, cow]}, folder=path.parent
    ).world(0)
    corners = world.triangles()[world.triangle_ids()[:, 0] == 1].reshape(-1, 3)
    assert corners[:, 2].min() == pytest.approx(0.05, abs=1e-6)
    assert np.ptp(corners[:, 2]) == pytest.approx(depth, abs=1e-6)


def test_more_objects_than_the_surface_holds_are_refused_before_any_is_placed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def place(*_: Any) -> Any:
        raise AssertionError("an object is placed although their areas exceed the ground's")

    monkeypatch.setattr(placement.PlacementSampler, "sample_pose", place)
    with raises(WorldError, mentions=["thing-1", 65, 4.06]):
        build_recipe([0.25, 0.25, 0.1], 65, 0.001).world(0)
    with pytest.raises(AssertionError):
        # The objects together have the area of the ground.
        build_recipe([0.25, 0.25, 0.1], 64, 0.001).world(0)


def test_areas_of_separate_levels_are_not_added_up() -> None:
    """Each of two levels holds one object.

    Two objects on one level would need more than the area of that level.
    """
    stairs = {"name": "ground", "vertices": [], "triangles": []}
    for level in (0.0, 0.5):
        first = len(stairs["vertices"])
        x = 4 * level
        stairs["vertices"] += [[x, 0, level], [x + 1.5, 0, level], [x + 1.5, 1.5, level], [x, 1.5, level]]
        stairs["triangles"] += [[first, first + 1, first + 2], [first, first + 2, first + 3]]
    thing = {"name": "thing", "cylinder": {"radius": 0.55, "height": 0.3}, "on": "ground", "count": 2}
    world = Recipe({"object": [stairs, thing], "seed": 3}).world(0)
    assert len({round(float(item.matrix[2, 3]), 3) for item in world.objects[1:]}) == 2
