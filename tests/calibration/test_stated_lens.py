"""Lens models and poses under common keys are never lost; compared with OpenCV."""

from __future__ import annotations

import json
import warnings
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
import raycam
from raycam.errors import FormatError
from scipy.spatial.transform import Rotation
from support.raises import has_notice, raises

K = [[400.0, 0.0, 320.0], [0.0, 401.0, 240.0], [0.0, 0.0, 1.0]]
D = [0.05, -0.02, 0.004, -0.001]
CAMERA = {"K": K, "dist": D, "img_size": [640, 480]}


def read(folder: Path, content: Any, **arguments: Any) -> raycam.Cameras:
    (folder / "a.json").write_text(json.dumps(content))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return raycam.load_cameras(folder / "a.json", **arguments)


def check_fisheye(camera: Any) -> None:
    points = np.random.default_rng(0).uniform([-1, -1, 1], [1, 1, 2], (20, 3))
    expected, _ = cv2.fisheye.projectPoints(
        points[:, None], np.zeros(3), np.zeros(3), np.array(K), np.array(D)
    )
    np.testing.assert_allclose(camera.project(points)[0], expected[:, 0], atol=1e-6)


@pytest.mark.parametrize(
    "key", ["distortion_type", "lens_type", "projection", "model", "camera_model", "lensModel"]
)
@pytest.mark.parametrize(
    "word", ["fisheye", "cv2.fisheye", "OpenCV fisheye", "kannala-brandt", "equidistant"]
)
def test_fisheye_model_is_read_under_every_common_key(tmp_path: Path, key: str, word: str) -> None:
    for content in (
        {**CAMERA, key: word},
        {key: word, "cam0": CAMERA, "cam1": CAMERA},
        {key: word, "cameras": {"a": CAMERA}},
        {"cameras": {key: word, "a": CAMERA, "b": CAMERA}},
        {key: word, "cameras": [CAMERA, CAMERA]},
    ):
        cameras = read(tmp_path, content)
        assert len(cameras) >= 1
        for camera in cameras.values():
            check_fisheye(camera)


def test_tables_named_fisheye_set_the_lens_model(tmp_path: Path) -> None:
    gyroflow = {
        "name": "GoPro",
        "lens_model": "Wide",
        "calib_dimension": {"w": 640, "h": 480},
        "fisheye_params": {"RMS_error": 0.5, "camera_matrix": K, "distortion_coeffs": D},
    }
    (camera,) = read(tmp_path, gyroflow).values()
    check_fisheye(camera)
    assert camera.size == (640, 480)


def test_lens_model_of_a_camera_overrides_the_lens_model_of_the_file(tmp_path: Path) -> None:
    cameras = read(tmp_path, {"model": "fisheye", "a": CAMERA, "b": {**CAMERA, "model": "opencv"}})
    assert [camera.model for camera in cameras.values()] == ["fisheye", "opencv"]


def test_product_names_are_not_read_as_lens_models(tmp_path: Path) -> None:
    (camera,) = read(tmp_path, {**CAMERA, "camera_model": "Basler acA1920"}).values()
    assert camera.model == "opencv"


def test_lens_model_none_with_coefficients_is_refused(tmp_path: Path) -> None:
    with pytest.raises(FormatError) as caught:
        read(tmp_path, {**CAMERA, "distortion_model": "none"})
    assert "did you mean" not in str(caught.value)


POSE = np.eye(4)
POSE[:3, :3] = Rotation.from_rotvec([0.3, -0.2, 0.9]).as_matrix()
POSE[:3, 3] = [0.5, -1.0, 2.0]


@pytest.mark.parametrize(
    "key", ["w2c", "world2cam", "T_cam_world", "world_to_camera", "c2w", "cam2world", "T_world_cam"]
)
@pytest.mark.parametrize("rows", [3, 4])
def test_pose_keys_that_specify_the_direction_are_read(tmp_path: Path, key: str, rows: int) -> None:
    inverse = key in ("c2w", "cam2world", "T_world_cam")
    matrix = (np.linalg.inv(POSE) if inverse else POSE)[:rows]
    for content in ({**CAMERA, key: matrix.tolist()}, {"a": {**CAMERA, key: matrix.tolist()}}):
        (camera,) = read(tmp_path, content).values()
        np.testing.assert_allclose(camera.R, POSE[:3, :3], atol=1e-9)
        np.testing.assert_allclose(camera.C, -POSE[:3, :3].T @ POSE[:3, 3], atol=1e-9)


