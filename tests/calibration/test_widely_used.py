"""Formats of widely used data sets and programs.

The results are compared with each project's formulas in NumPy, SciPy and OpenCV.
"""

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
from support.camera_truth import check, four, intrinsics
from support.raises import has_notice, raises

R = Rotation.from_rotvec([0.4, -0.7, 0.2]).as_matrix()
C = np.array([0.3, -1.2, 2.5])
T = -R @ C
QX, QY, QZ, QW = Rotation.from_matrix(R).as_quat()
K = intrinsics(500.0, 501.0, 320.5, 240.5)
# Columns: x right, y down, z forward in axes with x forward, y right, z down.
NED = np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0.0]])


def load(path: Path, **arguments: Any) -> raycam.Cameras:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return raycam.load_cameras(path, **arguments)


def words(*values: Any) -> str:
    return " ".join(repr(float(value)) for value in np.ravel(np.concatenate([np.ravel(v) for v in values])))


def test_realestate10k_scales_its_intrinsics_by_the_size(tmp_path: Path) -> None:
    (tmp_path / "a.txt").write_text(
        "https://www.youtube.com/watch?v=abc\n"
        f"52553000 0.5 0.9 0.48 0.51 0 0 {words(np.column_stack([R, T]))}\n"
        f"52586000 0.5 0.9 0.48 0.51 0 0 {words(np.column_stack([R, T]))}\n"
    )
    cameras = load(tmp_path / "a.txt", size=(640, 360))
    check(cameras["52553000"], intrinsics(320.0, 324.0, 307.2, 183.6), R, C)
    assert cameras["52553000"].pixel_center == "half"
    assert cameras.times["52553000"] == pytest.approx(52.553)
    with raises(FormatError, code="missing_argument", mentions=["a.txt"]):
        load(tmp_path / "a.txt")


@pytest.mark.parametrize(
    ("name", "size"),
    [("pose_left.txt", (640, 480)), ("pose_right.txt", (640, 480)), ("pose_lcam_front.txt", (640, 640))],
)
def test_tartanair_poses_use_forward_right_down_axes(
    tmp_path: Path, name: str, size: tuple[int, int]
) -> None:
    world_from_ned = R.T @ np.linalg.inv(NED)
    quaternion = Rotation.from_matrix(world_from_ned).as_quat()
    (tmp_path / name).write_text(f"{words(C, quaternion)}\n{words(C, quaternion)}\n")
    cameras = load(tmp_path / name)
    assert len(cameras) == 2
    width, height = size
    check(cameras["000001"], intrinsics(320.0, 320.0, width / 2, height / 2), R, C)
    assert cameras["000000"].size == size


def test_cityscapes_places_the_camera_by_yaw_pitch_and_roll(tmp_path: Path) -> None:
    # The rotation sensor_T_ISO_8855 from the example for 3D boxes in cityscapesScripts.
    content = {
        "extrinsic": {
            "baseline": 0.209313,
            "pitch": 0.038,
            "roll": 0.0,
            "x": 1.7,
            "y": 0.1,
            "yaw": -0.0195,
            "z": 1.22,
        },
        "intrinsic": {"fx": 2262.52, "fy": 2265.30, "u0": 1096.98, "v0": 513.137},
    }
    (tmp_path / "a_camera.json").write_text(json.dumps(content))
    cameras = load(tmp_path / "a_camera.json")
    vehicle = Rotation.from_euler("ZYX", [-0.0195, 0.038, 0.0]).as_matrix()
    iso = np.array([[0.0, -1, 0], [0, 0, -1], [1, 0, 0]])
    expected = iso @ vehicle.T
    sensor = np.array(
        [[0.9990881, -0.0194847, -0.0379909], [0.0194988, 0.9998099, 0.0], [0.0379836, -0.0007408, 0.9992781]]
    )
    np.testing.assert_allclose(expected, iso @ sensor, atol=2e-4)
    check(
        cameras["left"], intrinsics(2262.52, 2265.30, 1096.98, 513.137), expected, np.array([1.7, 0.1, 1.22])
    )
    assert cameras["left"].size == (2048, 1024)
    assert (cameras["right"].C - cameras["left"].C) @ cameras["left"].R[0] == pytest.approx(0.209313)


