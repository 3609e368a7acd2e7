"""Unusual but common forms of calibrations.

Examples: camera names in keys, poses as maps, and intrinsics and poses in two files.
"""

from __future__ import annotations

import json
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raycam
import yaml
from raycam.errors import FormatError, Notice
from scipy.spatial.transform import Rotation
from support.camera_truth import Array, brown, check, equidistant, intrinsics, pose
from support.raises import raises

SIZE = (640, 480)
K = intrinsics(500.0, 501.0, 320.5, 240.5)
SECOND_K = intrinsics(510.0, 512.0, 318.5, 244.5)
COEFFICIENTS = [-0.1, 0.02, 0.001, -0.002]
R, C = pose(3)
ROTATION, CENTRE = np.eye(3), np.zeros(3)


def lens(x: Array) -> Array:
    return brown(x, (-0.1, 0.02), (0.001, -0.002))


def load(
    path: Path, text: str | dict[str, Any] | list[Any], **arguments: Any
) -> tuple[raycam.Cameras, list[str]]:
    """The cameras of a text, or of a document as JSON, and the notices' codes."""
    path.write_text(text if isinstance(text, str) else json.dumps(text))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", Notice)
        cameras = raycam.load_cameras(path, **arguments)
    return cameras, [notice.code for notice in cameras.notices]


def matrix4(rotation: Array, translation: Array) -> Array:
    return np.vstack([np.column_stack([rotation, translation]), [0, 0, 0, 1]])


def quaternion(rotation: Array) -> dict[str, float]:
    return dict(zip("xyzw", Rotation.from_matrix(rotation).as_quat().tolist(), strict=True))


@pytest.mark.parametrize(
    ("first", "second"),
    [
        (("K_event", "dist_event"), ("K_ir", "dist_ir")),
        (("DVS_intrinsics", "DVS_distortion"), ("IR_intrinsics", "IR_distortion")),
        (("cameraMatrixTop", "distCoeffsTop"), ("cameraMatrixBottom", "distCoeffsBottom")),
        (("camera_matrix_7", "camera_distortion_7"), ("camera_matrix_12", "camera_distortion_12")),
    ],
)
def test_keys_with_the_names_of_two_cameras_are_a_pair(
    tmp_path: Path, first: tuple[str, str], second: tuple[str, str]
) -> None:
    document = {
        first[0]: K.tolist(),
        first[1]: [*COEFFICIENTS, 0.0],
        second[0]: SECOND_K.tolist(),
        second[1]: [0.0] * 5,
        "R": R.tolist(),
        "T": (-R @ C).tolist(),
        "image_size": SIZE,
    }
    cameras, codes = load(tmp_path / "rig.json", document)
    assert len(cameras) == 2
    one, other = cameras.values()
    check(one, K, ROTATION, CENTRE, lens)
    check(other, SECOND_K, R, C)
    assert "assumed_convention" in codes
    assert len(cameras.rigs) == 1


def test_numbered_keys_of_three_cameras_are_three_cameras(tmp_path: Path) -> None:
    document: dict[str, Any] = {"image_width": 640, "image_height": 480}
    for i in range(3):
        rotation, centre = pose(i)
        document |= {
            f"camera_matrix_{i}": K.tolist(),
            f"camera_distortion_{i}": [*COEFFICIENTS, 0.0],
            f"camera_pose_{i}": matrix4(rotation.T, centre).tolist(),
        }
    with raises(FormatError, code="missing_argument", mentions=["camera_pose_0", "direction="]):
        load(tmp_path / "rig.json", document)
    cameras, _ = load(tmp_path / "rig.json", document, direction="world_from_camera")
    assert list(cameras) == ["camera0", "camera1", "camera2"]
    for i, camera in enumerate(cameras.values()):
        check(camera, K, *pose(i), lens)


def test_numbered_cameras_1_and_11_are_distinguished(tmp_path: Path) -> None:
    document: dict[str, Any] = {"size": SIZE}
    for i in (1, 11):
        document |= {
            f"K_{i}": (K + np.diag([i, i, 0])).tolist(),
            f"R_{i}": R.tolist(),
            f"T_{i}": [float(i), 0, 0],
        }
    cameras, _ = load(tmp_path / "rig.json", document)
    for i in (1, 11):
        check(cameras[f"camera{i}"], K + np.diag([i, i, 0]), R, -R.T @ [i, 0, 0])


