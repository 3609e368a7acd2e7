"""Lists of poses without K: quaternions, R and t, matrices whose key states the direction, and tables with units."""

from __future__ import annotations

import json
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raycam
from scipy.spatial.transform import Rotation
from support.raises import has_notice, raises

R = Rotation.from_rotvec([0.4, -0.7, 0.3])
C = np.array([1.5, -2.0, 0.75])
TURN = R.as_matrix()
CAMERA = raycam.Camera([[500, 0, 320], [0, 500, 240], [0, 0, 1]], np.eye(3), [0, 0, 0], (640, 480))
WORLD_FROM_CAMERA = np.block([[R.as_matrix(), C[:, None]], [np.eye(4)[3:]]])
XYZW = R.as_quat().tolist()
POSITION = dict(zip("xyz", C.tolist(), strict=True))
ORIENTATION = dict(zip("xyzw", XYZW, strict=True))


def read(folder: Path, content: Any, **arguments: Any) -> raycam.Cameras:
    (folder / "a.json").write_text(json.dumps(content))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return raycam.load_cameras(folder / "a.json", intrinsics=CAMERA, **arguments)


def check(cameras: raycam.Cameras, world_from_camera: Any = TURN, center: Any = C) -> None:
    for camera in cameras.values():
        np.testing.assert_allclose(camera.R, np.asarray(world_from_camera).T, atol=1e-9)
        np.testing.assert_allclose(camera.C, center, atol=1e-9)
    assert not has_notice(cameras.notices, "ignored_key"), cameras.notices


@pytest.mark.parametrize(
    "pose",
    [
        {"position": C.tolist(), "orientation_xyzw": XYZW},
        {"position": POSITION, "orientation": ORIENTATION},
        {"translation": C.tolist(), "quaternion_wxyz": [XYZW[3], *XYZW[:3]]},
        {"transform": {"translation": POSITION, "rotation": ORIENTATION}},
        dict(zip(["tx", "ty", "tz", "qx", "qy", "qz", "qw"], [*C, *XYZW], strict=True)),
    ],
)
def test_quaternions_and_positions_are_poses(tmp_path: Path, pose: dict[str, Any]) -> None:
    named = read(tmp_path, [{"name": "a", **pose}, {"name": "b", **pose}])
    assert list(named) == ["a", "b"]
    assert has_notice(named.notices, "assumed_convention", "world_from_camera")
    check(named)
    check(read(tmp_path, {"poses": [{"timestamp": 1.5, **pose}, {"timestamp": 2.5, **pose}]}))
    check(read(tmp_path, {"img1": pose, "img2": pose}))
    check(read(tmp_path, pose))


def test_position_is_the_center_and_translation_is_not(tmp_path: Path) -> None:
    inverse, turned = R.inv(), {"direction": "camera_from_world"}
    check(read(tmp_path, [{"position": C.tolist(), "q_xyzw": XYZW}], **turned), inverse.as_matrix())
    moved = read(tmp_path, [{"translation": C.tolist(), "q_xyzw": XYZW}], **turned)
    check(moved, inverse.as_matrix(), -inverse.apply(C))


@pytest.mark.parametrize("key", ["w2c", "world_to_camera", "extrinsic"])
def test_key_of_each_item_states_the_direction(tmp_path: Path, key: str) -> None:
    matrix = np.linalg.inv(WORLD_FROM_CAMERA).tolist()
    check(read(tmp_path, {"frames": [{"id": 1, key: matrix}, {"id": 2, key: matrix}]}))
    check(read(tmp_path, [{"name": "a", key: matrix}]))


def test_different_keys_of_the_items_are_refused(tmp_path: Path) -> None:
    items = [{"w2c": np.eye(4).tolist()}, {"c2w": np.eye(4).tolist()}]
    with raises(raycam.FormatError, mentions=["w2c", "c2w"]):
        read(tmp_path, items)


def test_r_and_t_are_camera_from_world(tmp_path: Path) -> None:
    w2c = np.linalg.inv(WORLD_FROM_CAMERA)
    pose = {"R": w2c[:3, :3].tolist(), "t": w2c[:3, 3].tolist()}
    check(read(tmp_path, [{"image": "a.png", **pose}, {"image": "b.png", **pose}]))


def test_axes_alone_keep_the_direction_of_the_key(tmp_path: Path) -> None:
    w2c = np.diag([1.0, -1, -1, 1]) @ np.linalg.inv(WORLD_FROM_CAMERA)
    check(read(tmp_path, {"w2c": [w2c.tolist()] * 2}, axes="opengl"))


ROW = [1.5, *C.tolist(), *XYZW]


@pytest.mark.parametrize("separator", [" ", ","])
@pytest.mark.parametrize("head", ["", "timestamp x y z qx qy qz qw\n"])
def test_comments_after_the_numbers_of_a_trajectory_are_ignored(
    tmp_path: Path, separator: str, head: str
) -> None:
    if separator == "," and not head:
        head = "timestamp x y z qx qy qz qw\n"
    rows = [separator.join(map(str, [time, *ROW[1:]])) + "  # pose" for time in (1.5, 2.5)]
    (tmp_path / "a.txt").write_text(head.replace(" ", separator) + "\n".join(rows) + "\n")
    cameras = raycam.load_cameras(tmp_path / "a.txt", intrinsics=CAMERA)
    assert len(cameras) == 2
    check(cameras)


@pytest.mark.parametrize(("unit", "factor"), [("m", 1.0), ("mm", 1000.0)])
def test_units_in_a_row_below_the_header_are_reported(tmp_path: Path, unit: str, factor: float) -> None:
    values = [1500.0, *(factor * C).tolist(), *XYZW]
    lines = ["timestamp,x,y,z,qx,qy,qz,qw", f"ms,{unit},{unit},{unit},-,-,-,-", ",".join(map(str, values))]
    (tmp_path / "a.csv").write_text("\n".join(lines) + "\n")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        cameras = raycam.load_cameras(tmp_path / "a.csv", intrinsics=CAMERA)
    check(cameras, center=factor * C)
    assert next(iter(cameras.times.values())) == 1.5
    assert has_notice(cameras.notices, "placed_cameras", "mm") == (unit == "mm")


@pytest.mark.parametrize(
    ("header", "word"),
    [
        ("time,x,y,z,roll,pitch,yaw", "roll"),
        ("t,tx,ty,tz,rx,ry,rz", "rx"),
        ("r11,r12,r13,r21,r22,r23,r31", "16 numbers"),
    ],
)
def test_columns_of_other_rotations_are_refused_with_a_remedy(tmp_path: Path, header: str, word: str) -> None:
    (tmp_path / "a.csv").write_text(f"{header}\n1,2,3,4,5,6,7\n")
    with raises(raycam.FormatError, mentions=[word]):
        raycam.load_cameras(tmp_path / "a.csv")
