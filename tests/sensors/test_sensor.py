"""Sensors in rigs, videos and data sets.

The expected depth of a wall in front of a sensor is a closed form.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raycam
import support
from raycam.dataset import write
from raycam.sensors import describe_sensor, read_sensor, sample_sensor
from raycam.video import VideoPlan
from support.depth_sensor import DepthSensor
from support.raises import raises, warns

AHEAD = [[0.0, -1, 0], [0, 0, -1], [1, 0, 0]]
"""camera_from_body of a camera that looks along the body's x axis."""


def world() -> raycam.World:
    """A wall: the plane x = 10, facing the origin."""
    world = raycam.World()
    corners = [[10.0, -50, -50], [10, 50, -50], [10, 50, 50], [10, -50, 50]]
    world.add_mesh(corners, [[0, 2, 1], [0, 3, 2]], name="wall", category="wall")
    world.add_light("sky", radiance=1)
    return world


def camera() -> raycam.Camera:
    return raycam.Camera([[20.0, 0, 8], [0, 20, 6], [0, 0, 1]], AHEAD, [0, 0, 0], (16, 12))


def rig(sensor: Any = None) -> raycam.Rig:
    return raycam.Rig({"left": camera(), "depth": sensor or DepthSensor()})


def turned(degrees: float) -> np.ndarray:
    """The rotation body_from_world of a body turned to the left about z."""
    angle = np.radians(degrees)
    return np.array([[np.cos(angle), np.sin(angle), 0], [-np.sin(angle), np.cos(angle), 0], [0, 0, 1]])


def test_camera_and_depth_sensor_implement_the_protocol() -> None:
    assert isinstance(camera(), raycam.Sensor)
    assert isinstance(DepthSensor(), raycam.Sensor)
    assert not isinstance(object(), raycam.Sensor)


def test_camera_sample_returns_the_arrays_of_render() -> None:
    arrays = camera().sample(world(), frame=3, channels=["color", "depth"], samples=2)
    frame = raycam.render(world(), camera(), frame=3, channels=["color", "depth"], samples=2)
    assert list(arrays) == ["color", "depth"]
    for name, array in arrays.items():
        np.testing.assert_array_equal(array, frame[name])


def test_camera_pose_maps_the_camera_axes_to_the_world() -> None:
    posed = camera().at_pose(camera().R @ turned(30), [1, 2, 3])
    np.testing.assert_allclose(posed.pose[:3, 3], [1, 2, 3])
    forward = posed.pose[:3, :3] @ [0, 0, 1]
    np.testing.assert_allclose(forward, [np.cos(np.pi / 6), np.sin(np.pi / 6), 0], atol=1e-12)
    with raises(raycam.CameraError, code="read_only", mentions=["at_pose"]):
        posed.pose[0, 3] = 1


@pytest.mark.parametrize(("direction", "lines"), [("down", 12), ("up", 12), ("right", 16), ("left", 16)])
def test_times_of_a_rolling_shutter_equal_the_times_of_its_lines(direction: Any, lines: int) -> None:
    still = camera()
    speed = 2.0
    moved = still.at_pose(still.R, [speed, 0, 0])
    rolling = still.moving(moved, exposure=0.25, readout=0.75, direction=direction)
    assert rolling.times.shape == (lines,)
    # The camera moves forward at 2 m/s: the origin of a line's rays gives its time.
    origins, _ = rolling.rays()
    along = origins[:, 0, 0] if direction in ("down", "up") else origins[0, :, 0]
    np.testing.assert_allclose(rolling.times, along / speed - 0.5, atol=1e-12)
    np.testing.assert_array_equal(still.times, [0.0])


def test_rig_places_its_sensors_in_the_world() -> None:
    # This sensor is 1 m above the body and looks to the body's left.
    mounted = DepthSensor().at_pose(turned(90), [0, 0, 1])
    body = rig(mounted).at_pose(turned(-90), [2, 3, 4])  # the body looks along -y: its left is +x
    sensor = body.sensors["depth"]
    np.testing.assert_allclose(sensor.pose[:3, 3], [2, 3, 5], atol=1e-12)
    arrays = sensor.sample(world())
    # A ray with x = 1 in sensor axes reaches the wall x = 10 from x = 2 at t = 8.
    np.testing.assert_allclose(arrays["depth"], np.full((3, 5), 8.0), atol=1e-9)
    assert list(body) == ["left"]
    assert list(body.sensors) == ["left", "depth"]
    assert body.sensors["left"] == body["left"]