def test_identity_rotation_is_not_read_as_a_camera_matrix(tmp_path: Path) -> None:
    document = {"K": K.tolist(), "rotation_matrix": np.eye(3).tolist(), "t": [0, 0, 1.0], "size": SIZE}
    cameras, _ = load(tmp_path / "one.json", document)
    check(cameras["one"], K, np.eye(3), np.array([0, 0, -1.0]))


@pytest.mark.parametrize("form", ["nested", "flat", "position"])
def test_pose_with_a_quaternion_table_requires_its_direction(tmp_path: Path, form: str) -> None:
    translation = dict(zip("xyz", (-R @ C).tolist(), strict=True))
    maps: dict[str, Any] = {
        "nested": {"transform": {"rotation": quaternion(R), "translation": translation}},
        "flat": {f"q{key}": value for key, value in quaternion(R).items()}
        | {f"t{key}": value for key, value in translation.items()},
        "position": {"orientation": quaternion(R), "position": list(translation.values())},
    }
    camera = {"intrinsic": {"K": K.ravel().tolist(), "D": [*COEFFICIENTS, 0.0]}, "extrinsic": maps[form]}
    path = tmp_path / "static_extrinsic_calibration.yaml"
    with raises(FormatError, code="missing_argument", mentions=["extrinsic", "direction="]):
        load(path, {"front": camera}, size=SIZE)
    cameras, _ = load(path, {"front": camera}, size=SIZE, direction="camera_from_world")
    check(cameras["front"], K, R, C, lens)


def test_pose_with_a_quaternion_table_and_direction_is_read(tmp_path: Path) -> None:
    world_from_camera = {
        "rotation": quaternion(R.T),
        "translation": dict(zip("xyz", C.tolist(), strict=True)),
    }
    cameras, _ = load(tmp_path / "a.json", {"K": K.tolist(), "size": SIZE, "cam2world": world_from_camera})
    check(cameras["a"], K, R, C)


def test_quaternion_with_a_length_other_than_1_is_refused(tmp_path: Path) -> None:
    transform = {"rotation": {"w": 0.9, "x": 0.9, "y": 0, "z": 0}, "translation": [0, 0, 0]}
    with raises(FormatError, code="syntax", mentions=["cam2world", 1.2728]):
        load(tmp_path / "a.json", {"K": K.tolist(), "size": SIZE, "cam2world": transform})


def test_transform_without_direction_next_to_a_mount_is_ignored(tmp_path: Path) -> None:
    document = {
        "T_BS": {"cols": 4, "rows": 4, "data": matrix4(R.T, C).ravel().tolist()},
        "resolution": SIZE,
        "intrinsics": [500, 501, 320.5, 240.5],
        "T_color_depth": {"cols": 4, "rows": 4, "data": np.eye(4).ravel().tolist()},
    }
    cameras, codes = load(tmp_path / "sensor.yaml", document)
    check(cameras["sensor"], K, R, C)
    assert codes == ["ignored_key"]


@pytest.mark.parametrize("width", [4, 3])
def test_intrinsics_in_the_corner_of_a_larger_matrix_are_read(tmp_path: Path, width: int) -> None:
    larger = np.eye(4)
    larger[:3, :3] = K
    document = {
        "000001.png": {
            "K": larger[: 4 if width == 4 else 3].ravel().tolist(),
            "W2C": matrix4(R, -R @ C).ravel().tolist(),
            "img_size": SIZE,
        }
    }
    cameras, _ = load(tmp_path / "cam_dict_norm.json", document)
    check(cameras["000001.png"], K, R, C)


def test_extrinsics_in_a_second_file_place_the_cameras(tmp_path: Path) -> None:
    poses = {f"cam{i}": pose(i) for i in range(3)}
    extrinsics = {name: {"R": r.tolist(), "T": (-r @ c).tolist()} for name, (r, c) in poses.items()}
    (tmp_path / "extrinsics.json").write_text(json.dumps(extrinsics))
    intrinsics_of = {name: {"K": K.tolist(), "dist": COEFFICIENTS, "size": SIZE} for name in poses}
    cameras, codes = load(tmp_path / "intrinsics.json", intrinsics_of)
    assert codes == ["used_other_file"]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", Notice)
        again = raycam.load_cameras(tmp_path / "extrinsics.json")
    for name, (r, c) in poses.items():
        check(cameras[name], K, r, c, lens)
        check(again[name], K, r, c, lens)


