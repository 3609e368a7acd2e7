"""Settings of SLAM programs, compared with OpenCV."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
import raycam
from raycam.errors import FormatError
from scipy.spatial.transform import Rotation
from support.camera_truth import brown, check, equidistant, four, intrinsics, points, pose
from support.raises import Fault, fault, has_notice, raises

K = intrinsics(458.5, 457.25, 367.0, 248.5)
TERMS = {"k1": -0.28, "k2": 0.07, "p1": 0.0002, "p2": -0.00002}
ZERO = np.zeros(3)


def lens(x: Any) -> Any:
    return brown(x, (-0.28, 0.07), (0.0002, -0.00002))


def lens3(x: Any) -> Any:
    return brown(x, (-0.28, 0.07, 0.01), (0.0002, -0.00002))


def kb(x: Any) -> Any:
    theta = equidistant(x)
    return brown(theta, (0.02, -0.01, 0.004, -0.001))


def write(path: Path, keys: dict[str, Any], space: str = " ") -> Path:
    text = "%YAML:1.0\n# made up\n"
    for key, value in keys.items():
        if isinstance(value, np.ndarray):
            height, width = value.shape
            numbers = ", ".join(repr(float(v)) for v in value.ravel())
            text += (
                f"{key}: !!opencv-matrix\n  rows: {height}\n  cols: {width}\n  dt: f\n  data:[{numbers}]\n"
            )
        else:
            text += f"{key}:{space}{value}\n"
    path.write_text(text)
    return path


def focals(group: str) -> dict[str, Any]:
    return dict(
        zip(
            [f"{group}.{key}" for key in ("fx", "fy", "cx", "cy")], [458.5, 457.25, 367.0, 248.5], strict=True
        )
    )


def coefficients(group: str, **terms: float) -> dict[str, Any]:
    return {f"{group}.{key}": value for key, value in terms.items()}


SIZES = {"Camera.width": 752, "Camera.height": 480, "Camera.fps": 20, "Viewer.PointSize": 2}


@pytest.mark.parametrize("space", [" ", ""])
@pytest.mark.parametrize("k3", [0.0, 0.01])
def test_monocular_orbslam2_settings_are_read(tmp_path: Path, space: str, k3: float) -> None:
    keys = {**focals("Camera"), **coefficients("Camera", **TERMS), **SIZES}
    file = write(tmp_path / "a.yaml", {**keys, **({"Camera.k3": k3} if k3 else {})}, space)
    cameras = raycam.load_cameras(file)
    check(cameras["Camera"], K, np.eye(3), ZERO, lens3 if k3 else lens)


def test_settings_with_only_a_baseline_are_read_as_one_camera(tmp_path: Path) -> None:
    keys = {**focals("Camera"), **coefficients("Camera", **TERMS), "Camera.bf": 45.85}
    cameras = raycam.load_cameras(write(tmp_path / "a.yaml", keys), size=(752, 480))
    assert len(cameras) == 1
    assert has_notice(cameras.notices, "ignored_key", "0.1 m")


def test_kannala_brandt_is_read_as_a_fisheye(tmp_path: Path) -> None:
    keys = {"Camera.type": '"KannalaBrandt8"', **focals("Camera"), **SIZES}
    keys |= coefficients("Camera", k1=0.02, k2=-0.01, k3=0.004, k4=-0.001)
    check(raycam.load_cameras(write(tmp_path / "a.yaml", keys))["Camera"], K, np.eye(3), ZERO, kb)


@pytest.mark.parametrize("old", [True, False])
def test_stereo_orbslam3_settings_are_read_as_a_rig(tmp_path: Path, old: bool) -> None:
    R, C = pose(3)
    matrix = four(R.T, 0.1 * C)
    first = "Camera" if old else "Camera1"
    keys = {"File.version": '"1.0"', "Camera.type": '"KannalaBrandt8"', **SIZES}
    for group in (first, "Camera2"):
        keys |= {**focals(group), **coefficients(group, k1=0.02, k2=-0.01, k3=0.004, k4=-0.001)}
    keys |= {"Tlr": matrix[:3]} if old else {"Stereo.T_c1_c2": matrix}
    cameras = raycam.load_cameras(write(tmp_path / "a.yaml", keys))
    check(cameras["Camera2"], K, R, 0.1 * C, kb)
    assert list(cameras.rigs["rig"]) == [first, "Camera2"]


def test_rectified_orbslam_pairs_have_their_baseline(tmp_path: Path) -> None:
    keys = {
        "File.version": '"1.0"',
        "Camera.type": '"Rectified"',
        **focals("Camera1"),
        "Stereo.b": 0.11,
        **SIZES,
    }
    cameras = raycam.load_cameras(write(tmp_path / "a.yaml", keys))
    check(cameras["Camera2"], K, np.eye(3), np.array([0.11, 0, 0]))


def test_raw_stereo_pair_of_orbslam2_is_read(tmp_path: Path) -> None:
    keys: dict[str, Any] = {**focals("Camera"), "Camera.bf": 47.9}
    turns = {
        side: Rotation.from_euler("xyz", angles, degrees=True).as_matrix() for side, angles in TURNS.items()
    }
    for side, shift in (("LEFT", 0.0), ("RIGHT", -47.9)):
        keys |= {f"{side}.height": 480, f"{side}.width": 752, f"{side}.K": K, f"{side}.R": turns[side]}
        keys[f"{side}.D"] = np.array([[-0.28, 0.07, 0.0002, -0.00002, 0.0]])
        keys[f"{side}.P"] = np.array([[435.0, 0, 367, shift], [0, 435.0, 252, 0], [0, 0, 1, 0]])
    cameras = raycam.load_cameras(write(tmp_path / "a.yaml", keys))
    check(cameras["left"], K, turns["LEFT"].T, ZERO, lens)
    check(cameras["right"], K, turns["RIGHT"].T, np.array([47.9 / 435, 0, 0]), lens)


TURNS = {"LEFT": [1, 2, -1], "RIGHT": [-1, 1, 0.5]}


@pytest.mark.parametrize(
    ("keys", "reason"),
    [
        ({"Camera.type": '"Omni"'}, fault("syntax", "Omni")),
        (coefficients("Camera", k1=0.1, k4=0.2), fault("syntax", "k4")),
        (coefficients("Camera", k1=0.1, k5=0.2), fault("syntax", "k5")),
        ({"Camera.type": '"Rectified"', "Camera.k1": 0.1}, fault("syntax", "k1")),
        ({"Camera.type": '"KannalaBrandt8"', "Camera.p1": 0.1}, fault("syntax", "p1")),
        ({**focals("Camera2")}, fault("syntax", "T_c1_c2")),
    ],
)
def test_unsupported_lens_keys_of_orbslam_raise(tmp_path: Path, keys: dict[str, Any], reason: Fault) -> None:
    with raises(FormatError, **reason):
        raycam.load_cameras(write(tmp_path / "a.yaml", {**focals("Camera"), **SIZES, **keys}))


def camodocal(path: Path, kind: str, groups: dict[str, dict[str, float]], space: str = " ") -> Path:
    text = f"%YAML:1.0\n---\nmodel_type:{space}{kind}\ncamera_name:{space}front\nimage_width: 752\nimage_height: 480\n"
    for name, terms in groups.items():
        text += f"{name}_parameters:\n" + "".join(
            f"   {key}:{space}{value}\n" for key, value in terms.items()
        )
    path.write_text(text)
    return path


PROJECTION = {"fx": 458.5, "fy": 457.25, "cx": 367.0, "cy": 248.5}
OMNI = {"gamma1": 458.5, "gamma2": 457.25, "u0": 367.0, "v0": 248.5}
KANNALA = {
    "k2": 0.02,
    "k3": -0.01,
    "k4": 0.004,
    "k5": -0.001,
    "mu": 458.5,
    "mv": 457.25,
    "u0": 367.0,
    "v0": 248.5,
}


def rational(x: Any) -> Any:
    d = np.array([0.1, -0.02, 0.001, -0.002, 0.003, 0.05, 0.01, 0.002])
    return cv2.projectPoints(np.column_stack([x, np.ones(len(x))]), ZERO, ZERO, np.eye(3), d)[0][:, 0]


def mei(x: Any) -> Any:
    rays = np.column_stack([x, np.ones(len(x))])
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    return brown(rays[:, :2] / (rays[:, 2:] + 1.8), (-0.28, 0.07), (0.0002, -0.00002))


FULL = {"k1": 0.1, "k2": -0.02, "p1": 0.001, "p2": -0.002, "k3": 0.003, "k4": 0.05, "k5": 0.01, "k6": 0.002}
MODELS: dict[str, Any] = {
    "PINHOLE": ({"distortion": TERMS, "projection": PROJECTION}, lens),
    "PINHOLE_FULL": ({"distortion": FULL, "projection": PROJECTION}, rational),
    "MEI": ({"mirror": {"xi": 1.8}, "distortion": TERMS, "projection": OMNI}, mei),
    "KANNALA_BRANDT": ({"projection": KANNALA}, kb),
}


@pytest.mark.parametrize("kind", MODELS)
@pytest.mark.parametrize("space", [" ", ""])
def test_camodocal_cameras_are_read(tmp_path: Path, kind: str, space: str) -> None:
    groups, own = MODELS[kind]
    camera = raycam.load_cameras(camodocal(tmp_path / "a.yaml", kind, groups, space))["front"]
    check(camera, K, np.eye(3), ZERO, own)
    assert camera.size == (752, 480)


@pytest.mark.parametrize(
    ("kind", "groups", "reason"),
    [
        ("SCARAMUZZA", {"poly": {"p0": -200.0}}, fault("unsupported_feature", "SCARAMUZZA")),
        ("DOUBLE", {"projection": PROJECTION}, fault("unsupported_feature", "DOUBLE")),
        ("PINHOLE", {"distortion": {**TERMS, "k3": 0.1}, "projection": PROJECTION}, fault("syntax", "k3")),
        ("PINHOLE", {"distortion": {"k1": 0.1}, "projection": PROJECTION}, fault("missing_value", "k2")),
    ],
)
def test_unsupported_camodocal_models_are_refused_by_name(
    tmp_path: Path, kind: str, groups: Any, reason: Fault
) -> None:
    with raises(FormatError, **reason):
        raycam.load_cameras(camodocal(tmp_path / "a.yaml", kind, groups))


def test_vins_fusion_and_vins_mono_settings_are_read(tmp_path: Path) -> None:
    camodocal(tmp_path / "cam0.yaml", "PINHOLE", MODELS["PINHOLE"][0])
    camodocal(tmp_path / "cam1.yaml", "MEI", MODELS["MEI"][0])
    mounts = [four(pose(i)[0].T, pose(i)[1]) for i in range(2)]
    keys: dict[str, Any] = {"imu": 1, "num_of_cam": 2, "acc_n": 0.1, "cam0_calib": '"cam0.yaml"'}
    keys |= {"cam1_calib": '"cam1.yaml"', "body_T_cam0": mounts[0], "body_T_cam1": mounts[1]}
    cameras = raycam.load_cameras(write(tmp_path / "vins.yaml", keys))
    check(cameras["cam0"], K, *pose(0), lens)
    check(cameras["cam1"], K, *pose(1), mei)
    assert list(cameras.rigs["rig"]) == ["cam0", "cam1"]
    mono = camodocal(tmp_path / "mono.yaml", "PINHOLE", MODELS["PINHOLE"][0])
    more = write(
        tmp_path / "more.yaml",
        {"extrinsicRotation": pose(4)[0].T, "extrinsicTranslation": pose(4)[1][:, None]},
    )
    mono.write_text(mono.read_text() + more.read_text().split("\n", 2)[2])
    check(raycam.load_cameras(mono)["front"], K, *pose(4), lens)
    (tmp_path / "cam1.yaml").unlink()
    with raises(FormatError, code="syntax", mentions=["cam1"]):
        raycam.load_cameras(tmp_path / "vins.yaml")


@pytest.mark.parametrize("is_vins", [True, False])
def test_mask_flag_of_vins_is_not_read_as_a_lens(tmp_path: Path, is_vins: bool) -> None:
    file = camodocal(tmp_path / "a.yaml", "MEI", MODELS["MEI"][0])
    keys = {"extrinsicRotation": pose(4)[0].T, "extrinsicTranslation": pose(4)[1][:, None]} if is_vins else {}
    settings = write(tmp_path / "b.yaml", {"fisheye": 1, **keys})
    file.write_text(file.read_text() + settings.read_text().split("\n", 2)[2])
    cameras = raycam.load_cameras(file)
    check(cameras["front"], K, *(pose(4) if is_vins else (np.eye(3), np.zeros(3))), mei)
    assert has_notice(cameras.notices, "ignored_key")


@pytest.mark.parametrize(
    "settings",
    [
        "distortion_model: 0\ndistortion_per_camera: [0, 1]\nnumber_camera: 2\n",
        "fisheye_mask: 3\nExtrinsicMat: !!opencv-matrix\n  rows: 4\n  cols: 4\n  dt: d\n"
        "  data: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]\n",
    ],
)
def test_settings_without_a_camera_are_refused_with_this_reason(tmp_path: Path, settings: str) -> None:
    (tmp_path / "a.yaml").write_text(f"%YAML:1.0\n---\n{settings}")
    with raises(FormatError, code="syntax", mentions=["the file"]):
        raycam.load_cameras(tmp_path / "a.yaml")


def test_basalt_calibrations_are_read(tmp_path: Path) -> None:
    places = []
    for i in range(2):
        R, C = pose(i)
        names = ("px", "py", "pz", "qx", "qy", "qz", "qw")
        places.append(dict(zip(names, [*C, *Rotation.from_matrix(R.T).as_quat()], strict=True)))
    kinds = [
        {
            "camera_type": "kb4",
            "intrinsics": {**PROJECTION, "k1": 0.02, "k2": -0.01, "k3": 0.004, "k4": -0.001},
        }
    ]
    kinds.append({"camera_type": "pinhole-radtan8", "intrinsics": {**PROJECTION, **FULL, "rpmax": 2.7}})
    table = {"T_imu_cam": places, "intrinsics": kinds, "resolution": [[752, 480]] * 2, "vignette": []}
    file = tmp_path / "a.json"
    file.write_text(json.dumps({"value0": table}))
    cameras = raycam.load_cameras(file)
    check(cameras["cam0"], K, *pose(0), kb)
    check(cameras["cam1"], K, *pose(1), rational)
    kinds[0]["camera_type"] = "splines"
    file.write_text(json.dumps({"value0": table}))
    with raises(FormatError, code="unsupported_feature", mentions=["splines"]):
        raycam.load_cameras(file)


@pytest.mark.parametrize("model", ["OPENCV8", "PINHOLE", "CAHVOR"])
def test_mrcal_camera_models_are_read(tmp_path: Path, model: str) -> None:
    R, C = pose(5)
    numbers = [458.5, 457.25, 367.0, 248.5, *(FULL.values() if model != "PINHOLE" else [])]
    file = tmp_path / "a.cameramodel"
    extrinsics = [*Rotation.from_matrix(R).as_rotvec(), *(-R @ C)]
    file.write_text(
        f"# generated\n{{\n    'lensmodel':  'LENSMODEL_{model}',\n\n    # intrinsics are fx,fy,cx,cy,...\n"
        f"    'intrinsics': [ {', '.join(map(repr, map(float, numbers)))},],\n"
        f"    'extrinsics': [ {', '.join(map(repr, map(float, extrinsics)))},],\n    'imagersize': [ 752, 480,],\n}}\n"
    )
    if model == "CAHVOR":
        with raises(FormatError, code="unsupported_feature", mentions=["CAHVOR"]):
            raycam.load_cameras(file)
        return
    check(raycam.load_cameras(file)["a"], K, R, C, rational if model == "OPENCV8" else None)


def test_zed_calibrations_are_read(tmp_path: Path) -> None:
    text = ""
    for side in ("LEFT", "RIGHT"):
        text += f"[{side}_CAM_HD]\nfx=458.5\nfy=457.25\ncx=367.0\ncy=248.5\n"
        text += "k1=-0.28\nk2=0.07\np1=0.0002\np2=-0.00002\n\n"
    text += "[STEREO]\nBaseline=119.9\nTY=0.2\nTZ=-0.1\nRX_HD=0.01\nCV_HD=-0.02\nRZ_HD=0.003\n"
    file = tmp_path / "SN123.conf"
    file.write_text(text)
    cameras = raycam.load_cameras(file)
    R = cv2.Rodrigues(np.array([0.01, -0.02, 0.003]))[0]
    check(cameras["right"], K, R, -R.T @ np.array([-0.1199, 0.0002, -0.0001]), lens)
    assert cameras["left"].size == (1280, 720)
    assert points(R, ZERO).shape == (30, 3)


@pytest.mark.parametrize(
    "model", ["Brown Conrady", "distortion.brown_conrady", "Inverse Brown Conrady", "None"]
)
def test_realsense_intrinsics_are_read(tmp_path: Path, model: str) -> None:
    table = {
        "width": 752,
        "height": 480,
        "fx": 458.5,
        "fy": 457.25,
        "ppx": 367.0,
        "ppy": 248.5,
        "model": model,
    }
    coefficients = [0.0] * 5 if model == "None" else [-0.28, 0.07, 0.0002, -0.00002, 0.01]
    file = tmp_path / "a.json"
    file.write_text(json.dumps({**table, "coeffs": coefficients}))
    if model.startswith("Inverse"):
        with raises(FormatError, code="syntax", mentions=["a.json:1", "coeffs"]):
            raycam.load_cameras(file)
        file.write_text(json.dumps({**table, "coeffs": [0.0] * 5}))
        model = "None"
    check(raycam.load_cameras(file)["a"], K, np.eye(3), ZERO, None if model == "None" else lens3)


STELLA = {
    "name": '"a"',
    "setup": '"monocular"',
    "fps": 20.0,
    "cols": 752,
    "rows": 480,
    "color_order": '"Gray"',
}


@pytest.mark.parametrize("nested", [True, False])
@pytest.mark.parametrize("model", ["perspective", "fisheye"])
def test_openvslam_camera_models_are_read(tmp_path: Path, nested: bool, model: str) -> None:
    # k3 and k4 belong to another lens model than the coefficients k1 k2 p1 p2 k3 of OpenCV.
    terms = TERMS if model == "perspective" else {"k1": 0.02, "k2": -0.01, "k3": 0.004, "k4": -0.001}
    keys = {"model": f'"{model}"', "fx": 458.5, "fy": 457.25, "cx": 367.0, "cy": 248.5, **terms, **STELLA}
    if nested:
        text = "Camera:\n" + "".join(f"  {key}: {value}\n" for key, value in keys.items())
    else:
        text = "".join(f"Camera.{key}: {value}\n" for key, value in keys.items())
    file = tmp_path / "a.yaml"
    file.write_text(text + "Feature:\n  max_num_keypoints: 2000\n")
    cameras = raycam.load_cameras(file)
    check(cameras["Camera"], K, np.eye(3), ZERO, lens if model == "perspective" else kb)
    assert cameras["Camera"].size == (752, 480)
    file.write_text(text.replace(model, "radial_division"))
    with raises(FormatError, code="unsupported_feature", mentions=["radial_division"]):
        raycam.load_cameras(file)


def test_openvslam_panorama_is_read(tmp_path: Path) -> None:
    text = 'Camera.setup: "monocular"\nCamera.model: "equirectangular"\nCamera.cols: 1024\nCamera.rows: 512\n'
    (tmp_path / "a.yaml").write_text(text)
    (camera,) = raycam.load_cameras(tmp_path / "a.yaml").values()
    assert camera.model == "equirectangular"
    np.testing.assert_allclose(camera.project([[0, 0, 1], [1, 0, 0]])[0], [[511.5, 255.5], [767.5, 255.5]])


def test_body_t_cam_next_to_k_is_not_read_as_vins(tmp_path: Path) -> None:
    R, C = pose(3)
    mount = np.eye(4)
    mount[:3] = np.column_stack([R.T, C])
    for side in ("left", "right"):
        content = {"K": K.tolist(), "dist": [-0.1, 0.02, 0.001, -0.002, 0.003], "image_size": [640, 480]}
        (tmp_path / f"{side}.json").write_text(json.dumps({**content, "body_T_cam": mount.tolist()}))
    cameras = raycam.load_cameras(tmp_path)
    for camera in cameras.values():
        np.testing.assert_allclose(camera.K, K)
        np.testing.assert_allclose(camera.R, R, atol=1e-12)
        np.testing.assert_allclose(camera.C, C, atol=1e-12)
    assert len(cameras.rigs["rig"]) == 2


def test_different_poses_of_an_mrcal_camera_raise(tmp_path: Path) -> None:
    file = tmp_path / "a.cameramodel"
    text = (
        "{'lensmodel': b'LENSMODEL_PINHOLE', 'intrinsics': [400, 400, 320, 240], 'imagersize': [640, 480],\n"
        "'rt_cam_ref': [0, 0, 0, 1, 2, 3],\n'rt_ref_cam': [0, 0, 0, -1, -2, -3]}\n"
    )
    file.write_text(text)
    np.testing.assert_allclose(raycam.load_cameras(file)["a"].C, [-1, -2, -3])
    file.write_text(text.replace("-3", "3"))
    with raises(FormatError, code="syntax", mentions=["rt_ref_cam", "rt_cam_ref"]):
        raycam.load_cameras(file)


def test_repairs_of_a_camchain_give_a_notice(tmp_path: Path) -> None:
    rotation = Rotation.from_rotvec([0.3, -0.2, 1.1]).as_matrix()
    step = "".join(f"  - [{a:.4f}, {b:.4f}, {c:.4f}, 0.1]\n" for a, b, c in rotation)
    camera = (
        "  camera_model: pinhole\n  intrinsics: [400, 400, 320, 240]\n  distortion_model: none\n"
        "  distortion_coeffs: []\n  resolution: [640, 480]\n"
    )
    (tmp_path / "camchain.yaml").write_text(
        f"cam0:\n{camera}cam1:\n  T_cn_cnm1:\n{step}  - [0, 0, 0, 1]\n{camera}"
    )
    cameras = raycam.load_cameras(tmp_path / "camchain.yaml")
    np.testing.assert_allclose(cameras["cam1"].R, rotation, atol=1e-4)
    assert has_notice(cameras.notices, "repaired_rotation", "cam1")
