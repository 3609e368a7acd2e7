"""Triangles tested in blocks.

The results do not depend on the block size and equal those of the renderer.
"""

from __future__ import annotations

import numpy as np
import pytest
import raycam
from raycam.explanation import all_triangles, explain, tree


@pytest.fixture(scope="module")
def world() -> raycam.World:
    made = raycam.World()
    made.add_object(sphere={"radius": 1, "level": 5}, name="ball")
    made.add_object(torus={"radius": 1.6, "tube": 0.2}, name="ring")
    return made


@pytest.fixture(scope="module")
def camera() -> raycam.Camera:
    return raycam.Camera.look_at([3, -4, 2.5], [0, 0, 0], size=(60, 40), fov=45)


PIXELS = [(30, 20), (12, 20), (30, 33), (0, 0), (44, 12)]


@pytest.mark.parametrize("block", [97, 1 << 10, 1 << 20])
def test_explanation_does_not_depend_on_the_block_size(
    world: raycam.World, camera: raycam.Camera, block: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    expected = [(str(each), str(each.tree())) for each in (explain(world, camera, at) for at in PIXELS)]
    monkeypatch.setattr(all_triangles, "BLOCK", block)
    monkeypatch.setattr(tree, "BLOCK", block)
    found = [(str(each), str(each.tree())) for each in (explain(world, camera, at) for at in PIXELS)]
    assert found == expected


def test_closest_triangle_equals_that_of_the_renderer(
    world: raycam.World, camera: raycam.Camera, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(all_triangles, "BLOCK", 1000)
    seen = raycam.render(world, camera, integrator="flat", channels=["instance", "triangle", "depth"])
    for column, row in PIXELS:
        found = explain(world, camera, (column, row))
        winner = (-1, -1) if found.winner is None else (found.winner.instance, found.winner.triangle)
        assert winner == (seen["instance"][row, column], seen["triangle"][row, column])
        np.testing.assert_allclose(found.depth, seen["depth"][row, column], rtol=1e-6)
        counted = found.without_area + found.parallel + found.behind + found.outside + found.inside
        assert counted == found.triangles == len(world.triangles())


def test_listed_misses_are_the_triangles_nearest_to_the_ray(
    world: raycam.World, camera: raycam.Camera, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(all_triangles, "BLOCK", 500)
    found = explain(world, camera, (0, 0))
    corners = world.triangles()
    origin, direction = camera.rays(np.full(2, 0.5) + camera.corner)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    t = ((corners[:, 0] - origin) * normals).sum(axis=1) / (normals @ direction)
    middles = corners.mean(axis=1)
    reach = np.linalg.norm(corners - middles[:, None], axis=2).max(axis=1)
    away = np.linalg.norm(origin + t[:, None] * direction - middles, axis=1) / reach
    nearest = np.argsort(np.where(t >= 0, away, np.inf), kind="stable")[:2]
    ids = {tuple(pair) for pair in world.triangle_ids()[nearest].tolist()}
    assert {(each.instance, each.triangle) for each in found.candidates} == ids