def test_parameters_below_a_camera_name_belong_to_that_camera(tmp_path: Path) -> None:
    matrix = {"rows": 3, "cols": 3, "type": 6, "continuous": True, "data": K.tolist()}
    coefficients = {"rows": 1, "cols": 5, "type": 6, "continuous": True, "data": [[*COEFFICIENTS, 0.0]]}
    parameters = {"img_dist_w": 640, "img_dist_h": 480, "cam_K": matrix, "cam_dist": coefficients}
    document = {"center_camera-intrinsic": {"sensor_name": "center_camera", "param": parameters}}
    cameras, _ = load(tmp_path / "center_camera-intrinsic.json", document)
    check(cameras["center_camera-intrinsic"], K, ROTATION, CENTRE, lens)
    assert cameras["center_camera-intrinsic"].size == SIZE


@pytest.mark.parametrize(
    "text",
    [
        "K: 500 0 320.5 0 501 240.5 0 0 1\ndist: -0.1 0.02 0.001 -0.002\nimage_size: 640 480\n",
        "K:\n [[500.  0.  320.5]\n [  0. 501. 240.5]\n [0 0 1]]\ndist:\n [-0.1 0.02 0.001 -0.002]\n"
        "image_size: 640 480\n",
    ],
    ids=["spaces", "NumPy's print"],
)
def test_numbers_separated_by_spaces_are_read(tmp_path: Path, text: str) -> None:
    cameras, _ = load(tmp_path / "calib.txt", text)
    check(cameras["calib"], K, ROTATION, CENTRE, lens)
    assert cameras["calib"].size == SIZE


def test_list_that_continues_left_of_its_key_is_read_as_by_pyyaml(tmp_path: Path) -> None:
    text = (
        "camera:\n    image_size: [640, 480]\n    camera_matrix:\n        rows: 3\n        cols: 3\n"
        "        data: [500.0, 0.0, 320.5, 0.0,\n    501.0, 240.5,\n0.0, 0.0, 1.0]  # of [pixels]\n"
        "    dist_coeffs: [-0.1, 0.02,\n  0.001, -0.002]\n"
    )
    expected = yaml.safe_load(text)["camera"]
    cameras, _ = load(tmp_path / "a.yaml", text)
    check(cameras["camera"], np.reshape(expected["camera_matrix"]["data"], (3, 3)), ROTATION, CENTRE, lens)


def test_coefficients_without_a_camera_matrix_raise_with_the_missing_key(tmp_path: Path) -> None:
    with raises(FormatError, code="syntax", mentions=["camera_matrix", "distortion_coefficients"]):
        load(
            tmp_path / "a.yaml",
            "%YAML:1.0\ndistortion_coefficients: [0.1, 0.2, 0.0, 0.0]\nresolution: [640, 480]\n",
        )


@pytest.mark.parametrize(
    ("row", "shown"),
    [([0, 0, 0, 0], "0 0 0 0"), ([0, 0, 0, 0.5], "0 0 0 0.5"), ([1, 2, 3, 1], "1 2 3 1")],
)
def test_invalid_last_row_of_a_pose_is_reported(tmp_path: Path, row: list[float], shown: str) -> None:
    matrix = matrix4(R, C)
    matrix[3] = row
    document = {
        "w": 640,
        "h": 480,
        "fl_x": 500.0,
        "frames": [{"file_path": "a.png", "transform_matrix": matrix.tolist()}],
    }
    with raises(FormatError, code="invalid_matrix", mentions=["transform_matrix", shown]):
        load(tmp_path / "transforms.json", document)


@pytest.mark.parametrize("count", [4, 8, 9])
def test_intrinsics_on_one_line_include_the_lens_as_in_droid_slam(tmp_path: Path, count: int) -> None:
    values = [500.0, 501.0, 320.5, 240.5, *COEFFICIENTS, 0.0][:count]
    cameras, _ = load(tmp_path / "euroc.txt", " ".join(map(str, values)) + "\n", size=SIZE)
    check(cameras["euroc"], K, ROTATION, CENTRE, None if count == 4 else lens)