@pytest.mark.parametrize(
    "key", ["extrinsic", "extrinsics", "RT", "pose", "camera_pose_matrix", "my_transform", "T"]
)
def test_poses_without_direction_require_the_direction_argument(tmp_path: Path, key: str) -> None:
    content = {**CAMERA, key: POSE.tolist()}
    with raises(FormatError, code="missing_argument", mentions=["direction="]) as caught:
        read(tmp_path, content)
    assert key in str(caught.value)
    (camera,) = read(tmp_path, content, direction="camera_from_world").values()
    np.testing.assert_allclose(camera.R, POSE[:3, :3], atol=1e-9)
    (camera,) = read(tmp_path, content, direction="world_from_camera").values()
    np.testing.assert_allclose(camera.R.T, POSE[:3, :3], atol=1e-9)


@pytest.mark.parametrize(
    "extra",
    [
        {"R": POSE[:3, :3].tolist()},
        {"T": [1, 2, 3]},
        {"rvec": [0.1, 0.2, 0.3]},
        {"tvec": [1, 2, 3]},
    ],
)
def test_pose_with_only_rotation_or_translation_is_refused(tmp_path: Path, extra: dict[str, Any]) -> None:
    for content in ({**CAMERA, **extra}, {"a": CAMERA, "b": CAMERA, **extra}):
        with raises(FormatError, code="syntax", mentions=[next(iter(extra))]):
            read(tmp_path, content)


def test_pose_next_to_three_cameras_is_refused(tmp_path: Path) -> None:
    extra = {"R": POSE[:3, :3].tolist(), "T": [1, 2, 3]}
    with raises(FormatError, code="syntax", mentions=["a.json:1"]):
        read(tmp_path, {"a": CAMERA, "b": CAMERA, "c": CAMERA, **extra})


def test_skew_next_to_named_cameras_applies_or_is_refused(tmp_path: Path) -> None:
    focals = {"fx": 400.0, "fy": 401.0, "cx": 320.0, "cy": 240.0, "img_size": [640, 480]}
    cameras = read(tmp_path, {"skew": 2.5, "a": focals, "b": focals})
    assert [camera.K[0, 1] for camera in cameras.values()] == [2.5, 2.5]
    # K[0, 1] is 0 in this file.
    with raises(FormatError, code="syntax", mentions=["skew"]):
        read(tmp_path, {"skew": 2.5, "a": {"K": K, "img_size": [640, 480]}})


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("P", [[400.0, 0, 320, 0.5], [0, 401, 240, 0], [0, 0, 1, 0]]),
        ("depth_range", [0.1, 10.5, 0.0, 1.0]),
        ("bounding_box", [0.5, 1.5, 2.5, 3.5]),
        ("quaternion", [0.1, 0.2, 0.3, 0.927]),
        ("position", [0.1, 0.2, 0.3, 1.5]),
        ("sensor_mm", [36.5, 24.5, 1.5, 1.5]),
        ("gps", [47.5, 8.5, 400.5, 0.5]),
        ("workspace", [-0.5, 0.5, -0.3, 0.3]),
        ("gyro_bias", [0.01, 0.02, 0.03, 0.04]),
    ],
)
def test_unrelated_numbers_are_not_read_as_distortion(tmp_path: Path, key: str, value: Any) -> None:
    cameras = read(tmp_path, {"K": K, "img_size": [640, 480], key: value})
    assert len(cameras) == 1


def test_image_size_with_exchanged_sides_is_refused(tmp_path: Path) -> None:
    with raises(FormatError, code="syntax", mentions=["a.json:1", "img_size"]):
        read(tmp_path, {"K": [[682, 0, 625], [0, 714, 478], [0, 0, 1]], "img_size": [720, 1280]})


@pytest.mark.parametrize("key", ["calibration_type", "method", "lens_distortion_model", "opencv_model"])
def test_fisheye_under_another_key_than_a_model_is_read(tmp_path: Path, key: str) -> None:
    for content in (
        {**CAMERA, key: "cv2.fisheye"},
        {key: "fisheye", "a": {"b": {"left": CAMERA, "right": CAMERA}}},
    ):
        for camera in read(tmp_path, content).values():
            check_fisheye(camera)


@pytest.mark.parametrize(
    "lens",
    [
        {"model": "fisheye", "D": D},
        {"type": "fisheye", "coefficients": D},
        {"model": "equidistant", "parameters": D},
        {"model": "fisheye", **dict(zip(["k1", "k2", "k3", "k4"], D, strict=True))},
    ],
)
def test_lens_model_next_to_its_coefficients_is_read(tmp_path: Path, lens: dict[str, Any]) -> None:
    content = {"camera_matrix": K, "distortion": lens, "width": 640, "height": 480}
    (camera,) = read(tmp_path, content).values()
    check_fisheye(camera)


