"""Objects that fall and rest according to the laws of statics: towers, bowls and edges."""

from __future__ import annotations

import numpy as np
import pytest
import raycam

FLOOR = -0.8
"""Height of the floor next to the table, in metres."""


def test_tower_of_boxes_stays_standing() -> None:
    world = raycam.World()
    world.add_object(name="table", box={"size": [1, 1, 0.1]}, location=[0, 0, -0.05])
    heights = [0.02 + 0.0402 * i for i in range(6)]
    for i, height in enumerate(heights):
        world.add_object(
            name=f"box-{i}", box={"size": [0.08, 0.06, 0.04]}, location=[0, 0, height], yaw=30 * (i % 2)
        )
    report = raycam.settle(world, [f"box-{i}" for i in range(6)])
    assert report.attempts == 1
    assert report.motion <= 1e-4
    assert report.penetration <= 2e-4
    for i, item in enumerate(world.objects[1:]):
        assert np.linalg.norm(item.matrix[:2, 3]) < 6e-3  # a tenth of the width
        # Each contact leaves a gap of at most 0.2 mm.
        assert -2e-4 <= item.matrix[2, 3] - (0.02 + 0.04 * i) <= 2e-4 * (i + 1)
        np.testing.assert_allclose(item.matrix[:3, 2], [0, 0, 1], atol=1e-3)


@pytest.mark.parametrize(("start", "slope"), [((0.1, 0.0), 30), ((0.06, -0.09), 30), ((0.05, 0.02), 20)])
def test_ball_in_a_pyramid_rests_at_the_lowest_point(start: tuple[float, float], slope: float) -> None:
    side, ball, angle = 0.2, 0.03, np.radians(slope)
    corners = side * np.array([[0, 0, 0], [1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0]])
    corners[1:, 2] = side * np.tan(angle)
    world = raycam.World()
    world.add_object(name="bowl", vertices=corners, triangles=[[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 1]])
    world.add_object(name="ball", sphere={"radius": ball}, location=[*start, 0.16])
    report = raycam.settle(world, "ball")
    place = world.objects[1].matrix[:3, 3]
    # A ball that touches four planes through the apex has its centre at this height above it.
    np.testing.assert_allclose(place, [0, 0, ball / np.cos(angle)], atol=5e-4)
    assert report.penetration <= 2e-4


def table_with_edge() -> raycam.World:
    """A table whose top is at height 0 and ends at x = 0, and a floor."""
    world = raycam.World()
    world.add_object(name="floor", box={"size": [6, 6, 0.1]}, location=[0, 0, FLOOR - 0.05])
    world.add_object(name="table", box={"size": [1, 1, 0.1]}, location=[-0.5, 0, -0.05])
    return world


@pytest.mark.parametrize(("centre", "stays"), [(-0.03, True), (-0.01, True), (0.01, False), (0.03, False)])
def test_box_on_an_edge_falls_if_its_centre_is_beyond_the_edge(centre: float, stays: bool) -> None:
    world = table_with_edge()
    world.add_object(name="box", box={"size": [0.2, 0.1, 0.04]}, location=[centre, 0, 0.021])
    raycam.settle(world, "box")
    place = world.objects[2].matrix[:3, 3]
    if stays:
        np.testing.assert_allclose(place, [centre, 0, 0.02], atol=1e-3)
    else:
        half_sizes = np.array([0.1, 0.05, 0.02])
        assert abs(place[2] - FLOOR - half_sizes).min() < 1e-3


@pytest.mark.parametrize(("lean", "height"), [(12, 0.15), (25, 0.05)])
def test_tall_box_falls_if_it_leans_beyond_its_edge(lean: float, height: float) -> None:
    # The centre is above the edge if the box leans by atan(0.1 / 0.3) = 18.4 degrees.
    world = raycam.World()
    world.add_object(name="table", box={"size": [2, 2, 0.1]}, location=[0, 0, -0.05])
    angle = np.radians(lean)
    centre = 0.05 * np.sin(angle) + 0.15 * np.cos(angle)
    world.add_object(name="box", box={"size": [0.1, 0.1, 0.3]}, pitch=lean, location=[0, 0, centre + 1e-3])
    raycam.settle(world, "box", physics={"box": {"restitution": 0.0}})
    np.testing.assert_allclose(world.objects[1].matrix[2, 3], height, atol=1e-3)


def test_ball_dropped_on_an_edge_falls_to_the_floor() -> None:
    world = table_with_edge()
    world.add_object(name="stop", box={"size": [0.1, 6, 1]}, location=[2, 0, FLOOR + 0.5])
    world.add_object(name="ball", sphere={"radius": 0.05}, location=[0.01, 0, 0.3])
    raycam.settle(world, "ball", seconds=20)
    place = world.objects[3].matrix[:3, 3]
    assert place[0] > 0.05
    np.testing.assert_allclose(place[2], FLOOR + 0.05, atol=1e-3)