def test_trajectory_with_one_line_is_read_as_a_pose(tmp_path: Path) -> None:
    numbers = [3.5, *C, *Rotation.from_matrix(R.T).as_quat()]
    cameras, _ = load(
        tmp_path / "a.txt",
        " ".join(map(str, numbers)),
        intrinsics=raycam.Camera(K, np.eye(3), [0, 0, 0], SIZE),
    )
    check(cameras["3.5"], K, R, C)


def test_poses_at_equal_times_are_both_kept(tmp_path: Path) -> None:
    rows = "".join(
        f"{time} {x} 0 0 0 0 0 1\n" for time, x in [(1.0, 0.1), (2.0, 0.2), (2.0, 0.3), (2.0, 0.4)]
    )
    cameras, codes = load(
        tmp_path / "groundtruth.txt", rows, intrinsics=raycam.Camera(K, np.eye(3), [0, 0, 0], SIZE)
    )
    assert {name: camera.C[0] for name, camera in cameras.items()} == {
        "1.0": 0.1,
        "2.0": 0.2,
        "2.0#2": 0.3,
        "2.0#3": 0.4,
    }
    assert list(cameras.times.values()) == [1.0, 2.0, 2.0, 2.0]
    assert codes == ["renamed"]


@pytest.mark.parametrize("time", ["1403636580863555584.0", "1.4036365808e+15", "1403636580863"])
def test_times_in_other_units_than_seconds_give_a_notice(tmp_path: Path, time: str) -> None:
    cameras, codes = load(
        tmp_path / "a.txt", f"{time} 0 0 0 0 0 0 1\n", intrinsics=raycam.Camera(K, np.eye(3), [0, 0, 0], SIZE)
    )
    assert codes == ["implausible"]
    assert next(iter(cameras.times.values())) == float(time)


def test_flat_keys_of_vikit_are_read_with_lens_and_mount(tmp_path: Path) -> None:
    x, y, z, w = Rotation.from_matrix(R).as_quat()
    tx, ty, tz = -R @ C
    text = (
        "cam0:\n  cam_model: PinholeRadialTangential\n  cam_width: 640\n  cam_height: 480\n  cam_fx: 500.0\n"
        "  cam_fy: 501.0\n  cam_cx: 320.5\n  cam_cy: 240.5\n  cam_d0: -0.1\n  cam_d1: 0.02\n  cam_d2: 0.001\n"
        f"  cam_d3: -0.002\n  T_cam_body: {{tx: {tx}, ty: {ty}, tz: {tz}, qx: {x}, qy: {y}, qz: {z}, qw: {w}}}\n"
    )
    cameras, codes = load(tmp_path / "calib.yaml", text)
    check(cameras["cam0"], K, R, C, lens)
    assert codes == ["placed_cameras"]


def test_fisheye_coefficients_of_fast_livo_are_read(tmp_path: Path) -> None:
    text = (
        "cam_model: EquidistantCamera\ncam_width: 640\ncam_height: 480\nscale: 1.0\ncam_fx: 500.0\ncam_fy: 501.0\n"
        "cam_cx: 320.5\ncam_cy: 240.5\nk1: -0.03\nk2: 0.002\nk3: 0.0\nk4: 0.0\n"
    )

    def fisheye(x: Array) -> Array:
        angle = np.linalg.norm(equidistant(x), axis=1, keepdims=True)
        return equidistant(x) * (1 - 0.03 * angle**2 + 0.002 * angle**4)

    cameras, codes = load(tmp_path / "camera.yaml", text)
    check(cameras["camera"], K, ROTATION, CENTRE, fisheye)
    assert not codes


def test_mount_of_svo_may_have_an_empty_last_row(tmp_path: Path) -> None:
    rows = matrix4(R.T, C)
    rows[3] = 0.0
    text = (
        "cameras:\n- camera:\n    image_height: 480\n    image_width: 640\n    type: pinhole\n    label: cam\n"
        "    intrinsics:\n      data: [500, 501, 320.5, 240.5]\n      rows: 4\n      cols: 1\n"
        f"  T_B_C:\n    cols: 4\n    rows: 4\n    data: {rows.ravel().tolist()}\n"
    )
    cameras, codes = load(tmp_path / "calib.yaml", text)
    check(cameras["cam"], K, R, C)
    assert "repaired_rotation" in codes