@pytest.mark.parametrize("fisheye", [False, True])
def test_rotation_vectors_of_anipose_are_read(tmp_path: Path, fisheye: bool) -> None:
    rvec, _ = cv2.Rodrigues(R)
    d = [0.05, -0.02, 0.001, -0.002] if fisheye else [0.05, -0.02, 0.001, -0.002, 0.0]
    (tmp_path / "calibration.toml").write_text(
        f'[cam_0]\nname = "A"\nsize = [ 640.0, 480.0,]\nmatrix = {K.tolist()}\ndistortions = {d}\n'
        f"rotation = {rvec.ravel().tolist()}\ntranslation = {T.tolist()}\nfisheye = {str(fisheye).lower()}\n\n"
        "[metadata]\nadjusted = false\nerror = 0.5\n"
    )
    (camera,) = load(tmp_path / "calibration.toml").values()
    points = np.random.default_rng(3).uniform([-0.4, -0.4, 1], [0.4, 0.4, 2], (20, 3)) @ R + C
    if fisheye:
        expected, _ = cv2.fisheye.projectPoints(points[:, None], rvec, T, K, np.array(d))
    else:
        expected, _ = cv2.projectPoints(points, rvec, T, K, np.array(d))
    np.testing.assert_allclose(camera.project(points)[0], expected[:, 0], atol=1e-6)
    assert camera.size == (640, 480)


def test_kapture_composes_rigs_and_trajectories(tmp_path: Path) -> None:
    sensors = tmp_path / "sensors"
    sensors.mkdir()
    mount = Rotation.from_rotvec([0.1, 0.2, -0.3])
    offset = np.array([0.1, 0.0, -0.05])
    mx, my, mz, mw = mount.as_quat()
    (sensors / "sensors.txt").write_text(
        "# kapture format: 1.1\n# sensor_id, name, sensor_type, [sensor_params]+\n"
        "cam0, left, camera, OPENCV, 640, 480, 500, 501, 321, 241, 0.1, -0.05, 0.001, 0.002\n"
        "cam1, right, camera, SIMPLE_PINHOLE, 640, 480, 500, 320, 240\n"
    )
    (sensors / "rigs.txt").write_text(
        f"# kapture format: 1.1\n# rig_id, sensor_id\nrig0, cam1, {mw}, {mx}, {my}, {mz}, 0.1, 0.0, -0.05\n"
    )
    # kapture accepts quaternions of any length.
    first = ", ".join(repr(float(2.5 * value)) for value in (QW, QX, QY, QZ))
    (sensors / "trajectories.txt").write_text(
        f"# timestamp, device_id, qw, qx, qy, qz, tx, ty, tz\n0, cam0, {first}, {T[0]}, {T[1]}, {T[2]}\n"
        f"1, rig0, {QW}, {QX}, {QY}, {QZ}, {T[0]}, {T[1]}, {T[2]}\n"
    )
    (sensors / "records_camera.txt").write_text(
        "# timestamp, device_id, image_path\n0, cam0, a.jpg\n1, cam1, b.jpg\n"
    )
    for path in (tmp_path, *(sensors / f"{name}.txt" for name in ("sensors", "trajectories", "rigs"))):
        cameras = load(path)
        lens = np.array([0.1, -0.05, 0.001, 0.002])
        points = np.random.default_rng(3).uniform([-0.4, -0.4, 1], [0.4, 0.4, 2], (20, 3)) @ R + C
        expected, _ = cv2.projectPoints(points, R, T, intrinsics(500.0, 501.0, 321.0, 241.0), lens)
        np.testing.assert_allclose(cameras["a.jpg"].project(points)[0], expected[:, 0], atol=1e-6)
        second = mount.as_matrix() @ R
        check(
            cameras["b.jpg"],
            intrinsics(500.0, 500.0, 320.0, 240.0),
            second,
            -second.T @ (mount.as_matrix() @ T + offset),
        )
    (sensors / "records_camera.txt").write_text("# kapture format: 1.1\n# timestamp, device_id, image_path\n")
    assert list(load(tmp_path)) == ["cam0", "cam1"]
    (tmp_path / "points3d.txt").write_text("# kapture format: 1.1\n# X, Y, Z, R, G, B\n1, 2, 3, 4, 5, 6\n")
    with raises(raycam.FormatError, code="syntax", mentions=["points3d.txt", "sensors/sensors.txt"]):
        load(tmp_path / "points3d.txt")