def test_rig_with_sensors_is_restored_from_its_description() -> None:
    made = rig(DepthSensor(noise=0.1)).at_pose(turned(10), [1, 2, 3])
    again = raycam.Rig.from_dict(json.loads(json.dumps(made.to_dict())))
    assert again == made
    assert hash(again) == hash(made)
    assert again != rig(DepthSensor(noise=0.2)).at_pose(turned(10), [1, 2, 3])
    assert again.sensors["depth"].to_dict() == made.sensors["depth"].to_dict()
    moving = made.moving(made.at_pose(made.R, [2, 2, 3]), exposure=0.1)
    assert list(moving.sensors) == list(moving.still().sensors) == ["left", "depth"]
    np.testing.assert_allclose(moving.sensors["depth"].pose[:3, 3], [1.5, 2, 3])


def test_rig_refuses_an_object_that_is_not_a_sensor() -> None:
    with raises(raycam.SettingsError, code="wrong_type"):
        raycam.Rig({"left": camera(), "top": 3})  # type: ignore[dict-item]


def test_world_stores_the_sensors_of_a_rig() -> None:
    stored = world()
    stored.add_rig(rig(DepthSensor(noise=0.1)).at_pose(turned(90), [1, 2, 3]))
    for found in (stored, raycam.World.from_bytes(stored.to_bytes())):
        assert list(found.rigs["rig"].sensors) == ["left", "depth"]
        assert list(found.sensors) == ["rig/depth"]
        np.testing.assert_allclose(found.sensors["rig/depth"].pose[:3, 3], [1, 2, 3])
        assert found.rigs["rig"].at_pose(turned(0), [0, 0, 0]).sensors["depth"] == DepthSensor(noise=0.1)
    assert list(stored.cameras) == ["rig/left"]


def test_world_refuses_a_rig_with_a_sensor_that_cannot_be_described() -> None:
    class Local(DepthSensor):
        pass

    with raises(raycam.SettingsError, code="unimportable_class", mentions=["Local"]):
        world().add_rig(rig(Local()))
    with raises(raycam.SettingsError, code="wrong_type"):
        world().add_sensor(3)  # type: ignore[arg-type]
    with raises(raycam.WorldError, code="invalid_value", mentions=["../top"]):
        world().add_sensor(DepthSensor(), "../top")


def test_rig_without_cameras_requires_another_sensor() -> None:
    only = raycam.Rig({"depth": DepthSensor()}).at_pose(turned(90), [1, 2, 3])
    assert raycam.Rig.from_dict(json.loads(json.dumps(only.to_dict()))) == only
    np.testing.assert_allclose(only.sensors["depth"].pose[:3, 3], [1, 2, 3])
    with raises(raycam.CameraError, code="missing_value"):
        raycam.Rig({})


def test_world_adds_a_sensor_under_a_unique_name() -> None:
    made = world()
    made.add_sensor(DepthSensor())
    made.add_sensor(DepthSensor(noise=0.5).at_pose(turned(0), [0, 0, 1]))
    assert list(made.sensors) == ["sensor", "sensor-2"]
    np.testing.assert_allclose(made.sensors["sensor-2"].pose[:3, 3], [0, 0, 1])
    with raises(raycam.Error, code="read_only"):
        made.sensors["sensor"] = DepthSensor()


SENSOR = """
[[sensor]]
name = "depth"
type = "support.depth_sensor:DepthSensor"
location = [1, 0, 0]
[sensor.description]
columns = 5
rows = 3
duration = 0.0
noise = 0.0
world_from_sensor = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
"""


def test_world_file_names_a_sensor_by_its_class(tmp_path: Path) -> None:
    path = tmp_path / "a.toml"
    path.write_text(SENSOR, encoding="utf-8")
    sensor = raycam.load(path).sensors["depth"]
    assert isinstance(sensor, DepthSensor)
    np.testing.assert_allclose(sensor.sample(world())["depth"], np.full((3, 5), 9.0), atol=1e-9)