@pytest.mark.parametrize("place", ["root", "metadata", "camera"])
def test_fisheye_flag_of_anipose_is_read_at_every_position(tmp_path: Path, place: str) -> None:
    mark = {place: "fisheye = true\n"}
    (tmp_path / "calibration.toml").write_text(
        f"{mark.get('root', '')}[cam_0]\nname = 'a'\nsize = [640, 480]\nmatrix = {K}\ndistortions = {D}\n"
        f"rotation = [0.0, 0.0, 0.0]\ntranslation = [0.0, 0.0, 0.0]\n{mark.get('camera', '')}"
        f"[metadata]\nerror = 0.1\n{mark.get('metadata', '')}"
    )
    (camera,) = raycam.load_cameras(tmp_path / "calibration.toml").values()
    check_fisheye(camera)


@pytest.mark.parametrize("word", ["None", "NONE", "no_distortion"])
def test_lens_model_none_in_any_spelling_gives_a_pinhole(tmp_path: Path, word: str) -> None:
    (camera,) = read(tmp_path, {"K": K, "img_size": [640, 480], "distortion_model": word}).values()
    assert camera.distortion is None


@pytest.mark.parametrize("cameras", ["one", "several"])
def test_model_type_in_the_root_is_not_read_as_camodocal(tmp_path: Path, cameras: str) -> None:
    camera = f"K: {K}\n  D: {D}\n  image_size: [640, 480]\n"
    text = "model_type: fisheye\n"
    text += camera.replace("  ", "") if cameras == "one" else f"left:\n  {camera}right:\n  {camera}"
    (tmp_path / "a.yaml").write_text(text)
    found = raycam.load_cameras(tmp_path / "a.yaml")
    assert len(found) == (1 if cameras == "one" else 2)
    for camera_found in found.values():
        check_fisheye(camera_found)


@pytest.mark.parametrize(
    ("name", "coefficients"),
    [
        ("opencv5", [0.1, 0.01, 0.001, 0.002, 0.003]),
        ("radtan4", [0.1, 0.01, 0.001, 0.002]),
        ("rational8", [0.1] * 8),
    ],
)
def test_lens_models_with_a_count_of_coefficients_are_read(
    tmp_path: Path, name: str, coefficients: list[float]
) -> None:
    camera = read(tmp_path, {"K": K, "img_size": [640, 480], "D": coefficients, "distortion_model": name})[
        "a"
    ]
    assert camera.model == "opencv"
    np.testing.assert_array_equal(camera.distortion, coefficients)
    with raises(FormatError, mentions=[name]):
        read(tmp_path, {"K": K, "img_size": [640, 480], "D": [*coefficients, 0.1], "distortion_model": name})


@pytest.mark.parametrize("word", ["undistorted", "rectified"])
def test_lens_model_of_rectified_images_gives_a_pinhole(tmp_path: Path, word: str) -> None:
    content = {"K": K, "img_size": [640, 480], "D": [0.0] * 5, "distortion_model": word}
    assert read(tmp_path, content)["a"].model == "pinhole"
    with raises(FormatError, mentions=[word, "0.1"]):
        read(tmp_path, {**content, "D": [0.1, 0, 0, 0, 0]})


@pytest.mark.parametrize("key", ["use_fisheye", "is_fisheye", "fisheye_lens"])
@pytest.mark.parametrize("value", [1, "yes", True])
def test_flag_of_a_fisheye_lens_is_read(tmp_path: Path, key: str, value: Any) -> None:
    check_fisheye(read(tmp_path, {**CAMERA, key: value})["a"])


@pytest.mark.parametrize("key", ["lens", "lens_model", "camera_model"])
@pytest.mark.parametrize(
    "lens",
    [
        {"type": "Fisheye (equidistant)", "coeffs": D},
        {"model": "fisheye", "params": D},
        {"type": "equidistant", **dict(zip(("k1", "k2", "k3", "k4"), D, strict=True))},
    ],
)
def test_map_under_a_key_of_the_lens_model_is_read(tmp_path: Path, key: str, lens: dict[str, Any]) -> None:
    check_fisheye(read(tmp_path, {"K": K, "img_size": [640, 480], key: lens})["a"])


def test_projection_of_a_camera_overrides_the_same_key_of_the_file(tmp_path: Path) -> None:
    cameras = {"a": {**CAMERA, "D": D}, "b": {**CAMERA, "camera_model": "pinhole"}}
    for camera in cameras.values():
        camera.pop("dist")
    cameras["b"]["D"] = [*D, 0.0]
    found = read(tmp_path, {"camera_model": "fisheye", **cameras})
    check_fisheye(found["a"])
    assert found["b"].model == "opencv"
    cameras["b"]["D"] = D  # k1 k2 p1 p2, or k1 k2 k3 k4
    with raises(FormatError, code="syntax", mentions=["b.D"]):
        read(tmp_path, {"camera_model": "fisheye", **cameras})