def ncamera(distortion: str, parameters: list[float], indent: str = "") -> str:
    mount = four(R.T, C).ravel().tolist()
    return (
        "label: rig\ncameras:\n- camera:\n    label: cam0\n    image_height: 480\n    image_width: 640\n"
        "    type: pinhole\n    intrinsics:\n      cols: 1\n      rows: 4\n      data: [500, 501, 320.5, 240.5]\n"
        f"    distortion:\n      type: {distortion}\n      parameters:\n        cols: 1\n"
        f"        rows: {len(parameters)}\n        data: {parameters}\n"
        f"  T_B_C:\n    cols: 4\n    rows: 4\n    data: {mount}\n"
    )


@pytest.mark.parametrize("distortion", ["radial-tangential", "equidistant", "fisheye", "none"])
def test_ncamera_lenses_and_mounts_are_read(tmp_path: Path, distortion: str) -> None:
    d = {"fisheye": [0.9], "none": []}.get(distortion, [0.05, -0.02, 0.001, -0.002])
    (tmp_path / "calib.yaml").write_text(ncamera(distortion, d))
    cameras = load(tmp_path / "calib.yaml")
    (camera,) = cameras.values()
    points = np.random.default_rng(3).uniform([-0.4, -0.4, 1], [0.4, 0.4, 2], (20, 3)) @ R + C
    if distortion == "radial-tangential":
        expected = cv2.projectPoints(points, R, T, K, np.array(d))[0][:, 0]
    elif distortion == "equidistant":
        expected = cv2.fisheye.projectPoints(points[:, None], cv2.Rodrigues(R)[0], T, K, np.array(d))[0][:, 0]
    else:
        local = (points - C) @ R.T
        plane = local[:, :2] / local[:, 2:]
        if d:
            # Devernay and Faugeras: the distorted radius is atan(2 r tan(w / 2)) / w.
            r = np.linalg.norm(plane, axis=1, keepdims=True)
            plane = plane * np.arctan(2 * r * np.tan(d[0] / 2)) / d[0] / r
        expected = plane * [500, 501] + [320.5, 240.5]
    np.testing.assert_allclose(camera.project(points)[0], expected, atol=1e-6)
    assert len(cameras.rigs) == 1


def test_ov2slam_reads_both_cameras_with_their_mounts(tmp_path: Path) -> None:
    lines = [
        "%YAML:1.0",
        "---",
        "Camera.topic_left: /a",
        "Camera.model_left: fisheye",
        "Camera.model_right: pinhole",
    ]
    for side, end in (("left", "l"), ("right", "r")):
        lines += [f"Camera.{side}_nwidth: 640", f"Camera.{side}_nheight: 480"]
        values = {
            "fx": 500.0,
            "fy": 501.0,
            "cx": 320.5,
            "cy": 240.5,
            "k1": 0.05,
            "k2": -0.02,
            "p1": 0.001,
            "p2": -0.002,
        }
        lines += [f"Camera.{key}{end}: {value}" for key, value in values.items()]
    for i, matrix in enumerate([four(R.T, C), four(R.T, C + R.T @ [0.2, 0, 0])]):
        lines += [
            f"body_T_cam{i}: !!opencv-matrix",
            "   rows: 4",
            "   cols: 4",
            "   dt: d",
            f"   data: {matrix.ravel().tolist()}",
        ]
    (tmp_path / "a.yaml").write_text("\n".join(lines) + "\n")
    cameras = load(tmp_path / "a.yaml")
    points = np.random.default_rng(3).uniform([-0.4, -0.4, 1], [0.4, 0.4, 2], (20, 3)) @ R + C
    d = np.array([0.05, -0.02, 0.001, -0.002])
    expected = cv2.fisheye.projectPoints(points[:, None], cv2.Rodrigues(R)[0], T, K, d)[0][:, 0]
    np.testing.assert_allclose(cameras["left"].project(points)[0], expected, atol=1e-6)
    expected = cv2.projectPoints(points, R, T - [0.2, 0, 0], K, d)[0][:, 0]
    np.testing.assert_allclose(cameras["right"].project(points)[0], expected, atol=1e-6)
    assert len(cameras.rigs) == 1


