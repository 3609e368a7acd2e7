"""MCAP bags, read by the decoder of the mcap project."""

from __future__ import annotations

import importlib
import io
import json
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
import raycam
from PIL import Image
from raycam.dataset import write
from raycam.dataset.training.mcap import quaternion
from scipy.spatial.transform import Rotation
from support.raises import fault, raises

SIZE = (32, 24)


def world() -> raycam.World:
    found = raycam.World()
    found.add_object(sphere={}, color="tomato")
    found.add_light("sun", direction=[1, 1, -1], irradiance=2)
    return found


def cameras() -> list[raycam.Camera]:
    eyes = [[3, 0, 0.5], [0, -3, 1], [-2, 2, 2]]
    lens = [-0.2, 0.05, 0.001, 0.002]
    return [raycam.Camera.look_at(eye, [0, 0, 0], fov=50, size=SIZE).replace(distortion=lens) for eye in eyes]


def test_bag_contains_the_rendered_images(tmp_path: Path) -> None:
    pytest.importorskip("mcap_ros2")
    from mcap.reader import make_reader
    from mcap_ros2.decoder import DecoderFactory

    write(world(), tmp_path / "a", "mcap", cameras=cameras(), times=[0.0, 0.25, 1.5], samples=1)
    write(world(), tmp_path / "b", "mcap", cameras=cameras(), times=[0.0, 0.25, 1.5], samples=1, workers=2)
    assert (tmp_path / "a" / "raycam.mcap").read_bytes() == (tmp_path / "b" / "raycam.mcap").read_bytes()
    found: dict[str, list[Any]] = {}
    with (tmp_path / "a" / "raycam.mcap").open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        for _, channel, message, decoded in reader.iter_decoded_messages():
            found.setdefault(channel.topic, []).append((message.log_time, decoded))
    assert sorted(found) == [
        "/camera/camera_info",
        "/camera/depth",
        "/camera/image/compressed",
        "/camera/instance",
        "/camera/pose",
        "/instances",
        "/tf",
    ]
    (_, names), *_ = found["/instances"]
    assert json.loads(names.data) == {"0": {"name": "sphere", "category": None}}
    for number, camera in enumerate(cameras()):
        frame = raycam.render(world(), camera, samples=1)
        stamp, info = found["/camera/camera_info"][number]
        assert stamp == [1_000_000_000, 1_250_000_000, 2_500_000_000][number]
        assert info.header.stamp.sec * 10**9 + info.header.stamp.nanosec == stamp
        assert (info.width, info.height, info.distortion_model) == (*SIZE, "plumb_bob")
        np.testing.assert_array_equal(info.k, camera.K.ravel())
        np.testing.assert_array_equal(info.d, [-0.2, 0.05, 0.001, 0.002, 0])
        np.testing.assert_array_equal(np.reshape(info.p, (3, 4))[:, :3], camera.K)
        picture = found["/camera/image/compressed"][number][1]
        pixels = np.asarray(Image.open(io.BytesIO(bytes(picture.data))))
        np.testing.assert_array_equal(pixels, frame.to_srgb8())
        depth = found["/camera/depth"][number][1]
        metres = np.frombuffer(bytes(depth.data), "<f4").reshape(depth.height, depth.width)
        np.testing.assert_array_equal(np.where(np.isnan(metres), np.inf, metres), frame["depth"])
        ids = found["/camera/instance"][number][1]
        assert ids.encoding == "32SC1"
        numbers = np.frombuffer(bytes(ids.data), "<i4").reshape(ids.height, ids.width)
        np.testing.assert_array_equal(numbers, frame["instance"])
        (moved,) = found["/tf"][number][1].transforms
        assert (moved.header.frame_id, moved.child_frame_id) == ("world", "camera_optical")
        np.testing.assert_allclose(matrix_of(moved.transform)[:3, :3], camera.R.T, atol=1e-12)
        np.testing.assert_allclose(matrix_of(moved.transform)[:3, 3], camera.C, atol=1e-12)
        pose = found["/camera/pose"][number][1].pose
        assert [pose.position.x, pose.position.y, pose.position.z] == camera.C.tolist()
        x, y, z, w = (getattr(pose.orientation, axis) for axis in "xyzw")
        matrix = np.array(
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
            ]
        )
        np.testing.assert_allclose(matrix, camera.R.T, atol=1e-12)
    text = (tmp_path / "a" / "metadata.yaml").read_text()
    assert "message_count: 19" in text
    assert "nanoseconds: 1500000000" in text


