"""Mirrors and glass."""

from __future__ import annotations

import math

import numpy as np
import pytest
import raycam
from lidar.conftest import GREY, beams, quad

SILVER = {"type": "metal", "metal": "silver", "roughness": 0.0}


def room(reflected: bool) -> raycam.World:
    """Boxes in front of the plane x = 5.

    With `reflected`, they are mirrored to the other side of the plane.
    """
    world = raycam.World()
    rng = np.random.default_rng(2)
    for i in range(12):
        center = np.array([rng.uniform(-9, -3), rng.uniform(-6, 6), rng.uniform(-3, 3)])
        corners = center + rng.uniform(-3, 3, (3, 3)) * [0.5, 1, 1]
        if reflected:
            corners[:, 0] = 10 - corners[:, 0]
        world.add_mesh(corners, [[0, 1, 2]], name=f"part{i}", color=GREY)
    return world


def test_scan_into_a_mirror_has_the_points_of_the_mirrored_world() -> None:
    world = room(reflected=False)
    quad(world, [5, 0, 0], [0, -100, 0], [0, 0, 100], "mirror", **SILVER)
    rng = np.random.default_rng(7)
    ways = np.column_stack([np.ones(4000), rng.uniform(-0.7, 0.7, 4000), rng.uniform(-0.4, 0.4, 4000)])
    lidar = raycam.Lidar.of(ways, noise=False)
    seen, expected = raycam.scan(world, lidar), raycam.scan(room(reflected=True), lidar)
    np.testing.assert_array_equal(seen["pulse"], expected["pulse"])
    assert seen.count > 300
    np.testing.assert_allclose(seen["distance"], expected["distance"], atol=1e-9)
    np.testing.assert_allclose(seen["position"], expected["position"], atol=1e-9)
    np.testing.assert_array_equal(seen["instance"], expected["instance"])
    assert (seen["bounces"] == 1).all()
    assert (seen["first_instance"] == 12).all()
    # The energy of the mirrored world, times the mirror's reflectance on the way out and back.
    share = seen["reflectivity"] / expected["reflectivity"]
    assert 0.8 < share.min() <= share.max() < 1


def test_pane_at_normal_incidence_delays_the_echo_by_its_optical_thickness() -> None:
    world = raycam.World()
    world.add_object(
        box={"size": [0.2, 4, 4]}, name="pane", location=[5, 0, 0], type="glass", ior=1.5, roughness=0.0
    )
    quad(world, [10, 0, 0], [0, -50, 0], [0, 0, 50], "wall")
    scan = raycam.scan(world, beams(1, noise=False, pulse_length=0, returns="strongest"))
    assert scan["distance"][0] == pytest.approx(10 + 0.5 * 0.2, abs=1e-9)
    assert scan["bounces"][0] == 2
    # Each of the two faces transmits 0.96 of the light, on the way out and back.
    assert scan["reflectivity"][0] * 10**2 / 10.1**2 == pytest.approx(0.5 * 0.96**4, rel=1e-3)


def test_ghost_points_name_the_object_and_the_pane() -> None:
    """A pane at 45 degrees shows a box at the side as a ghost behind it."""
    world = raycam.World()
    side = np.array([1.0, 1.0, 0]) / math.sqrt(2)
    quad(world, [5, 0, 0], side * 2, [0, 0, 2], "pane", type="glass", thin=True, roughness=0.0)
    quad(world, [5, 7, 0], [2, 0, 0], [0, 0, 2], "box")
    quad(world, [30, 0, 0], [0, -50, 0], [0, 0, 50], "wall")
    scan = raycam.scan(world, beams(1, noise=False, returns="all"))
    np.testing.assert_allclose(scan["distance"], [12, 30], atol=1e-6)
    assert scan["instance"].tolist() == [1, 2]
    assert scan["first_instance"].tolist() == [0, 0]
    assert scan["bounces"].tolist() == [1, 1]
    np.testing.assert_allclose(scan["position"][0], [12, 0, 0], atol=1e-6)


def test_true_points_behind_an_upright_pane_are_on_the_transmitted_path() -> None:
    """The pane reflects the floor in front of it to the same points, with a hundredth of the energy."""
    world = raycam.World()
    floor = world.add_object(box={"size": [60, 60, 1]}, name="floor", location=[0, 0, -0.5], color=GREY)
    world.add_object(
        box={"size": [0.01, 4, 3]}, name="pane", location=[5, 0, 1.5], yaw=14, type="glass", thin=True
    )
    scan = raycam.scan(world, raycam.Lidar("os1-64", noise=False).placed([0, 0, 1.7]))
    behind = (scan["instance"] == floor) & (scan["bounces"] > 0)
    assert behind.sum() > 500
    apart = np.linalg.norm(scan.in_world() - scan["true_position"], axis=1)
    assert apart[behind].max() < 0.002  # the device rounds distances to a millimetre


@pytest.mark.parametrize("angle", [0.0, 45.0, 70.0])
def test_reflected_and_transmitted_energy_of_a_thin_pane_sum_to_one(angle: float) -> None:
    """White walls are on both sides of the pane.

    The square roots of the energies after two passes are the shares of one pass.
    """
    world = raycam.World()
    turn = math.radians(angle)
    way = np.array([math.cos(turn), math.sin(turn), 0])
    quad(
        world,
        [5, 5 * math.tan(turn), 0],
        [0, -1, 0],
        [0, 0, 1],
        "pane",
        type="glass",
        thin=True,
        roughness=0.0,
    )
    mirrored = way * [-1, 1, 1]
    start = 5 / math.cos(turn) * way
    for name, direction, distance in (("behind", way, 20), ("before", mirrored, 25)):
        center = start + distance * direction
        across = np.array([-direction[1], direction[0], 0])
        quad(world, center, across * 3, [0, 0, 3], name, color=[1.0, 1, 1])
    scan = raycam.scan(world, raycam.Lidar.of([way], noise=False, returns="all", pulse_length=0))
    assert sorted(scan["instance"].tolist()) == [1, 2]
    assert np.sqrt(scan["reflectivity"].astype(float)).sum() == pytest.approx(1, abs=1e-5)


def test_mirrors_return_no_points_without_bounces() -> None:
    world = room(reflected=False)
    quad(world, [5, 0, 0], [0, -100, 0], [0, 0, 100], "mirror", **SILVER)
    lidar = beams(10, noise=False, max_bounces=0)
    with pytest.warns(raycam.Notice) as caught:
        scan = raycam.scan(world, lidar, keep_lost=True)
    assert [notice.message.code for notice in caught] == ["empty_scan"]  # type: ignore[union-attr]
    assert (scan["lost"] == 5).all()