def test_lens_next_to_a_camera_matrix_p_is_refused(tmp_path: Path) -> None:
    rows = " ".join(map(str, np.column_stack([K, [0, 0, 0]]).ravel()))
    with raises(FormatError, code="syntax", mentions=["D", 2]):
        load(tmp_path / "calib.txt", f"P2: {rows}\nD: -0.1 0.02 0 0\nTr: 1 0 0 0 0 1 0 0 0 0 1 0\n")


@pytest.mark.parametrize(
    ("text", "mentions"),
    [
        ("0 0 0 0 0 0 1\n1 0 0 0 0 0 1\n", ["tartanair"]),
        ('{"pol": [161.1, 0, -0.002], "invpol": [246.6, -144.4], "xc": 321.3, "yc": 236.2}', ["OCamCalib"]),
        (
            "%YAML:1.0\nT_BS: 1\nintrinsics: []\ncamera_model: omni\ndistortion_coefficients: [875.0, 0.0, -0.0003]\n"
            "omni_pol_inv: [0.0, 0.0]\nomni_affine: [0.0, 0.0, 1.0]\n",
            ["OCamCalib"],
        ),
        (
            '{"extrinsics": {}, "intrinsics_w_distortion": {"f": [1, 1], "k": [0, 0, 0]}}',
            ["CHI3D", "camera_center"],
        ),
        ('{"0": {"campos": {}, "camrot": {}, "focal": {}, "princpt": {}}}', ["InterHand2.6M", "millimetres"]),
        ("m_colorWidth = 640\nm_calibrationColorIntrinsic = 1 0 0 0\n", ["BundleFusion"]),
        (
            "dataset matterport\nn_images 1\n\nintrinsics_matrix 1 0 1 0 1 1 0 0 1\n",
            ["Matterport3D", "opengl"],
        ),
        ("cam_uid,tx_world_cam,qx_world_cam,intrinsics_0\na,0,0,1\n", ["Ego-Exo4D", "fisheye"]),
        ("Camera-system parameters:\n projection: [1 1 1 1] +- [0 0 0 0]\n", ["Kalibr", "camchain"]),
        ("400 400 500 511\n0 0 1 0\n1 0 0 0\n0 1 0 0\n0 0 0 1\n", ["RobotCar", "fx fy cx cy"]),
        ('{"rig": {"sensors": [{"name": "a:120fov", "nominalSensor2Rig_FLU": {}}]}}', ["DRIVE", "f-theta"]),
    ],
)
def test_errors_of_recognised_formats_name_the_format(tmp_path: Path, text: str, mentions: list[str]) -> None:
    with raises(FormatError, code="unsupported_feature", mentions=mentions):
        load(tmp_path / "a.txt", text)


CAMERA = {"K": K.tolist(), "dist_coeffs": COEFFICIENTS, "image_size": SIZE}


@pytest.mark.parametrize("key", ["C", "camera_center", "center"])
def test_rotation_next_to_the_centre_is_camera_from_world(tmp_path: Path, key: str) -> None:
    cameras, _ = load(tmp_path / "a.json", {**CAMERA, "R": R.tolist(), key: C.tolist()})
    check(next(iter(cameras.values())), K, R, C, lens)


def test_rotation_next_to_a_position_requires_its_direction(tmp_path: Path) -> None:
    content = {**CAMERA, "rotation": R.T.tolist(), "position": C.tolist()}
    with raises(FormatError, code="syntax", mentions=["rotation", "direction="]):
        load(tmp_path / "a.json", content)
    cameras, _ = load(tmp_path / "a.json", content, direction="world_from_camera")
    check(next(iter(cameras.values())), K, R, C, lens)


