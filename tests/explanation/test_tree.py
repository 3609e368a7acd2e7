"""The search in a tree of boxes, compared with a test of all triangles."""

from __future__ import annotations

import numpy as np
import pytest
import raycam
from raycam.explanation.tree import LEAF, entered


def soup(count: int, seed: int) -> raycam.World:
    random = np.random.default_rng(seed)
    middles = random.uniform(-1, 1, (count, 1, 3))
    corners = middles + random.normal(0, 0.08, (count, 3, 3))
    world = raycam.World()
    world.add_mesh(corners.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3))
    return world


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_tree_search_finds_the_closest_triangle_with_fewer_tests(seed: int) -> None:
    world = soup(800, seed)
    camera = raycam.Camera.look_at([4, 1, 2], [0, 0, 0], size=(40, 40), fov=30)
    tested = []
    for pixel in [(int(5 + 6 * i), int(7 + 5 * i)) for i in range(5)]:
        explanation = raycam.explain(world, camera, pixel)
        search = explanation.tree()
        if explanation.winner is None:
            assert search.winner == -1
            assert search.t == np.inf
        else:
            assert search.winner == explanation.winner.triangle
            assert search.t == explanation.winner.t
        leaves = [box for box in search.boxes if box.is_leaf]
        assert search.tested_triangles == sum(box.triangles for box in leaves) <= LEAF * len(leaves)
        assert all(box.enters <= box.leaves for box in search.boxes)
        tested.append(search.tested_triangles)
    assert max(tested) < 800 / 4


def test_box_intervals_contain_the_ray_points_inside() -> None:
    random = np.random.default_rng(5)
    for _ in range(300):
        low = random.uniform(-1, 1, 3)
        high = low + random.uniform(0.1, 2, 3)
        start, way = random.uniform(-3, 3, 3), random.normal(size=3)
        way[random.random(3) < 0.2] = 0
        t = np.linspace(0, 12, 4001)[:, None]
        inside = ((start + t * way >= low) & (start + t * way <= high)).all(axis=1)
        enter, leave = entered(low, high, start, way)
        if inside.any():
            assert enter <= t[inside].min() + 1e-12
            assert leave >= t[inside].max() - 1e-12
        elif enter <= leave:
            assert leave - enter < 12 / 4000 or enter > 12


def test_ray_outside_the_root_box_tests_no_triangle() -> None:
    world = soup(50, 4)
    away = raycam.Camera.look_at([4, 1, 2], [9, 1, 2], size=(9, 9), fov=30)
    search = raycam.explain(world, away, (4, 4)).tree()
    assert (search.boxes, search.tested_boxes, search.tested_triangles) == ((), 1, 0)
    empty = raycam.explain(raycam.World(), away, (4, 4)).tree()
    assert (empty.triangles, empty.tested_boxes) == (0, 0)