@pytest.mark.parametrize("name", ["extrinsic.txt", "intrinsic.txt", "."])
def test_virtual_kitti_cameras_combine_extrinsic_and_intrinsic_files(tmp_path: Path, name: str) -> None:
    header = "frame cameraID r1,1 r1,2 r1,3 t1 r2,1 r2,2 r2,3 t2 r3,1 r3,2 r3,3 t3 0 0 0 1"
    rows = "\n".join(f"{frame} {camera} {words(four(R, T))}" for frame in range(2) for camera in range(2))
    (tmp_path / "extrinsic.txt").write_text(f"{header}\n{rows}\n")
    rows = "\n".join(f"{f} {c} 725.0087 725.0087 620.5 187" for f in range(2) for c in range(2))
    (tmp_path / "intrinsic.txt").write_text(f"frame cameraID K[0,0] K[1,1] K[0,2] K[1,2]\n{rows}\n")
    cameras = load(tmp_path / name)
    assert len(cameras) == 4
    check(cameras["Camera_1/00001"], intrinsics(725.0087, 725.0087, 620.5, 187.0), R, C)
    assert cameras["Camera_0/00000"].size == (1242, 375)


def test_scannetpp_iphone_uses_the_aligned_pose(tmp_path: Path) -> None:
    entry = {
        "timestamp": 1.5,
        "pose": np.eye(4).tolist(),
        "intrinsic": intrinsics(1435.2, 1435.2, 958.5, 722.1).tolist(),
        "aligned_pose": four(R.T, C).tolist(),
        "imu": {"rotate_rate": [0.1, 0.2, 0.3]},
    }
    (tmp_path / "pose_intrinsic_imu.json").write_text(
        json.dumps({"frame_000000": entry, "frame_000001": entry})
    )
    cameras = load(tmp_path / "pose_intrinsic_imu.json")
    check(cameras["frame_000001"], intrinsics(1435.2, 1435.2, 958.5, 722.1), R, C)
    assert cameras["frame_000000"].size == (1920, 1440)
    assert cameras.times["frame_000000"] == 1.5


def test_aria_trajectories_and_calibrations_use_the_same_device_frame(tmp_path: Path) -> None:
    header = (
        "graph_uid,tracking_timestamp_us,utc_timestamp_ns,tx_world_device,ty_world_device,tz_world_device,"
        "qx_world_device,qy_world_device,qz_world_device,qw_world_device,device_linear_velocity_x_device,"
        "gravity_x_world,quality_score,tx_ecef_device,qx_ecef_device"
    )
    row = f"ab-12,1500000,17,{','.join(words(C, [-QX, -QY, -QZ, QW]).split())},0.1,0,1.0,5,0.5"
    (tmp_path / "closed_loop_trajectory.csv").write_text(f"{header}\n{row}\n")
    camera = raycam.Camera(K, np.eye(3), np.zeros(3), (640, 480))
    (read,) = load(tmp_path / "closed_loop_trajectory.csv", intrinsics=camera).values()
    check(read, K, R, C)
    device = Rotation.from_rotvec([0.1, 0.5, -0.2])
    x, y, z, w = device.as_quat()
    content = {
        "tracking_timestamp_us": 1,
        "CameraCalibrations": [
            {
                "Label": "camera-rgb",
                "Projection": {
                    "Name": "FisheyeRadTanThinPrism",
                    "Params": [600.0, 700.0, 710.0] + [0.0] * 12,
                },
                "T_Device_Camera": {"Translation": [0.1, 0.2, 0.3], "UnitQuaternion": [w, [x, y, z]]},
            }
        ],
    }
    line = json.dumps(content)
    (tmp_path / "online_calibration.jsonl").write_text(f"{line}\n{line}\n")
    cameras = load(tmp_path / "online_calibration.jsonl", size=(1408, 1408))
    (rgb,) = cameras.values()
    np.testing.assert_allclose(rgb.R.T, device.as_matrix(), atol=1e-12)
    np.testing.assert_allclose(rgb.C, [0.1, 0.2, 0.3])
    # Without coefficients, the lens is an equidistant fisheye.
    point = rgb.R.T @ [np.tan(0.5), 0, 1] + rgb.C
    np.testing.assert_allclose(rgb.project(point)[0], [600 * 0.5 + 700, 710], atol=1e-9)
    assert len(cameras.rigs) == 1