def test_world_file_does_not_import_the_class_of_a_sensor(tmp_path: Path) -> None:
    path = tmp_path / "a.toml"
    path.write_text(SENSOR.replace("support.depth_sensor", "antigravity"), encoding="utf-8")
    loaded = raycam.load(path)
    with warns(raycam.Notice, code="ignored_element", mentions=["antigravity"]):
        assert loaded.sensors == {}
    assert "antigravity" not in sys.modules
    path.write_text(SENSOR.replace(":DepthSensor", ""), encoding="utf-8")
    with raises(raycam.WorldError, mentions=["a.toml:4", "sensor[0].type"]):
        raycam.load(path)


def test_sensor_of_a_local_class_cannot_be_described() -> None:
    class Local(DepthSensor):
        pass

    with raises(raycam.SettingsError, code="unimportable_class", mentions=["Local"]):
        describe_sensor(Local())
    with raises(raycam.SettingsError, code="unimportable_class", mentions=["absent"]):
        read_sensor({"type": "absent.module:Lidar", "description": {}})
    assert read_sensor(describe_sensor(DepthSensor(noise=0.5))) == DepthSensor(noise=0.5)


def test_sample_refuses_results_that_are_not_arrays() -> None:
    class Broken(DepthSensor):
        def sample(self, world: raycam.World, **_: Any) -> dict[str, Any]:
            return {"depth": 3.0}

    with raises(raycam.SettingsError, code="wrong_type", mentions=["Broken"]):
        sample_sensor(Broken(), world())


def test_video_samples_the_sensors_of_a_rig_at_each_frame() -> None:
    moving = world()
    table = [{"time": t, "rig": "rig", "location": [2 * t, 0, 0]} for t in (0, 1)]
    moving.add_rig(rig())
    moving.set_video(fps=4, seconds=1, keyframe=table)
    plan = VideoPlan(moving, "rig/left", samples=1)
    for number in range(4):
        arrays = plan.sample(number, rig())["depth"]
        place = moving.rig_at(rig(), number / 4).C
        np.testing.assert_allclose(arrays["world_from_sensor"][:3, 3], place, atol=1e-12)
        np.testing.assert_allclose(arrays["depth"], np.full((3, 5), 10 - place[0]), atol=1e-9)
        own = plan.sample(number)["rig/depth"]
        np.testing.assert_array_equal(own["depth"], arrays["depth"])
    assert place[0] > 1.5


@pytest.mark.parametrize("format", ["coco", "kitti", "webdataset"])
def test_data_sets_contain_the_samples_of_a_rig(
    format: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Workers must be able to import `support`.
    monkeypatch.setenv("PYTHONPATH", str(Path(support.__file__).parents[1]))
    sensor = DepthSensor(noise=0.01, duration=0.2)
    right = camera().at_pose(camera().R, [0, -0.1, 0])
    body = raycam.Rig({"left": camera(), "right": right, "depth": sensor})
    poses = [body.at_pose(turned(0), [x, 0, 0]) for x in (0.0, 1.0, 2.0)]
    for name, workers in (("one", 1), ("two", 2)):
        write(world(), tmp_path / name, format, cameras=poses, samples=1, workers=workers)
    found = sorted(path.relative_to(tmp_path / "one") for path in (tmp_path / "one").rglob("*.npz"))
    assert [str(path) for path in found] == [f"sensors/depth/{number:06d}.npz" for number in (0, 2, 4)]
    for path, x, number in zip(found, (0.0, 1.0, 2.0), (0, 2, 4), strict=True):
        assert (tmp_path / "one" / path).read_bytes() == (tmp_path / "two" / path).read_bytes()
        with np.load(tmp_path / "one" / path) as arrays:
            noise = 0.01 * np.random.default_rng(number).standard_normal((3, 5))
            np.testing.assert_allclose(arrays["depth"], 10 - x + noise, atol=1e-9)
            np.testing.assert_array_equal(arrays["instance"], np.zeros((3, 5)))
            np.testing.assert_array_equal(arrays["times"], sensor.times)
            np.testing.assert_allclose(arrays["world_from_sensor"][:3, 3], [x, 0, 0])