@pytest.mark.parametrize(
    "pose",
    [
        {"position": [1, 2, 3]},
        {"quaternion": [0.5, 0.5, 0.5, 0.5], "translation": [1, 2, 3]},
        {"euler": [10, 20, 30], "T": [1, 2, 3]},
        {"roll": 10, "pitch": 20, "yaw": 30},
    ],
)
def test_pose_that_is_not_complete_is_refused(tmp_path: Path, pose: dict[str, Any]) -> None:
    with raises(FormatError, code="syntax", mentions=["a.json:1", next(iter(pose))]):
        load(tmp_path / "a.json", {**CAMERA, **pose})


def test_qvec_and_tvec_are_read_as_in_colmap(tmp_path: Path) -> None:
    x, y, z, w = Rotation.from_matrix(R).as_quat()
    cameras, _ = load(tmp_path / "a.json", {**CAMERA, "qvec": [w, x, y, z], "tvec": (-R @ C).tolist()})
    check(next(iter(cameras.values())), K, R, C, lens)


@pytest.mark.parametrize(
    ("key", "inverse"),
    [
        ("world_T_cam", True),
        ("cam_T_world", False),
        ("viewmat", False),
        ("T_cam_lidar", False),
        ("lidar_to_camera", False),
        ("Tr_velo_to_cam", False),
        ("cam2base", True),
        ("camera_from_imu", False),
        ("T_gripper_camera", True),
    ],
)
def test_key_of_a_transform_specifies_its_direction(tmp_path: Path, key: str, inverse: bool) -> None:
    matrix = matrix4(R, -R @ C)
    cameras, codes = load(
        tmp_path / "a.json", {**CAMERA, key: (np.linalg.inv(matrix) if inverse else matrix).tolist()}
    )
    check(next(iter(cameras.values())), K, R, C, lens)
    assert codes == ["assumed_convention"]


def test_notices_about_the_poses_of_several_cameras_are_grouped(tmp_path: Path) -> None:
    content = {"cameras": {name: {**CAMERA, "w2c": matrix4(R, -R @ C).tolist()} for name in "abcdef"}}
    cameras, codes = load(tmp_path / "a.json", content)
    assert (len(cameras), codes) == (6, ["assumed_convention"])


def test_nested_r_and_t_place_the_second_camera(tmp_path: Path) -> None:
    content = {"result": {"left": CAMERA, "right": CAMERA, "R": np.eye(3).tolist(), "T": [-0.1, 0, 0]}}
    cameras, _ = load(tmp_path / "a.json", content)
    np.testing.assert_allclose(cameras["right"].C, [0.1, 0, 0])


@pytest.mark.parametrize("mark", ["\ufeff", "// camera to world\n", "% pose\n", "# pose\r\n"])
def test_byte_order_marks_and_comments_before_a_matrix_are_skipped(tmp_path: Path, mark: str) -> None:
    text = mark + "\n".join(
        " ".join(f"{value:f}" for value in row) for row in np.linalg.inv(matrix4(R, -R @ C))
    )
    (tmp_path / "pose").mkdir()
    for name in ("0.txt", "pose/0.txt", "pose/1.txt"):
        (tmp_path / name).write_text(text, encoding="utf-8", newline="")
    for path in (tmp_path / "0.txt", tmp_path / "pose"):
        cameras = raycam.load_cameras(path, intrinsics=raycam.Camera(K, ROTATION, CENTRE, SIZE))
        np.testing.assert_allclose(next(iter(cameras.values())).C, C, atol=1e-5)


def test_parameter_file_of_ros_2_is_read_like_its_parameters(tmp_path: Path) -> None:
    parameters = {
        "cam_model": "Pinhole",
        "cam_width": 640,
        "cam_height": 480,
        "cam_fx": 500.0,
        "cam_fy": 501.0,
    }
    parameters |= {"cam_cx": 320.5, "cam_cy": 240.5} | {
        f"cam_d{i}": value for i, value in enumerate(COEFFICIENTS)
    }
    for node in (
        {"/**": {"ros__parameters": parameters}},
        {"/ns": {"node": {"ros__parameters": parameters}}},
    ):
        (tmp_path / "a.yaml").write_text(yaml.dump(node))
        cameras = raycam.load_cameras(tmp_path / "a.yaml")
        check(next(iter(cameras.values())), K, ROTATION, CENTRE, lens)