UNREAD = {
    "BAL": (
        "problem.txt",
        "2 3 4\n0 0 -332.65 262.09\n1 0 -199.76 166.7\n0 1 -253.06 202.27\n1 2 58.1 271.2\n1.5e-02\n-1.2\n",
    ),
    "Qualisys": (
        "a.qca.txt",
        '<calibration created="x"><cameras><camera serial="1"><fov_video left="0"/></camera></cameras></'
        "calibration>",
    ),
    "Kubric": (
        "metadata.json",
        '{"camera": {"focal_length": 35, "sensor_width": 32, "positions": [], "quaternions": []}}',
    ),
    "SceneFlow": (
        "camera_data.txt",
        "Frame 1\nL 1.0 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1\nR 1.0 0 0 1 0 1 0 0 0 0 1 0 0 0 0 1\n",
    ),
    "EasyMocap": (
        "intri.yml",
        "%YAML:1.0\n"
        "---\n"
        "names:\n"
        '  - "01"\n'
        "K_01: !!opencv-matrix\n"
        "  rows: 3\n"
        "  cols: 3\n"
        "  dt: d\n"
        "  data: [500, 0, 320, 0, 500, 240, 0, 0, 1]\n",
    ),
    "OKVIS": (
        "okvis.yaml",
        "cameras:\n"
        "  - {T_SC: [1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1], image_dimension: [752, 480], focal_length: [45"
        "8, 457], principal_point: [367, 248]}\n",
    ),
    "hloc": (
        "queries.txt",
        "query/a.jpg SIMPLE_RADIAL 1600 1200 1469.2 800 600 -0.0353\n",
    ),
    "Pix4D": (
        "a.txt",
        "fileName imageWidth imageHeight \ncamera matrix K [3x3]\n",
    ),
    "DSEC": (
        "cam_to_cam.yaml",
        "intrinsics:\n"
        "  cam0:\n"
        "    camera_matrix: [500, 501, 320, 240]\n"
        "  camRect0:\n"
        "    camera_matrix: [500, 500, 320, 240]\n",
    ),
    "WoodScape": (
        "a.json",
        '{"intrinsic": {"aspect_ratio": 1, "cx_offset": 3.9, "poly_order": 4, "k1": 339.7}}',
    ),
    "Unity": (
        "captures_000.json",
        '{"captures": [{"sensor": {"camera_intrinsic": [[1.7, 0, 0], [0, 1.7, 0], [0, 0, 1]]}}]}',
    ),
    "InfiniTAM": (
        "calib.txt",
        "640 480\n504.26 503.87\n352.4 272.9\n\n640 480\n573.7 574.3\n346.4 249.0\n\n0.99 0.01 0.02 0.03\n",
    ),
    "iKalibr": (
        "ikalibr_param.yaml",
        "CalibParam:\n  EXTRI:\n    SO3_CmToBr: []\n  INTRI:\n    Camera: []\n",
    ),
    "FAST-LIVO": (
        "avia.yaml",
        "extrin_calib:\n  Rcl: [1, 0, 0, 0, 1, 0, 0, 0, 1]\n  Pcl: [0.1, 0.2, 0.3]\n",
    ),
    "DexYCB": (
        "836212060125_640x480.yml",
        "color:\n"
        "  fx: 614.8\n"
        "  fy: 614.9\n"
        "  ppx: 317.1\n"
        "  ppy: 245.1\n"
        "depth:\n"
        "  fx: 385.0\n"
        "  fy: 385.0\n"
        "  ppx: 320.0\n"
        "  ppy: 240.0\n",
    ),
    "DSO": (
        "camera.txt",
        "0.535719308086809 0.669566858850269 0.493248545285398 0.500408664348414 0.897966326944875\n"
        "1280 1024\n"
        "crop\n"
        "640 480\n",
    ),
    "RPC": (
        "a_RPC.TXT",
        "LINE_OFF: +005000.00 pixels\nSAMP_OFF: +005000.00 pixels\nLAT_OFF: +37.0 degrees\n",
    ),
}