def test_folder_is_a_ros_2_bag(tmp_path: Path) -> None:
    # rosbags has its own MCAP reader and message definitions.
    rosbag2 = pytest.importorskip("rosbags.rosbag2")
    typesys = importlib.import_module("rosbags.typesys")
    rig = {"body": raycam.Rig.stereo(cameras()[0].pinhole(), 0.1)}
    write(world(), tmp_path / "bag", "mcap", cameras=rig, fps=10.0, samples=1)
    store = typesys.get_typestore(typesys.Stores.ROS2_JAZZY)
    found: dict[str, Any] = {}
    with rosbag2.Reader(tmp_path / "bag") as reader:
        assert reader.message_count == 14
        assert reader.duration == 1  # all messages have one time, and rosbags places the end 1 ns later
        for connection, stamp, raw in reader.messages():
            found[connection.topic] = store.deserialize_cdr(raw, connection.msgtype)
            assert stamp == 10**9
    assert len(found) == 13
    for name, camera in rig["body"].items():
        (info,) = (value for topic, value in found.items() if name in topic and "info" in topic)
        assert (info.width, info.height, info.header.frame_id) == (*SIZE, f"{name}_optical")
        np.testing.assert_array_equal(info.k.reshape(3, 3), camera.K)
        np.testing.assert_array_equal(info.r.reshape(3, 3), np.eye(3))
        np.testing.assert_array_equal(info.p.reshape(3, 4)[:, :3], camera.K)
        (pose,) = (value.pose for topic, value in found.items() if name in topic and "pose" in topic)
        np.testing.assert_array_equal([pose.position.x, pose.position.y, pose.position.z], camera.C)
        (depth,) = (value for topic, value in found.items() if name in topic and "depth" in topic)
        assert (depth.encoding, depth.step, depth.is_bigendian) == ("32FC1", 4 * SIZE[0], 0)


def matrix_of(transform: Any) -> np.ndarray:
    """The matrix [4, 4] of a geometry_msgs/Transform, computed with SciPy."""
    found = np.eye(4)
    found[:3, :3] = Rotation.from_quat([getattr(transform.rotation, axis) for axis in "xyzw"]).as_matrix()
    found[:3, 3] = [getattr(transform.translation, axis) for axis in "xyz"]
    return found


@pytest.mark.parametrize("start", [0.0, 1_700_000_000.25])
def test_transforms_place_the_cameras_of_a_rig(tmp_path: Path, start: float) -> None:
    """world_from_base base_from_camera equals world_from_camera; base_from_camera is static."""
    rosbag2 = pytest.importorskip("rosbags.rosbag2")
    typesys = importlib.import_module("rosbags.typesys")
    mounts = {
        "front": raycam.Camera.from_pose([0.2, 0, 0.1], 0, 5, 0, size=SIZE, fov=60),
        "side": raycam.Camera.from_pose([0, 0.3, 0.1], 3, -5, 80, size=SIZE, fov=60),
    }
    poses = [Rotation.from_euler("zyx", [yaw, 4, 7], degrees=True).as_matrix().T for yaw in (0, 30, 75)]
    places = [[3.0, 0.1, 0.2], [2.0, 1.0, 0.3], [1.0, 2.0, 0.4]]
    rigs = [raycam.Rig(mounts, R, C) for R, C in zip(poses, places, strict=True)]
    write(world(), tmp_path / "bag", "mcap", cameras=rigs, times=[0.0, 0.5, 1.0], start_time=start, samples=1)
    store = typesys.get_typestore(typesys.Stores.ROS2_JAZZY)
    moving, static = [], {}
    with rosbag2.Reader(tmp_path / "bag") as reader:
        assert reader.start_time == round(start * 1e9)
        for connection, stamp, raw in reader.messages():
            if connection.topic in ("/tf", "/tf_static"):
                (found,) = store.deserialize_cdr(raw, connection.msgtype).transforms
                assert found.header.stamp.sec * 10**9 + found.header.stamp.nanosec == stamp
                if connection.topic == "/tf":
                    assert (found.header.frame_id, found.child_frame_id) == ("world", "base_link")
                    moving.append((stamp, matrix_of(found.transform)))
                else:
                    assert found.header.frame_id == "base_link"
                    static[found.child_frame_id] = matrix_of(found.transform)
        qos = {one.topic: one.ext.offered_qos_profiles for one in reader.connections}
    assert sorted(static) == ["front_optical", "side_optical"]
    assert [stamp - round(start * 1e9) for stamp, _ in moving] == [0, 500_000_000, 1_000_000_000]
    assert qos["/tf_static"]
    assert not qos["/tf"]
    for (_, body), rig in zip(moving, rigs, strict=True):
        np.testing.assert_allclose(body[:3, 3], rig.C, atol=1e-12)
        for name, camera in rig.items():
            placed = body @ static[f"{name}_optical"]
            np.testing.assert_allclose(placed[:3, :3], camera.R.T, atol=1e-12)
            np.testing.assert_allclose(placed[:3, 3], camera.C, atol=1e-12)