@pytest.mark.parametrize("key", ["noise", "white_balance", "per_view_errors", "weights"])
def test_numbers_under_keys_unrelated_to_lenses_are_not_read_as_distortion(tmp_path: Path, key: str) -> None:
    cameras, codes = load(tmp_path / "a.json", {"K": K.tolist(), "size": SIZE, key: [0.1, 0.2, 0.3, 0.4]})
    assert next(iter(cameras.values())).distortion is None
    assert codes == ["ignored_key"]


@pytest.mark.parametrize("ending", ["npz", "json"])
def test_stacked_arrays_of_cameras_are_read(tmp_path: Path, ending: str) -> None:
    # With three cameras, the arrays [3, 3] of a single K and [3, 3, 3] of three K have the same first side.
    poses = [pose(i) for i in range(3)]
    w2c = np.stack([matrix4(r, -r @ c) for r, c in poses])
    matrices = np.stack([K, SECOND_K, K])
    for k in (matrices, K):
        arrays = {"K": k, "w2c": w2c, "size": np.array(SIZE)}
        path = tmp_path / f"a.{ending}"
        if ending == "npz":
            np.savez(path, **arrays)
        else:
            path.write_text(json.dumps({key: value.tolist() for key, value in arrays.items()}))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", Notice)
            cameras = raycam.load_cameras(path)
        assert len(cameras) == 3
        for i, (camera, (r, c)) in enumerate(zip(cameras.values(), poses, strict=True)):
            check(camera, k if k.ndim == 2 else k[i], r, c)


@pytest.mark.parametrize("ending", ["npz", "json"])
def test_stacks_of_different_lengths_are_refused(tmp_path: Path, ending: str) -> None:
    arrays = {"K": np.stack([K] * 3), "w2c": np.stack([matrix4(*pose(i)) for i in range(4)])}
    path = tmp_path / f"a.{ending}"
    if ending == "npz":
        np.savez(path, **arrays)
    else:
        path.write_text(json.dumps({key: value.tolist() for key, value in arrays.items()}))
    with raises(FormatError, mentions=["w2c", 4, 3]):
        raycam.load_cameras(path, size=SIZE)


def test_stacked_rotations_and_coefficients_are_read(tmp_path: Path) -> None:
    poses = [pose(i) for i in range(4)]
    np.savez(
        tmp_path / "a.npz",
        K=np.stack([K] * 4),
        dist=np.array([[*COEFFICIENTS, 0.0]] * 4),
        R=np.stack([r for r, _ in poses]),
        t=np.stack([-r @ c for r, c in poses]),
        imsize=np.array([SIZE] * 4),
    )
    for camera, (r, c) in zip(raycam.load_cameras(tmp_path / "a.npz").values(), poses, strict=True):
        check(camera, K, r, c, lens)


def test_stacked_camera_matrices_are_read(tmp_path: Path) -> None:
    poses = [pose(i) for i in range(2)]
    np.savez(tmp_path / "a.npz", P=np.stack([K @ np.column_stack([r, -r @ c]) for r, c in poses]))
    cameras = raycam.load_cameras(tmp_path / "a.npz", size=SIZE)
    for camera, (r, c) in zip(cameras.values(), poses, strict=True):
        check(camera, K, r, c)


def test_matrix_p_without_k_is_camera_from_world(tmp_path: Path) -> None:
    given = raycam.Camera(K, ROTATION, CENTRE, SIZE)
    for document in ({}, {"comment": "normalised"}):
        document = {"P": np.column_stack([R, -R @ C]).tolist(), **document}
        cameras, codes = load(tmp_path / "a.json", document, intrinsics=given)
        (camera,) = cameras.values()
        check(camera, K, R, C)
        assert "assumed_convention" in codes


def test_folder_of_cameras_with_own_poses_is_read_whatever_their_names(tmp_path: Path) -> None:
    for i, name in enumerate(["front", "tailgate"]):
        r, c = pose(i)
        camera = {"K": K.tolist(), "img_size": SIZE, "T_base_cam": matrix4(r.T, c).tolist()}
        (tmp_path / f"{name}.json").write_text(json.dumps(camera))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", Notice)
        cameras = raycam.load_cameras(tmp_path)
    assert [*cameras] == ["front", "tailgate"]
    for i, camera in enumerate(cameras.values()):
        check(camera, K, *pose(i))