@pytest.mark.parametrize("name", sorted(UNREAD))
def test_unsupported_formats_are_refused_with_a_remedy(tmp_path: Path, name: str) -> None:
    file, text = UNREAD[name]
    (tmp_path / file).write_text(text)
    with raises(FormatError, mentions=[name, file]):
        load(tmp_path / file)


def test_lens_models_of_mrcal_are_read(tmp_path: Path) -> None:
    rt = [*cv2.Rodrigues(R)[0].ravel().tolist(), *T.tolist()]
    for key in ("extrinsics", "rt_cam_ref"):
        (tmp_path / "a.cameramodel").write_text(
            "# generated on a day\n{\n    'lensmodel':  'LENSMODEL_OPENCV8',\n"
            "    # intrinsics are fx,fy,cx,cy,distortion0,distortion1,....\n"
            f"    'intrinsics': [ 500, 501, 320.5, 240.5, 0.05, -0.02, 0.001, -0.002, 0.003, 0.1, 0.02, 0.01,],\n"
            f"    '{key}': {rt},\n    'imagersize': [ 640, 480,],\n"
            "    'valid_intrinsics_region': [\n    [ 0, 0 ],\n    [ 639, 479 ],\n    ],\n    'icam_intrinsics': 0,\n"
            "    'optimization_inputs': b'P)h>@6aWAK2ms3fSzG`B00{s;2mk;8VQ_G4X>@6jDF6Tf!%z&E\\'QUNAY\"#@jT',\n}\n"
        )
        (camera,) = load(tmp_path / "a.cameramodel").values()
        points = np.random.default_rng(3).uniform([-0.4, -0.4, 1], [0.4, 0.4, 2], (20, 3)) @ R + C
        d = np.array([0.05, -0.02, 0.001, -0.002, 0.003, 0.1, 0.02, 0.01])
        expected = cv2.projectPoints(points, R, T, K, d)[0][:, 0]
        np.testing.assert_allclose(camera.project(points)[0], expected, atol=1e-6)
    splined = "LENSMODEL_SPLINED_STEREOGRAPHIC_order=3_Nx=30_Ny=20_fov_x_deg=170"
    (tmp_path / "a.cameramodel").write_text(
        f"{{ 'lensmodel': '{splined}', 'intrinsics': [1, 2, 3, 4, 5], 'imagersize': [640, 480] }}"
    )
    with raises(FormatError, code="unsupported_feature", mentions=["SPLINED_STEREOGRAPHIC"]):
        load(tmp_path / "a.cameramodel")


def test_dvr_intrinsics_are_read_in_units_of_half_the_image(tmp_path: Path) -> None:
    camera = np.eye(4)
    camera[:3, :3] = np.array([[2.1, 0, 0.02], [0, 2.2, -0.01], [0, 0, 1.0]])
    np.savez(tmp_path / "cameras.npz", world_mat_0=four(R, T), camera_mat_0=camera, scale_mat_0=np.eye(4))
    (read,) = load(tmp_path / "cameras.npz", size=(640, 480)).values()
    check(read, intrinsics(2.1 * 320, 2.2 * 240, 320 * 1.02, 240 * 0.99), R, C)
    assert read.pixel_center == "half"


