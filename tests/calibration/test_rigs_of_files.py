"""Mounts, rigs, messages and folders, compared with pycolmap and closed forms."""

from __future__ import annotations

import json
import warnings
from pathlib import Path

import cv2
import numpy as np
import pycolmap
import pytest
import raycam
import yaml
from raycam.errors import FormatError
from support.raises import Fault, fault, has_notice, raises

EUROC = """%YAML:1.0
---
sensor_type: camera
T_BS:
  cols: 4
  rows: 4
  data: [0.0, -1.0, 0.0, 0.1, 1.0, 0.0, 0.0, -0.2, 0.0, 0.0, 1.0, 0.3, 0.0, 0.0, 0.0, 1.0]
resolution: [752, 480]
camera_model: pinhole
intrinsics: [458.0, 457.0, 367.0, 248.0]
distortion_model: radial-tangential
distortion_coefficients: [-0.28, 0.07, 0.0002, 0.00002]
"""
INFO = {
    "header": {"stamp": {"sec": 1, "nanosec": 5}, "frame_id": "cam"},
    "height": 480,
    "width": 640,
    "distortion_model": "plumb_bob",
    "d": [0.1, 0.0, 0.0, 0.0, 0.0],
    "k": [500.0, 0.0, 320.0, 0.0, 500.0, 240.0, 0.0, 0.0, 1.0],
    "r": [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
    "p": [500.0, 0.0, 320.0, 0.0, 0.0, 500.0, 240.0, 0.0, 0.0, 0.0, 1.0, 0.0],
    "binning_x": 0,
    "binning_y": 0,
}


def test_single_camera_with_a_mount_is_read_as_a_rig(tmp_path: Path) -> None:
    (tmp_path / "sensor.yaml").write_text(EUROC)
    cameras = raycam.load_cameras(tmp_path / "sensor.yaml")
    (rig,) = cameras.rigs.values()
    turn = cv2.Rodrigues(np.array([0.2, -0.1, 0.4]))[0]
    placed = rig.at_pose(turn.T, [5.0, 6.0, 7.0])["sensor"]
    np.testing.assert_allclose(placed.C, turn @ [0.1, -0.2, 0.3] + [5, 6, 7], atol=1e-12)
    (tmp_path / "body.tum").write_text("0.0 1 2 3 0 0 0 1\n")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        seen = raycam.load_cameras(tmp_path / "body.tum", intrinsics=cameras["sensor"])
    assert has_notice(seen.notices, "ignored_key", "T_BS", "--rig")


def test_raw_cameras_of_kitti_are_in_the_frame_of_the_rectified_cameras(tmp_path: Path) -> None:
    r_rect, r_1 = (cv2.Rodrigues(np.array(v))[0] for v in ([0.01, 0.02, -0.005], [-0.015, 0.004, 0.009]))
    t_1 = np.array([-0.537, 0.005, -0.012])
    k = np.array([[980.0, 0, 690], [0, 975.0, 245], [0, 0, 1]])
    rows = {
        "S_00": [1392, 512],
        "K_00": k,
        "D_00": np.zeros(5),
        "R_00": np.eye(3),
        "T_00": np.zeros(3),
        "R_rect_00": r_rect,
        "P_rect_00": np.hstack([k, np.zeros((3, 1))]),
        "S_01": [1392, 512],
        "K_01": k,
        "D_01": np.zeros(5),
        "R_01": r_1,
        "T_01": t_1,
    }
    text = "".join(
        f"{key}: {' '.join(repr(float(v)) for v in np.ravel(value))}\n" for key, value in rows.items()
    )
    (tmp_path / "calib_cam_to_cam.txt").write_text(text)
    cameras = raycam.load_cameras(tmp_path / "calib_cam_to_cam.txt", size=(1392, 512))
    point = np.array([1.0, 0.5, 12.0])  # a point in rectified camera axes
    raw = r_rect.T @ point
    for name, in_camera in (("00", raw), ("01", r_1 @ raw + t_1)):
        pixel = k @ in_camera
        np.testing.assert_allclose(cameras[name].project(point)[0], pixel[:2] / pixel[2], atol=1e-6)


def test_ros_camera_info_messages_are_read(tmp_path: Path) -> None:
    one = yaml.safe_dump(INFO)
    later = yaml.safe_dump({**INFO, "header": {"stamp": {"sec": 2, "nanosec": 0}, "frame_id": "cam"}})
    for text in (one, one + "---\n", one + "---\n" + later + "---\n"):
        (tmp_path / "info.yaml").write_text(text)
        (camera,) = raycam.load_cameras(tmp_path / "info.yaml").values()
        assert camera.K[0, 0] == 500
    (tmp_path / "info.yaml").write_text(one + "---\n" + yaml.safe_dump({**INFO, "width": 320}))
    with raises(FormatError, code="syntax", mentions=["info.yaml:100"]):
        raycam.load_cameras(tmp_path / "info.yaml")


def test_unused_keys_of_a_camchain_give_a_notice(tmp_path: Path) -> None:
    camera = {"camera_model": "pinhole", "intrinsics": [1.0, 1, 2, 3], "resolution": [4, 5]}
    step = np.eye(4)
    step[0, 3] = -0.3
    chain = {"T_cam1_cam0": step.tolist(), "cam0": camera, "cam1": {**camera, "T_cn_cnm1": step.tolist()}}
    (tmp_path / "camchain.yaml").write_text(yaml.safe_dump(json.loads(json.dumps(chain))))
    cameras = raycam.load_cameras(tmp_path / "camchain.yaml")
    np.testing.assert_allclose(cameras["cam1"].C, [0.3, 0, 0])
    assert has_notice(cameras.notices, "ignored_key", "T_cam1_cam0")


def test_blender_file_paths_are_written_without_extension(tmp_path: Path) -> None:
    k = [[500.0, 0, 320], [0, 500, 240], [0, 0, 1]]
    camera = raycam.Camera(k, np.eye(3), np.zeros(3), (640, 480), pixel_center="half")
    for format, expected in (("blender", "train/r_0"), ("nerf", "train/r_0.png")):
        raycam.save_cameras(tmp_path / "a.json", {"a": camera}, format, images={"a": "train/r_0.png"})
        assert json.loads((tmp_path / "a.json").read_text())["frames"][0]["file_path"] == expected


def test_image_names_with_spaces_in_binary_colmap_models_are_read(tmp_path: Path) -> None:
    camera = raycam.Camera([[500, 0, 320], [0, 500, 240], [0, 0, 1]], np.eye(3), np.zeros(3), (640, 480))
    raycam.save_cameras(tmp_path / "m", {"a": camera}, "colmap-binary", images={"a": "my image.jpg"})
    assert [image.name for image in pycolmap.Reconstruction(str(tmp_path / "m")).images.values()] == [
        "my image.jpg"
    ]
    assert raycam.load_cameras(tmp_path / "m").images == {"my image.jpg": "my image.jpg"}
    with raises(FormatError, code="cannot_write", mentions=['"a"']):
        raycam.save_cameras(tmp_path / "t", {"a": camera}, "colmap", images={"a": "my image.jpg"})


def test_colmap_rig_with_an_imu_and_a_camera_without_pose_is_read(tmp_path: Path) -> None:
    (tmp_path / "cameras.txt").write_text("1 PINHOLE 64 48 50 50 32 24\n2 PINHOLE 64 48 50 50 32 24\n")
    (tmp_path / "images.txt").write_text("1 1 0 0 0 0 0 0 1 a.png\n\n2 1 0 0 0 -1 0 0 2 b.png\n\n")
    (tmp_path / "rigs.txt").write_text("1 3 CAMERA 1 IMU 1 0 CAMERA 2 0\n")
    (tmp_path / "frames.txt").write_text("1 1 1 0 0 0 0 0 0 2 CAMERA 1 1 CAMERA 2 2\n")
    cameras = raycam.load_cameras(tmp_path)
    np.testing.assert_allclose([camera.C for camera in cameras.values()], [[0, 0, 0], [1, 0, 0]])


def test_calibrations_in_subfolders_are_found(tmp_path: Path) -> None:
    camera = raycam.Camera([[500, 0, 320], [0, 500, 240], [0, 0, 1]], np.eye(3), np.zeros(3), (640, 480))
    raycam.save_cameras(tmp_path / "project/sparse/0", {"a.png": camera}, "colmap")
    assert list(raycam.load_cameras(tmp_path / "project")) == ["a.png"]
    raycam.save_cameras(tmp_path / "project/transforms.json", {"b.png": camera}, "nerf")
    with raises(FormatError, code="unsupported_feature", mentions=["transforms.json"]):
        raycam.load_cameras(tmp_path / "project")


@pytest.mark.parametrize(
    ("text", "code", "name"),
    [
        ('<document version="2.0.0"><chunk label="a"/></document>', "syntax", "metashape"),
        ("%YAML:1.0\nCamera.fx: 500.0\nCamera.k1: 0.1\n", "missing_value", "orb-slam"),
        ("%YAML:1.0\n---\nmodel_type: MEI\nmirror_parameters:\n   xi: 2.2\n", "missing_value", "camodocal"),
        ('{"sfm_data_version": "0.3"}', "syntax", "openmvg"),
    ],
)
def test_errors_name_the_detected_format(tmp_path: Path, text: str, code: str, name: str) -> None:
    (tmp_path / "a").write_text(text)
    with raises(FormatError, code=code, mentions=[name]):
        raycam.load_cameras(tmp_path / "a")


def test_image_names_with_spaces_in_text_colmap_models_are_read(tmp_path: Path) -> None:
    # The image's name is the rest of the line; COLMAP's own programs read the name only up to the first space.
    (tmp_path / "cameras.txt").write_text("1 PINHOLE 640 480 500 500 320 240\n")
    names = ["my image.jpg", "sub folder/two  spaces.png", "d.JPG"]
    lines = [f"{i + 1} 1 0 0 0 0 0 {i} 1 {name}\n1 2 -1 3 4 5\n" for i, name in enumerate(names)]
    (tmp_path / "images.txt").write_text("# images\n" + "".join(lines))
    cameras = raycam.load_cameras(tmp_path)
    assert list(cameras) == names
    assert [camera.C[2] for camera in cameras.values()] == [0, -1, -2]
    (tmp_path / "images.txt").write_text("".join(line.split("\n")[0] + "\n" for line in lines))
    with raises(FormatError, code="syntax", mentions=["images.txt:2"]):
        raycam.load_cameras(tmp_path)


OST = """# oST version 5.0 parameters


[image]

width
640

; height in pixels
height
480

[narrow_stereo/left]

camera matrix
{k}

distortion
{d}

rectification
{r}

projection
{p}

"""


def ost(K: np.ndarray, d: list[float], R: np.ndarray, P: np.ndarray) -> str:
    def rows(matrix: np.ndarray) -> str:
        return "\n".join(" ".join(f"{value:.6f}" for value in row) for row in np.atleast_2d(matrix))

    return OST.format(k=rows(K), d=rows(np.array(d)), r=rows(R), p=rows(P))


def test_text_file_of_ros_camera_calibration_is_read(tmp_path: Path) -> None:
    K = np.array([[369.344588, 0, 320.739078], [0, 367.15433, 203.59245], [0, 0, 1]])
    d = [0.189544, -0.018229, -0.00063, 0.000054, -0.000212]
    points = np.random.default_rng(3).uniform([-0.4, -0.3, 1], [0.4, 0.3, 3], (40, 3))
    seen = cv2.projectPoints(points, np.zeros(3), np.zeros(3), K, np.array(d))[0][:, 0]
    P = np.column_stack([K, np.zeros(3)])
    for name in ("ost.txt", "camera.ini"):
        (tmp_path / name).write_text(ost(K, d, np.eye(3), P))
        cameras = raycam.load_cameras(tmp_path / name)
        assert list(cameras) == ["narrow_stereo/left"]
        assert cameras["narrow_stereo/left"].size == (640, 480)
        np.testing.assert_allclose(cameras["narrow_stereo/left"].project(points)[0], seen, atol=1e-6)
    # Both cameras of a pair in one file: the baseline is in the second P.
    R = np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0.0]])
    left = ost(K, d, np.eye(3), P)
    P[0, 3] = -0.25 * P[0, 0]
    right = ost(K, [0.0] * 5, R, P).replace("/left", "/right")
    (tmp_path / "ost.txt").write_text(left + right)
    rig = raycam.load_cameras(tmp_path / "ost.txt").rigs["rig"]
    np.testing.assert_allclose(rig["left"].project(points)[0], seen, atol=1e-6)
    np.testing.assert_allclose(rig["right"].C, [0.25, 0, 0], atol=1e-12)
    np.testing.assert_allclose(rig["right"].R, R.T, atol=1e-12)
    (tmp_path / "pair").mkdir()
    for side, text in (("left", left), ("right", right)):
        (tmp_path / "pair" / f"{side}.ini").write_text(text)
    assert raycam.load_cameras(tmp_path / "pair").rigs["rig"] == rig


