"""Poses of a quaternion next to a position, in files with K; compared with SciPy's rotations."""

from __future__ import annotations

import json
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raycam
import yaml
from scipy.spatial.transform import Rotation
from support.raises import has_notice, raises

CAMERA = {"K": [[500.0, 0, 320], [0, 500, 240], [0, 0, 1]], "dist": [0.0] * 5, "img_size": [640, 480]}
R = Rotation.from_rotvec([0.4, -0.7, 0.3])
C = np.array([1.5, -2.0, 0.75])
OPENGL = np.diag([1.0, -1.0, -1.0])


def numbers(order: str, rotation: Rotation = R) -> list[float]:
    """The quaternion in the order "wxyz" or "xyzw"."""
    return rotation.as_quat(scalar_first=order == "wxyz").tolist()  # type: ignore[no-any-return]


def read(folder: Path, content: dict[str, Any], ending: str = "json", **arguments: Any) -> raycam.Camera:
    path = folder / f"a.{ending}"
    text = json.dumps({**CAMERA, **content}) if ending == "json" else yaml.safe_dump({**CAMERA, **content})
    path.write_text(text)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        cameras = raycam.load_cameras(path, **arguments)
    assert not has_notice(cameras.notices, "ignored_key"), cameras.notices
    return next(iter(cameras.values()))


def check(camera: raycam.Camera, world_from_camera: Any, center: Any = C) -> None:
    np.testing.assert_allclose(camera.R, np.asarray(world_from_camera).T, atol=1e-12)
    np.testing.assert_allclose(camera.C, center, atol=1e-12)


KEYS = [
    ("quaternion_wxyz", "wxyz"),
    ("quaternion_xyzw", "xyzw"),
    ("rotation_quaternion_wxyz", "wxyz"),
    ("orientation_xyzw", "xyzw"),
    ("orientation (w, x, y, z)", "wxyz"),
    ("quatXYZW", "xyzw"),
    ("q_wxyz", "wxyz"),
    ("qw_qx_qy_qz", "wxyz"),
    ("rotation-xyzw", "xyzw"),
    ("rot_scalar_first", "wxyz"),
    ("quaternion_w_last", "xyzw"),
    ("camera_orientation_wxyz", "wxyz"),
]


@pytest.mark.parametrize(("key", "order"), KEYS)
@pytest.mark.parametrize("place", ["position", "location", "C", "camera_position", "center"])
def test_order_in_the_key_and_the_callers_direction_determine_the_pose(
    tmp_path: Path, key: str, order: str, place: str
) -> None:
    content = {place: C.tolist(), key: numbers(order)}
    for ending in ("json", "yaml"):
        check(read(tmp_path, content, ending, direction="world_from_camera"), R.as_matrix())
        check(read(tmp_path, content, ending, direction="camera_from_world"), R.inv().as_matrix())
    gl = {"direction": "world_from_camera", "axes": "opengl"}
    check(read(tmp_path, content, **gl), R.as_matrix() @ OPENGL)


@pytest.mark.parametrize("place", ["translation", "t", "T", "trans"])
def test_translation_is_the_center_or_the_translation_according_to_the_direction(
    tmp_path: Path, place: str
) -> None:
    content = {place: C.tolist(), "quaternion_wxyz": numbers("wxyz")}
    check(read(tmp_path, content, direction="world_from_camera"), R.as_matrix())
    check(read(tmp_path, content, direction="camera_from_world"), R.inv().as_matrix(), -R.inv().apply(C))


@pytest.mark.parametrize(
    "content",
    [
        {"position": [1, 2, 3], "quaternion_wxyz": [1, 0, 0, 0]},
        {"t": [1, 2, 3], "orientation_xyzw": [0, 0, 0, 1]},
        {"location": {"x": 1, "y": 2, "z": 3}, "orientation": {"w": 1, "x": 0, "y": 0, "z": 0}},
        {"tx": 1, "ty": 2, "tz": 3, "qw": 1, "qx": 0, "qy": 0, "qz": 0},
        {"position": [1, 2, 3], "R": np.eye(3).tolist()},
    ],
)
def test_unknown_direction_is_refused_with_both_choices(tmp_path: Path, content: dict[str, Any]) -> None:
    choices = ["world_from_camera", "camera_from_world", "--direction"]
    with raises(raycam.FormatError, mentions=choices):
        read(tmp_path, content)