R = Rotation.from_rotvec([0.3, -1.0, 0.6]).as_matrix()
C = np.array([1.0, -2.0, 3.0])


def check_pose(camera: Any) -> None:
    np.testing.assert_allclose(camera.R, R, atol=1e-12)
    np.testing.assert_allclose(camera.C, C, atol=1e-12)


@pytest.mark.parametrize("end", ["wc", "c2w", "cam2world"])
@pytest.mark.parametrize("names", [("R", "t"), ("rot", "trans"), ("rotation", "position")])
def test_rotation_and_translation_with_a_stated_direction_are_read(
    tmp_path: Path, end: str, names: tuple[str, str]
) -> None:
    rotation, place = (f"{name}_{end}" for name in names)
    cameras = read(tmp_path, {**CAMERA, rotation: R.T.tolist(), place: C.tolist()}, model="opencv")
    check_pose(cameras["a"])
    assert not cameras.notices
    with raises(FormatError, code="syntax", mentions=[rotation]):
        read(tmp_path, {**CAMERA, rotation: R.T.tolist()}, model="opencv")


def test_rotation_and_translation_from_world_to_camera_are_read(tmp_path: Path) -> None:
    check_pose(read(tmp_path, {**CAMERA, "R_cw": R.tolist(), "t_cw": (-R @ C).tolist()}, model="opencv")["a"])


def test_extrinsic_rotation_and_translation_require_a_direction(tmp_path: Path) -> None:
    content = {**CAMERA, "camera_ext_R": R.T.ravel().tolist(), "camera_ext_t": C.tolist()}
    with raises(FormatError, code="missing_argument", mentions=["camera_ext_R"]):
        read(tmp_path, content, model="opencv")
    check_pose(read(tmp_path, content, model="opencv", direction="world_from_camera")["a"])


def test_centre_of_extrinsics_is_not_read_as_a_rotation(tmp_path: Path) -> None:
    cameras = read(tmp_path, {**CAMERA, "extrinsic_center": [0.1, 0.2, 0.3]}, model="opencv")
    assert has_notice(cameras.notices, "ignored_key", "extrinsic_center")


def test_quaternion_with_a_direction_but_without_an_order_is_refused(tmp_path: Path) -> None:
    with raises(FormatError, code="syntax", mentions=["q_wc"]):
        read(tmp_path, {**CAMERA, "q_wc": [0.5] * 4, "p_wc": [1, 2, 3]}, model="opencv")


@pytest.mark.parametrize("key", ["E", "F", "H"])
def test_transform_under_a_short_key_requires_a_direction(tmp_path: Path, key: str) -> None:
    pose = np.vstack([np.column_stack([R.T, C]), [0, 0, 0, 1]])
    with raises(FormatError, code="missing_argument"):
        read(tmp_path, {**CAMERA, key: pose.tolist()}, model="opencv")
    cameras = read(tmp_path, {**CAMERA, key: pose.tolist()}, model="opencv", direction="world_from_camera")
    check_pose(cameras["a"])


def test_centre_of_two_numbers_gives_a_notice(tmp_path: Path) -> None:
    pose = {"R": R.tolist(), "t": (-R @ C).tolist()}
    cameras = read(tmp_path, {**CAMERA, **pose, "camera_center": [1.0, 2.0]}, model="opencv")
    assert has_notice(cameras.notices, "ignored_key", "camera_center")


def test_centre_next_to_a_pose_is_compared_with_the_pose(tmp_path: Path) -> None:
    pose = {"R": R.tolist(), "t": (-R @ C).tolist()}
    cameras = read(tmp_path, {**CAMERA, **pose, "camera_center": C.tolist()}, model="opencv")
    check_pose(cameras["a"])
    assert not cameras.notices
    with raises(FormatError, code="syntax", mentions=["camera_center"]):
        read(tmp_path, {**CAMERA, **pose, "camera_center": (C + 0.1).tolist()}, model="opencv")


@pytest.mark.parametrize("word", ["ideal", "linear", "zero"])
def test_lens_model_without_distortion_gives_a_pinhole(tmp_path: Path, word: str) -> None:
    found = read(tmp_path, {"K": K, "D": [0.0] * 5, "img_size": [640, 480], "distortion_model": word})
    assert found["a"].model == "pinhole"