@pytest.mark.parametrize(
    ("old", "new", "reason"),
    [
        ("camera matrix\n5", "camera matrix\nfive 5", fault("syntax", "ost.txt:16")),
        ("distortion\n", "distortions\n", fault("syntax", "ost.txt:20", '"distortions"')),
        ("[image]", "[images]", fault("unsupported_feature", "ost.txt", '"NAME"')),
        ("width\n640", "width\n", fault("syntax", "image_width")),
        (
            "0.000000 0.000000 1.000000\n\ndistortion",
            "\ndistortion",
            fault("wrong_shape", "ost.txt:16", "camera_matrix"),
        ),
        ("[narrow_stereo/left]", "", fault("syntax", "ost.txt:15", '"camera matrix"')),
        ("# oST", "5 # oST", fault("syntax", "ost.txt:1")),
    ],
)
def test_damaged_text_file_of_ros_camera_calibration_raises(
    tmp_path: Path, old: str, new: str, reason: Fault
) -> None:
    K = np.array([[500.0, 0, 320], [0, 500, 240], [0, 0, 1]])
    text = ost(K, [0.1, 0, 0, 0, 0], np.eye(3), np.column_stack([K, np.zeros(3)]))
    assert old in text
    (tmp_path / "ost.txt").write_text(text.replace(old, new, 1))
    with raises(FormatError, **reason):
        raycam.load_cameras(tmp_path / "ost.txt")


@pytest.mark.parametrize("names", [("cam_a1", "cam_a2"), ("0", "1"), ("front", "back")])
def test_folder_of_files_with_k_and_c2w_keeps_k_and_size(tmp_path: Path, names: tuple[str, str]) -> None:
    for number, name in enumerate(names):
        c2w = np.eye(4)
        c2w[0, 3] = number
        camera = {
            "K": [[500 + number, 0, 320], [0, 500, 240], [0, 0, 1]],
            "img_size": [640, 480],
            "c2w": c2w.tolist(),
        }
        (tmp_path / f"{name}.json").write_text(json.dumps(camera))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        cameras = raycam.load_cameras(tmp_path)
    for number, name in enumerate(names):
        assert cameras[name].K[0, 0] == 500 + number
        np.testing.assert_allclose(cameras[name].C, [number, 0, 0])
