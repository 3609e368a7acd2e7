"""Scans of several frames, one after another."""

from __future__ import annotations

import numpy as np
import raycam
from lidar.conftest import GREY, beams
from support.raises import raises


def moving_wall() -> raycam.World:
    world = raycam.World()
    world.add_object(box={"size": [1, 50, 50]}, name="wall", location=[20.5, 0, 0], color=GREY)
    places = [{"time": t, "object": "wall", "location": [20.5 + t, 0, 0]} for t in (0, 1, 2)]
    world.set_video(seconds=2, keyframe=places)
    return world


def test_each_frame_starts_when_the_previous_frame_ends() -> None:
    world, lidar = moving_wall(), beams(3, noise=False, rate=4)
    scans = list(raycam.scan_many(world.at(0.5), lidar, 4))
    for number, scan in enumerate(scans):
        expected = raycam.scan(world.at(0.5 + number / 4), lidar, frame=number)
        np.testing.assert_array_equal(scan["distance"], expected["distance"])
    assert all(np.diff([scan["distance"][0] for scan in scans]) > 0.1)
    chosen = list(raycam.scan_many(world.at(0.5), lidar, [3, 1]))
    np.testing.assert_array_equal(chosen[0]["distance"], scans[3]["distance"])


def test_lidar_of_a_world_is_scanned_by_its_name() -> None:
    world = moving_wall()
    world.add_sensor(beams(3, noise=False, rate=4), "top")
    found = [scan["distance"][0] for scan in raycam.scan_many(world.at(0), "top", 3)]
    expected = [raycam.scan(world.at(t), beams(1, noise=False))["distance"][0] for t in (0, 0.25, 0.5)]
    np.testing.assert_allclose(found, expected, atol=1e-5)


def test_frames_of_a_static_world_differ_by_their_noise_only() -> None:
    world, lidar = moving_wall().at(0), beams(50, range_noise=0.1, rate=1e6)
    one, two = raycam.scan_many(world, lidar, 2)
    assert (one["distance"] != two["distance"]).any()
    assert list(raycam.scan_many(world, lidar, 0)) == []
    with raises(raycam.SettingsError, code="out_of_range"):
        list(raycam.scan_many(world, lidar, [-1]))