@pytest.mark.parametrize("wrong", [-1, float("nan"), 2**31, True, "now"])
def test_start_time_out_of_range_raises(tmp_path: Path, wrong: Any) -> None:
    with pytest.raises(raycam.SettingsError):
        write(world(), tmp_path / "a", "mcap", cameras=cameras(), start_time=wrong)


def test_projection_of_a_rectified_pair_equals_opencv(tmp_path: Path) -> None:
    rosbag2 = pytest.importorskip("rosbags.rosbag2")
    typesys = importlib.import_module("rosbags.typesys")
    raw = cameras()[0]
    turned = cv2.Rodrigues(np.array([0.004, -0.01, 0.006]))[0]
    rig = raycam.Rig(
        {"left": raw, "right": raw.at_pose(turned @ raw.R, raw.C + raw.R.T @ [0.12, 0.002, -0.003])}
    )
    k, lens = raw.K, np.array([-0.2, 0.05, 0.001, 0.002])
    between = rig["right"].R @ (raw.C - rig["right"].C)[:, None]
    _, _, p1, p2, *_ = cv2.stereoRectify(
        k, lens, k, lens, SIZE, turned, between, flags=cv2.CALIB_ZERO_DISPARITY
    )
    assert p2[0, 3] < -1
    pair = rig.rectified(K=p1[:, :3])
    three = dict(pair.items()) | {"nose": pair["left"].replace(K=p1[:, :3] * [[2], [2], [1]])}
    for name, cams, count in (("pair", pair, 2), ("three", raycam.Rig(three), 3), ("raw", rig, 2)):
        write(world(), tmp_path / name, "mcap", cameras={"body": cams}, samples=1)
        store = typesys.get_typestore(typesys.Stores.ROS2_JAZZY)
        found: dict[str, Any] = {}
        with rosbag2.Reader(tmp_path / name) as reader:
            for connection, _, data in reader.messages():
                if connection.topic.endswith("camera_info"):
                    found[connection.topic.split("/")[2]] = store.deserialize_cdr(data, connection.msgtype)
        assert len(found) == count
        for camera, info in found.items():
            np.testing.assert_array_equal(info.r.reshape(3, 3), np.eye(3))
            np.testing.assert_array_equal(info.p.reshape(3, 4)[:, :3], info.k.reshape(3, 3))
            wanted = p2[0, 3] if camera == "right" and name != "raw" else 0.0
            np.testing.assert_allclose(info.p.reshape(3, 4)[:, 3], [wanted, 0, 0], atol=1e-9)


def test_quaternions_of_all_rotations_equal_scipy() -> None:
    generator = np.random.default_rng(2)
    for _ in range(200):
        q = generator.normal(size=4)
        q /= np.linalg.norm(q) * (1 if q[3] >= 0 else -1)
        x, y, z, w = q
        matrix = np.array(
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
            ]
        )
        np.testing.assert_allclose(quaternion(matrix), q, atol=1e-12)


def test_invalid_mcap_options_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("mcap")
    lens = cameras()[0].replace(distortion=[0.1], model="division")
    for options, words in (
        ({"cameras": [lens]}, fault("unsupported_camera", "division")),
        ({"cameras": cameras(), "fps": 0}, fault("out_of_range", "fps")),
        ({"cameras": cameras(), "topic": "camera"}, fault("invalid_value", "'camera'")),
    ):
        with raises(raycam.SettingsError, **words):
            write(world(), tmp_path / "x", "mcap", **options)
    assert not (tmp_path / "x").exists()


def test_missing_mcap_package_is_reported_with_its_extra(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(__import__("sys").modules, "mcap", None)
    monkeypatch.setitem(__import__("sys").modules, "mcap.writer", None)
    with raises(raycam.SettingsError, code="missing_dependency", mentions=["raycam[mcap]"]):
        write(world(), tmp_path / "x", "mcap", cameras=cameras())
