"""Lidars on rigs: in samples, videos and data sets."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import raycam
from dataset.test_semantickitti import street, vehicle
from raycam.dataset import write
from raycam.sensors import describe_sensor, read_sensor, sample_sensor
from raycam.video import VideoPlan


def test_rig_places_its_lidar() -> None:
    """world_from_sensor = world_from_body · body_from_sensor."""
    rig = vehicle().placed([3, 4, 0], yaw=30)
    lidar = rig.sensors["top"]
    body = raycam.Lidar("vlp16").placed([3, 4, 0], yaw=30).pose
    mount = raycam.Lidar("vlp16").placed([0, 0, 1.8], yaw=5).pose
    np.testing.assert_allclose(lidar.pose, body @ mount, atol=1e-12)
    assert list(rig) == ["camera"]


def test_sample_contains_the_fields_of_the_scan() -> None:
    lidar = vehicle().placed([1, 0, 0]).sensors["top"]
    assert isinstance(lidar, raycam.Lidar)
    arrays = sample_sensor(lidar, street(), frame=3)
    scan = raycam.scan(street(), lidar, frame=3)
    for name in scan:
        np.testing.assert_array_equal(arrays[name], scan[name])
    np.testing.assert_array_equal(arrays["world_from_sensor"], lidar.pose)
    assert read_sensor(describe_sensor(lidar)) == lidar


def test_data_sets_without_a_lidar_format_contain_the_scans_as_arrays(tmp_path: Path) -> None:
    rigs, times = [vehicle().placed([x, 0, 0]) for x in (0.0, 1.0)], [0.0, 0.1]
    for name, workers in (("a", None), ("b", 2)):
        write(street(), tmp_path / name, "coco", cameras=rigs, times=times, samples=1, workers=workers)
    for number in (0, 1):
        path = Path("sensors") / "top" / f"{number:06d}.npz"
        assert (tmp_path / "a" / path).read_bytes() == (tmp_path / "b" / path).read_bytes()
        with np.load(tmp_path / "a" / path) as arrays:
            assert len(arrays["position"]) > 5000


def test_video_samples_the_lidar_at_its_times() -> None:
    world = street()
    keys = [{"time": t, "object": "car", "location": [12 + 4 * t, 3, 0.75]} for t in (0, 1)]
    world.set_video(seconds=1, fps=4, interpolation="linear", keyframe=keys)
    rig = vehicle(rate=5)
    plan = VideoPlan(world, rig["camera"])
    arrays = plan.sample(2, rig)["top"]
    car = arrays["instance"] == 1
    lidar = rig.sensors["top"]
    assert isinstance(lidar, raycam.Lidar)
    scan = raycam.scan(world.at(0.5), lidar, frame=2)
    np.testing.assert_array_equal(arrays["true_position"], scan["true_position"])
    # The rear side of the car is at 10 + 4 t.
    rear = car & (np.abs(arrays["normal"][:, 0] + 1) < 1e-9)
    assert rear.sum() > 10
    x = arrays["true_position"][rear, 0]
    np.testing.assert_allclose(x, 10 + 4 * (0.5 + arrays["time"][rear]), atol=1e-9)


def test_object_that_is_not_a_sensor_is_refused() -> None:
    with pytest.raises(raycam.SettingsError):
        raycam.Rig({"camera": vehicle()["camera"], "top": "vlp16"})  # type: ignore[dict-item]
