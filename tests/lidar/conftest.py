"""Worlds that lidars scan in the tests."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest
import raycam

GREY = [0.5, 0.5, 0.5]


def quad(
    world: raycam.World, center: npt.ArrayLike, u: npt.ArrayLike, v: npt.ArrayLike, name: str, **keys: object
) -> None:
    """Adds a rectangle with half edges `u` and `v`."""
    c, a, b = (np.asarray(x, float) for x in (center, u, v))
    corners = np.stack([c - a - b, c + a - b, c + a + b, c - a + b])
    if "type" not in keys:
        keys.setdefault("color", GREY)
    world.add_mesh(corners, [[0, 1, 2], [0, 2, 3]], name=name, **keys)  # type: ignore[arg-type]


def wall(distance: float, size: float = 500.0, **keys: object) -> raycam.World:
    """A world with the plane x = distance, facing the origin."""
    world = raycam.World()
    quad(world, [distance, 0, 0], [0, -size, 0], [0, 0, size], "wall", **keys)
    return world


def beams(count: int, **settings: object) -> raycam.Lidar:
    """A lidar with `count` pulses along x, one per microsecond."""
    ways = np.tile([1.0, 0.0, 0.0], (count, 1))
    return raycam.Lidar.of(ways, times=np.arange(count) * 1e-6, **settings)


@pytest.fixture(scope="session")
def yard() -> raycam.World:
    """A floor, a box and a wall, without motion."""
    world = raycam.World()
    quad(world, [0, 0, 0], [60, 0, 0], [0, 60, 0], "floor", category="ground")
    quad(world, [15, 0, 5], [0, -20, 0], [0, 0, 5], "wall", category="building")
    box = {"size": [2, 2, 2]}
    world.add_object(box=box, name="box", location=[6, 3, 1], yaw=30, color=GREY, category="thing")
    return world
