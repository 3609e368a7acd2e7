"""Notices of scans: each is warned once, with its code."""

from __future__ import annotations

import numpy as np
import pytest
import raycam
from lidar.conftest import GREY, beams, wall
from raycam.notices import collected


def codes(world: raycam.World, lidar: raycam.Lidar) -> list[str]:
    with collected() as notices:
        raycam.scan(world, lidar)
    return [notice.code for notice in notices]


def test_ordinary_scan_has_no_notices(yard: raycam.World) -> None:
    assert codes(yard, raycam.Lidar("vlp16").placed([0, 0, 1])) == []


@pytest.mark.parametrize("name", ["hdl64e", "pandar64", "livox-hap"])
def test_device_without_a_calibration_file_gives_a_notice(name: str, yard: raycam.World) -> None:
    with collected() as notices:
        raycam.scan(yard, raycam.Lidar(name).placed([0, 0, 1]))
    assert [notice.code for notice in notices] == ["generic_angles"]
    assert name in str(notices[0])
    assert "load_lidar" in str(notices[0])


def test_empty_scan_gives_a_notice_with_the_counts_of_causes() -> None:
    with collected() as notices:
        scan = raycam.scan(wall(300.0), beams(7, max_range=100))
    assert scan.count == 0
    assert [notice.code for notice in notices] == ["empty_scan"]
    assert "too far: 7" in str(notices[0])


def moving_world() -> raycam.World:
    world = raycam.World()
    world.add_object(box={"size": [1, 50, 50]}, name="wall", location=[20, 0, 0], color=GREY)
    world.set_video(
        seconds=1, keyframe=[{"time": t, "object": "wall", "location": [20 + t, 0, 0]} for t in (0, 1)]
    )
    return world


def test_moving_world_without_a_time_gives_one_notice_and_is_static() -> None:
    world = moving_world()
    lidar = beams(5, noise=False)
    assert codes(world, lidar) == ["unused_times"]
    with pytest.warns(raycam.Notice):
        scan = raycam.scan(world, lidar)
    assert np.ptp(scan["distance"]) == 0


def test_frame_that_ends_after_the_video_gives_a_notice() -> None:
    assert codes(moving_world().at(0.95), beams(5, rate=10)) == ["outside_times"]
    assert codes(moving_world().at(0.9), beams(5, rate=10)) == []


def test_moving_lidar_in_a_static_world_gives_no_notice(yard: raycam.World) -> None:
    lidar = raycam.Lidar("vlp16").placed([0, 0, 1])
    assert codes(yard, lidar.moving(lidar.placed([1, 0, 1]))) == []


def test_colored_material_gives_one_notice_and_its_red_channel_is_used() -> None:
    world = wall(20.0, color=[0.7, 0.2, 0.1])
    assert codes(world, beams(5)) == ["assumed_reflectance"]
    with pytest.warns(raycam.Notice):
        scan = raycam.scan(world, beams(5))
    np.testing.assert_allclose(scan["reflectivity"], 0.7, rtol=1e-5)


def test_scan_refuses_objects_that_are_not_lidars(yard: raycam.World) -> None:
    with pytest.raises(raycam.LidarError) as caught:
        raycam.scan(yard, 3)  # type: ignore[arg-type]
    assert caught.value.code == "wrong_type"
