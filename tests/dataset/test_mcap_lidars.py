"""Scans in MCAP bags, read by the decoder of the mcap project and by rosbags."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raycam
from dataset.test_semantickitti import FORWARD, street
from raycam.dataset import write
from scipy.spatial.transform import Rotation

TYPES = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 8: "f8"}


def decoded(path: Path) -> dict[str, list[Any]]:
    from mcap.reader import make_reader
    from mcap_ros2.decoder import DecoderFactory

    found: dict[str, list[Any]] = {}
    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        for _, channel, _, message in reader.iter_decoded_messages():
            found.setdefault(channel.topic, []).append(message)
    return found


def cloud(message: Any) -> Any:
    kinds = np.dtype(
        {
            "names": [field.name for field in message.fields],
            "formats": [f"<{TYPES[field.datatype]}" for field in message.fields],
            "offsets": [field.offset for field in message.fields],
            "itemsize": message.point_step,
        }
    )
    assert message.row_step == message.point_step * message.width
    assert (message.height, message.is_bigendian, message.is_dense) == (1, False, True)
    return np.frombuffer(bytes(message.data), kinds)


def matrix(transform: Any) -> Any:
    found = np.eye(4)
    q, p = transform.transform.rotation, transform.transform.translation
    found[:3, :3] = Rotation.from_quat([q.x, q.y, q.z, q.w]).as_matrix()
    found[:3, 3] = [p.x, p.y, p.z]
    return found


def car(name: str) -> raycam.Rig:
    camera = raycam.Camera([[60, 0, 40], [0, 60, 30], [0, 0, 1]], FORWARD, [0.5, 0, 1.2], (80, 60))
    light = {"near_ir_samples": 2, "near_ir_gain": 100.0} if name == "os1-16" else {}
    lidar = raycam.Lidar(name, noise=False, min_range=0, **light).placed([0.2, 0, 1.8], yaw=5)
    return raycam.Rig({"camera": camera, "top": lidar})


@pytest.mark.parametrize(
    ("name", "fields"),
    [
        ("vlp16", ["intensity", "ring", "time"]),
        ("os1-16", ["intensity", "t", "reflectivity", "ring", "ambient", "range"]),
        ("livox-mid40", ["intensity", "tag", "line", "timestamp"]),
    ],
)
def test_point_clouds_have_the_fields_of_the_driver_and_lie_on_their_objects(
    name: str, fields: list[str], tmp_path: Path
) -> None:
    world, rig = street(), car(name)
    rigs = [rig.placed([i * 1.0, 0, 0], yaw=2 * i) for i in range(2)]
    write(world, tmp_path, "mcap", cameras=rigs, times=[0.0, 0.1], samples=1)
    found = decoded(tmp_path / "raycam.mcap")
    assert not list(tmp_path.rglob("*.npz"))
    assert len(found["/top/points"]) == 2
    fixed = [t for message in found["/tf_static"] for t in message.transforms]
    (mount,) = [t for t in fixed if t.child_frame_id == "top"]
    assert mount.header.frame_id == "base_link"
    bodies = [t for message in found["/tf"] for t in message.transforms if t.child_frame_id == "base_link"]
    for number, message in enumerate(found["/top/points"]):
        assert message.header.frame_id == "top"
        assert message.header.stamp.sec * 10**9 + message.header.stamp.nanosec == 10**9 + number * 10**8
        points = cloud(message)
        assert list(points.dtype.names or ()) == ["x", "y", "z", *fields, "instance", "category"]
        pose = matrix(bodies[number]) @ matrix(mount)
        np.testing.assert_allclose(pose, rigs[number].sensors["top"].pose, atol=1e-9)
        view = raycam.dataset.views(world, rigs, [0.0, 0.1])[number]
        lidar = view.sensors["top"]
        assert isinstance(lidar, raycam.Lidar)
        scan = raycam.scan(world, lidar, frame=number)
        for i, axis in enumerate("xyz"):
            np.testing.assert_array_equal(points[axis], scan["position"][:, i].astype(np.float32))
        np.testing.assert_array_equal(points["instance"], scan["instance"])
        if name == "vlp16":
            np.testing.assert_array_equal(points["time"], scan["time"].astype(np.float32))
            np.testing.assert_array_equal(points["ring"], scan["ring"])
        if name == "os1-16":
            np.testing.assert_allclose(points["t"] / 1e9, scan["time"], atol=1e-9)
            np.testing.assert_allclose(points["range"] / 1000, scan["distance"], atol=5.1e-4)
            np.testing.assert_array_equal(points["intensity"], scan["signal"])
            np.testing.assert_array_equal(points["reflectivity"], scan["intensity"])
            assert (points["ambient"] == np.rint(scan["near_ir"] * 100.0)).all()
            assert (points["ambient"] > 0).any()
        if name == "livox-mid40":
            np.testing.assert_allclose(points["timestamp"] / 1e9, 1 + number * 0.1 + scan["time"], atol=1e-6)


def test_point_clouds_are_read_by_rosbags(tmp_path: Path) -> None:
    from rosbags.highlevel import AnyReader
    from rosbags.typesys import Stores, get_typestore

    write(street(), tmp_path, "mcap", cameras=[car("vlp16")], samples=1)
    with AnyReader([tmp_path], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
        chosen = [item for item in reader.connections if item.topic == "/top/points"]
        (message,) = [reader.deserialize(data, item.msgtype) for item, _, data in reader.messages(chosen)]
    assert message.width * message.point_step == len(message.data)
    assert [field.name for field in message.fields][:6] == ["x", "y", "z", "intensity", "ring", "time"]