@pytest.mark.parametrize("scale", [1.0, 0.01])
def test_camera_matrices_are_checked_for_plausibility(tmp_path: Path, scale: float) -> None:
    P = intrinsics(500 * scale, 500 * scale, 320 * scale, 2000 * scale) @ np.column_stack([R, T])
    np.savez(tmp_path / "cameras_sphere.npz", world_mat_0=np.vstack([P, np.array([0, 0, 0, 1.0])]))
    (tmp_path / "calib.txt").write_text(f"P0: {words(P)}\nP1: {words(P)}\n")
    for name in ("cameras_sphere.npz", "calib.txt"):
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            raycam.load_cameras(tmp_path / name, size=(640, 480))
        notices = [warning.message for warning in caught]
        # The notice contains the principal point's row (2000) or the focal length (5.0).
        value = "2000" if scale == 1.0 else "5.0"
        assert has_notice(notices, "implausible", value), name


def test_single_cameras_of_a_folder_keep_their_mounts(tmp_path: Path) -> None:
    for i in range(2):
        mount = four(R.T, C + R.T @ [0.3 * i, 0, 0]).ravel().tolist()
        (tmp_path / f"cam{i}_kannala.yaml").write_text(
            "%YAML:1.0\n---\nmodel_type: KANNALA_BRANDT\ncamera_name: c\nimage_width: 640\nimage_height: 480\n"
            "projection_parameters:\n  k2: 0.01\n  k3: 0.0\n  k4: 0.0\n  k5: 0.0\n  mu: 500\n  mv: 501\n"
            "  u0: 320\n  v0: 240\n"
            f"body_T_cam{i}: !!opencv-matrix\n  rows: 4\n  cols: 4\n  dt: d\n  data: {mount}\n"
        )
    cameras = load(tmp_path)
    (rig,) = cameras.rigs.values()
    first, second = rig.values()
    assert np.linalg.norm(first.C - second.C) == pytest.approx(0.3)


def matrix_text(k: np.ndarray, first: str = "") -> str:
    P = 0.37 * k @ np.column_stack([R, T])
    return first + "\n".join(" ".join(repr(float(value)) for value in row) for row in P) + "\n"


def check_matrix(camera: raycam.Camera) -> None:
    P = 0.37 * K @ np.column_stack([R, T])
    k, rotation, centre = cv2.decomposeProjectionMatrix(P)[:3]
    np.testing.assert_allclose(camera.K, k / k[2, 2], atol=1e-6)
    np.testing.assert_allclose(camera.R, rotation, atol=1e-9)
    np.testing.assert_allclose(camera.C, (centre[:3] / centre[3]).ravel(), atol=1e-9)


def test_camera_matrices_of_pmvs_and_dtu_are_read(tmp_path: Path) -> None:
    (tmp_path / "txt").mkdir()
    for i in range(70):
        (tmp_path / "txt" / f"{i:08}.txt").write_text(matrix_text(K, "CONTOUR\n"))
    (tmp_path / "pos_001.txt").write_text(matrix_text(K))
    np.save(tmp_path / "P.npy", np.stack([0.37 * K @ np.column_stack([R, T])] * 3))
    for name, count in (("", 70), ("txt", 70), ("txt/00000003.txt", 1), ("pos_001.txt", 1), ("P.npy", 3)):
        cameras = load(tmp_path / name, size=(640, 480))
        assert len(cameras) == count
        check_matrix(next(iter(cameras.values())))


def test_camera_matrix_without_a_size_is_read(tmp_path: Path) -> None:
    P = K @ np.column_stack([R, T])
    (tmp_path / "a.json").write_text(json.dumps({"P": P.tolist()}))
    camera = raycam.load_cameras(tmp_path / "a.json", size=(640, 480))["a"]
    np.testing.assert_allclose(camera.P / camera.P[2, 2], P / P[2, 2], rtol=1e-9)


def test_neus_without_intrinsics_is_refused(tmp_path: Path) -> None:
    np.savez(tmp_path / "cameras.npz", world_mat_0=np.vstack([np.column_stack([R, T]), [0, 0, 0, 1]]))
    with raises(FormatError, code="syntax", mentions=["cameras.npz", "camera_mat_0"]):
        load(tmp_path / "cameras.npz", size=(640, 480))


