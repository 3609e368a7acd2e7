"""Radial velocities, compared with closed forms and with differences of distances."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
import pytest
import raycam
from lidar.conftest import GREY, beams, quad

Floats = npt.NDArray[np.float64]


def moving_wall(velocity: npt.ArrayLike, rotation: float = 0.0) -> raycam.World:
    """A wall that starts at x = 20, moves, and turns about z, for one second.

    `rotation` is in degrees per second.
    """
    world = raycam.World()
    world.add_object(box={"size": [1, 60, 60]}, name="wall", location=[20.5, 0, 0], color=GREY)
    places = [(t, (np.array([20.5, 0, 0]) + t * np.asarray(velocity)).tolist()) for t in (0.0, 1.0)]
    keys = [
        {"time": t, "object": "wall", "location": place, "yaw": rotation * t, "pitch": 0.0}
        for t, place in places
    ]
    world.set_video(seconds=1, interpolation="linear", keyframe=keys)
    return world


def turned(angle: float, vectors: Floats) -> Floats:
    """Vectors turned about z by `angle` in radians."""
    c, s = math.cos(angle), math.sin(angle)
    return vectors @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]).T


def test_velocity_of_a_wall_is_its_component_along_the_beam() -> None:
    """Doppler: v cos(angle between the motion and the beam), positive away from the lidar."""
    velocity = np.array([-3.0, 7.0, 1.5])
    ways = np.array([[1, 0, 0], [1, 0.4, 0.1], [1, -0.7, 0.3]])
    times = np.array([0.0, 0.25, 0.5])
    lidar = raycam.Lidar.of(ways, times=times, rate=1, noise=False)
    scan = raycam.scan(moving_wall(velocity).at(0.0), lidar)
    expected = ways @ velocity / np.linalg.norm(ways, axis=1)
    np.testing.assert_allclose(scan["radial_velocity"], expected, rtol=1e-6)
    assert scan["radial_velocity"].dtype == np.float32


def test_velocity_includes_rotations_of_the_wall_and_of_the_lidar() -> None:
    """The expected velocity is a central difference of the distance.

    The distance is between a point that moves with the wall and the start of the beam.
    """
    velocity, rotation, time = np.array([1.0, -2.0, 0.5]), math.radians(40.0), 0.3
    start = raycam.Lidar.of([[1, 0.1, 0.05]], times=[time], origins=[[0.3, 0.2, 0.1]], rate=1, noise=False)
    lidar = start.placed([1, 2, 0]).moving(start.placed([4, 1, 0.5], yaw=20))
    scan = raycam.scan(moving_wall(velocity, 40.0).at(0.0), lidar)
    point = scan["true_position"][0]
    middle = np.array([20.5, 0, 0])
    on_wall = turned(-rotation * time, point - middle - velocity * time)

    def distance(t: float) -> float:
        carried = middle + velocity * t + turned(rotation * t, on_wall)
        place = np.array([1, 2, 0]) + t * np.array([3, -1, 0.5])
        return float(
            np.linalg.norm(carried - place - turned(math.radians(20) * t, np.array([0.3, 0.2, 0.1])))
        )

    assert distance(time) == pytest.approx(scan["distance"][0], abs=1e-9)
    expected = (distance(time + 1e-4) - distance(time - 1e-4)) / 2e-4
    assert scan["radial_velocity"][0] == pytest.approx(expected, abs=1e-5)
    assert abs(expected) > 1.0


def test_mirror_that_moves_changes_the_distance_of_its_image_twice_as_fast() -> None:
    """The mirror recedes at 2 m/s; the image of the static wall behind the lidar at 4 m/s."""
    world = raycam.World()
    silver = {"type": "metal", "metal": "silver", "roughness": 0.0}
    world.add_object(box={"size": [1, 9, 9]}, name="mirror", location=[5.5, 0, 0], **silver)
    quad(world, [-10, 0, 0], [0, 5, 0], [0, 0, 5], "wall")
    keys = [{"time": t, "object": "mirror", "location": [5.5 + 2 * t, 0, 0]} for t in (0.0, 1.0)]
    world.set_video(seconds=1, interpolation="linear", keyframe=keys)
    scan = raycam.scan(world.at(0.0), raycam.Lidar.of([[1, 0, 0]], times=[0.4], rate=1, noise=False))
    assert scan["bounces"].tolist() == [1]
    assert scan["distance"][0] == pytest.approx(20 + 4 * 0.4)
    assert scan["radial_velocity"][0] == pytest.approx(4.0, rel=1e-6)


def test_pane_that_moves_along_the_beam_does_not_change_the_optical_distance() -> None:
    world = raycam.World()
    glass = {"type": "glass", "ior": 1.5, "roughness": 0.0}
    world.add_object(box={"size": [0.5, 9, 9]}, name="pane", location=[5, 0, 0], **glass)
    quad(world, [20, 0, 0], [0, -9, 0], [0, 0, 9], "wall")
    keys = [{"time": t, "object": "pane", "location": [5 + 2 * t, 0, 0]} for t in (0.0, 1.0)]
    world.set_video(seconds=1, interpolation="linear", keyframe=keys)
    scan = raycam.scan(world.at(0.0), raycam.Lidar.of([[1, 0, 0]], times=[0.4], rate=1, noise=False))
    assert scan["bounces"].tolist() == [2]
    assert scan["radial_velocity"][0] == pytest.approx(0.0, abs=1e-6)


def test_fog_approaches_a_moving_lidar_at_its_speed() -> None:
    lidar = beams(1, noise=False, visibility=30, rate=10)
    moving = lidar.placed([0, 0, 0]).moving(lidar.placed([0.5, 0, 0]))
    scan = raycam.scan(raycam.World(), moving)
    assert scan["instance"].tolist() == [-1]
    assert scan["radial_velocity"][0] == pytest.approx(-5.0)


def test_static_worlds_have_velocity_zero_and_lost_pulses_nan(yard: raycam.World) -> None:
    scan = raycam.scan(yard, raycam.Lidar("vlp16").placed([0, 0, 1.8]), keep_lost=True)
    kept = scan["lost"] == 0
    assert (scan["radial_velocity"][kept] == 0).all()
    assert np.isnan(scan["radial_velocity"][~kept]).all()
    assert kept.any()
    assert not kept.all()
