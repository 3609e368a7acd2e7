"""Placement of objects on surfaces: objects that cannot fit are refused before positions are tried."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from raycam import Recipe, WorldError
from raycam.randomize import placement

GROUND = {"name": "ground", "box": {"size": [2, 2, 0.1]}}


def build_recipe(size: Any, count: int, gap: float) -> Recipe:
    thing = {"name": "thing", "box": {"size": size}, "on": "ground", "count": count, "gap": gap}
    return Recipe({"object": [GROUND, thing]})


@pytest.mark.parametrize(
    ("size", "count", "gap"),
    [
        ([30, 30, 30], 1, 0.001),  # far too large
        ([2.9, 0.01, 0.1], 1, 0.001),  # longer than the diagonal
        ([2.01, 2.01, 0.1], 1, 0.001),  # wider than the ground at any rotation
        ([1.5, 1.5, 0.1], 2, 0.001),  # the first fits, the second does not: areas
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
    assert "on ground" in str(fault.value)
    # Only the first of several objects is tried; it finds a position quickly in each of the ten draws.
    assert tries < (1 if count == 1 else 10 * 1000)


@pytest.mark.parametrize(
    ("size", "count"), [([1.99, 1.99, 0.1], 1), ([2.7, 0.01, 0.1], 1), ([0.9, 0.9, 0.1], 2)]
)
def test_objects_that_barely_fit_are_not_too_large(size: Any, count: int) -> None:
    sampler = placement.PlacementSampler(Recipe({"object": [GROUND]}).world(0))
    corners = np.array([[x, y, z] for x in (0, size[0]) for y in (0, size[1]) for z in (0, size[2])], float)
    shape = placement.ConvexPrism(placement.outline(corners[:, :2]), 0.0, size[2])
    ground, _, _ = sampler._ground("ground")
    for _ in range(count):
        assert not sampler._is_too_large(shape, "ground", ground, 0.001)
        sampler._taken.append(shape)
        sampler._surface_of.append("ground")


def test_measures_of_outlines_equal_closed_forms() -> None:
    angle = np.arange(64) * 2 * np.pi / 64
    circle = placement.outline(np.column_stack([3 * np.cos(angle), 3 * np.sin(angle)]))
    assert placement._diameter(circle) == pytest.approx(6)
    assert placement._width(circle) == pytest.approx(6 * np.cos(np.pi / 64))
    assert placement._area(circle) == pytest.approx(32 * 9 * np.sin(2 * np.pi / 64))
    box = np.array([[0, 0], [3, 0], [3, 1], [0, 1.0]]) + 100
    assert (placement._diameter(box), placement._width(box), placement._area(box)) == pytest.approx(
        (np.sqrt(10), 1, 3)
    )


def test_batches_cover_every_try_once() -> None:
    numbers = [number for first, last in placement._batches() for number in range(first, last)]
    assert numbers == list(range(placement.MAX_TRIES))