@pytest.mark.parametrize("mark", ["b", "u", ""])
def test_lens_model_of_mrcal_may_be_a_byte_string(tmp_path: Path, mark: str) -> None:
    (tmp_path / "a.cameramodel").write_text(
        f"{{'lensmodel': {mark}'LENSMODEL_OPENCV4', 'intrinsics': [500, 501, 320, 240, 0.1, 0.02, 0.001, 0.002], "
        "'imagersize': [640, 480], 'rt_cam_ref': [0, 0, 0, 1, 2, 3], 'optimization_inputs': b'a\\'b\\\\'}\n"
    )
    (camera,) = load(tmp_path / "a.cameramodel").values()
    assert camera.distortion is not None
    np.testing.assert_allclose(camera.distortion, [0.1, 0.02, 0.001, 0.002])


SHOT = {"camera": "c", "rotation": [10, 20, 30], "translation": [0, 0, 0]}
LENS = {"projection_type": "perspective", "width": 640, "height": 480, "focal": 0.9, "k1": 0, "k2": 0}


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("reconstruction.json", json.dumps([{"cameras": {"c": LENS}, "shots": {"a": SHOT}}])),
        ("lowres_wide.traj", "1.0 10 20 30 0 0 0\n2.0 10 20 30 0 0 0\n"),
        ("SN1.conf", "".join(f"[{side}_CAM_HD]\nfx=700\nfy=700\ncx=640\ncy=360\n" for side in ("LEFT", "RIGHT"))
         + "[STEREO]\nBaseline=120\nRX_HD=10\nCV_HD=20\nRZ_HD=30\n"),
    ],
)  # fmt: skip
def test_rotation_vectors_in_degrees_are_refused_in_every_format(
    tmp_path: Path, name: str, text: str
) -> None:
    (tmp_path / name).write_text(text)
    with raises(FormatError, code="syntax", mentions=[name, "2 pi"]):
        load(tmp_path / name)


CAMODOCAL = """%YAML:1.0
---
model_type: PINHOLE
camera_name: camera
image_width: 640
image_height: 480
distortion_parameters: {k1: 0.1, k2: 0.02, p1: 0.001, p2: 0.002}
projection_parameters: {fx: 500, fy: 501, cx: 320, cy: 240}
"""


def test_folder_of_vins_is_read_by_its_settings(tmp_path: Path) -> None:
    mount = "%YAML:1.0\nimu: 1\nnum_of_cam: 2\n"
    for i, x in enumerate((0.0, 0.11)):
        (tmp_path / f"cam{i}.yaml").write_text(CAMODOCAL)
        mount += (
            f'cam{i}_calib: "cam{i}.yaml"\nbody_T_cam{i}: !!opencv-matrix\n  rows: 4\n  cols: 4\n  dt: d\n'
        )
        mount += f"  data: [1, 0, 0, {x}, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]\n"
    (tmp_path / "stereo.yaml").write_text(mount)
    first, second = load(tmp_path).values()
    np.testing.assert_allclose(second.C - first.C, [0.11, 0, 0])


def test_folders_of_single_cameras_are_read_with_their_poses(tmp_path: Path) -> None:
    for side, x in (("left", 0.0), ("right", -0.11)):
        (tmp_path / side).mkdir()
        camera = {"K": K.tolist(), "image_size": [640, 480], "R": np.eye(3).tolist(), "T": [x, 0, 0]}
        (tmp_path / side / "calib.json").write_text(json.dumps(camera))
    cameras = load(tmp_path)
    assert list(cameras) == ["left", "right"]
    np.testing.assert_allclose(cameras["right"].C, [0.11, 0, 0])


def test_pose_of_one_camera_of_a_pair_is_relative_to_the_other_camera(tmp_path: Path) -> None:
    camera = {"K": K.tolist(), "image_size": [640, 480]}
    (tmp_path / "left.json").write_text(json.dumps(camera))
    pose = {"R": np.eye(3).tolist(), "T": [-0.11, 0, 0]}
    (tmp_path / "right.json").write_text(json.dumps(camera | pose))
    cameras = load(tmp_path)
    np.testing.assert_allclose(cameras["right"].C - cameras["left"].C, [0.11, 0, 0])
    assert [notice.code for notice in cameras.notices] == ["assumed_convention"]
    assert len(cameras.rigs) == 1