@pytest.mark.parametrize(
    ("key", "t_key", "is_world_from_camera"),
    [
        ("c2w_quaternion_wxyz", "position", True),
        ("quaternion_wxyz_c2w", "t", True),
        ("q_wc_wxyz", "t_wc", True),
        ("q_cw_wxyz", "t_cw", False),
        ("w2c_quat_wxyz", "translation", False),
        ("qvec_wxyz", "tvec", False),
    ],
)
def test_direction_in_the_key_needs_no_argument(
    tmp_path: Path, key: str, t_key: str, is_world_from_camera: bool
) -> None:
    camera = read(tmp_path, {key: numbers("wxyz"), t_key: C.tolist()})
    if is_world_from_camera:
        check(camera, R.as_matrix())
    else:
        check(camera, R.inv().as_matrix(), -R.inv().apply(C))


def test_keys_recommended_by_an_error_are_read(tmp_path: Path) -> None:
    with raises(raycam.FormatError, mentions=["orientation_wxyz", "orientation_xyzw"]):
        read(tmp_path, {"position": C.tolist(), "orientation": numbers("wxyz")})
    with raises(raycam.FormatError, mentions=["c2w_orientation_wxyz"]):
        read(tmp_path, {"position": C.tolist(), "orientation_wxyz": numbers("wxyz")})
    check(read(tmp_path, {"position": C.tolist(), "c2w_orientation_wxyz": numbers("wxyz")}), R.as_matrix())


def test_argument_that_contradicts_the_key_is_refused(tmp_path: Path) -> None:
    content = {"c2w_q_xyzw": numbers("xyzw"), "position": C.tolist()}
    with raises(raycam.FormatError, mentions=["direction="]):
        read(tmp_path, content, direction="camera_from_world")
    check(read(tmp_path, content, axes="opengl"), R.as_matrix() @ OPENGL)


def test_two_different_rotations_or_places_are_refused(tmp_path: Path) -> None:
    both = {"quaternion_wxyz": numbers("wxyz"), "quaternion_xyzw": numbers("wxyz"), "position": C.tolist()}
    with raises(raycam.FormatError, mentions=["quaternion_wxyz", "different rotation"]):
        read(tmp_path, both, direction="world_from_camera")
    equal = {**both, "quaternion_xyzw": numbers("xyzw")}
    check(read(tmp_path, equal, direction="world_from_camera"), R.as_matrix())
    with raises(raycam.FormatError, mentions=["position"]):
        read(tmp_path, {**equal, "t": [0, 0, 1]}, direction="world_from_camera")


def test_quaternions_of_marked_and_nested_cameras_are_read(tmp_path: Path) -> None:
    pose = {"position": C.tolist(), "orientation_xyzw": numbers("xyzw")}
    path = tmp_path / "cameras.json"
    path.write_text(
        json.dumps({"left": {**CAMERA, **pose}, "right": {**CAMERA, **pose, "position": [0, 0, 1]}})
    )
    cameras = raycam.load_cameras(path, direction="world_from_camera")
    check(cameras["left"], R.as_matrix())
    check(cameras["right"], R.as_matrix(), [0, 0, 1])


def test_axes_without_a_direction_use_the_direction_of_the_key(tmp_path: Path) -> None:
    w2c = np.eye(4)
    w2c[:3, :3], w2c[:3, 3] = R.as_matrix(), C
    camera = read(tmp_path, {"w2c": w2c.tolist()}, axes="opengl")
    flipped = OPENGL @ w2c[:3]
    np.testing.assert_allclose(camera.R, flipped[:, :3], atol=1e-12)
    np.testing.assert_allclose(camera.C, -flipped[:, :3].T @ flipped[:, 3], atol=1e-12)


def test_axes_of_a_rotation_next_to_a_position_are_applied(tmp_path: Path) -> None:
    content = {"position": C.tolist(), "R": R.as_matrix().tolist()}
    camera = read(tmp_path, content, direction="world_from_camera", axes="opengl")
    check(camera, R.as_matrix() @ OPENGL)


def test_pose_maps_with_a_stated_order_are_read(tmp_path: Path) -> None:
    pose = {"position": C.tolist(), "orientation_xyzw": numbers("xyzw")}
    check(read(tmp_path, {"c2w": pose}), R.as_matrix())
    check(read(tmp_path, {"pose": pose}, direction="world_from_camera"), R.as_matrix())


def test_four_numbers_of_unknown_order_under_rotation_are_refused(tmp_path: Path) -> None:
    with raises(raycam.FormatError, mentions=["quaternion_wxyz", "quaternion_xyzw"]):
        read(tmp_path, {"t": [0, 0, 0], "rotation": [1, 0, 0, 0]})
