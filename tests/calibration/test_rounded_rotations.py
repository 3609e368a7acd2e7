"""Rounded rotations become the nearest rotation, with one notice.

The result is compared with SciPy and OpenCV.
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
from support.camera_truth import Array, four, intrinsics
from support.raises import notice_codes, raises, warns

K = intrinsics(500.0, 501.0, 320.0, 240.0)


def load(path: Path, **arguments: Any) -> tuple[raycam.Cameras, list[Any]]:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        cameras = raycam.load_cameras(path, **arguments)
    return cameras, [warning.message for warning in caught]


def nearest(matrix: Array) -> Array:
    u, _, vt = np.linalg.svd(matrix)
    product: Array = u @ vt
    return product


@pytest.mark.parametrize("digits", [3, 4, 6, 9])
@pytest.mark.parametrize("transposed", [False, True])
def test_rounded_poses_are_read_as_the_nearest_rotation(
    tmp_path: Path, digits: int, transposed: bool
) -> None:
    intrinsic = raycam.Camera(K, np.eye(3), np.zeros(3), (640, 480))
    rotations = Rotation.random(40, random_state=digits).as_matrix()
    rows = [np.round(four(R.T if transposed else R, np.ones(3)), digits).ravel() for R in rotations]
    np.savetxt(tmp_path / "traj.txt", rows, fmt=f"%.{digits}f")
    cameras, notices = load(tmp_path / "traj.txt", intrinsics=intrinsic, direction="world_from_camera")
    assert len(cameras) == 40
    for camera, row in zip(cameras.values(), rows, strict=True):
        np.testing.assert_allclose(camera.R.T, nearest(row.reshape(4, 4)[:3, :3]), atol=2e-7)
    assert notice_codes(notices).count("repaired_rotation") == (digits < 9)


@pytest.mark.parametrize("size", [0.02, 0.3])
def test_matrices_far_from_a_rotation_are_refused(tmp_path: Path, size: float) -> None:
    matrix = np.eye(4)
    matrix[:3, :3] *= 1 + size
    np.savetxt(tmp_path / "pose.txt", matrix)
    with raises(FormatError, code="syntax", mentions=["pose.txt"]):
        raycam.load_cameras(tmp_path / "pose.txt", size=(640, 480))


def test_mirrored_matrices_are_refused(tmp_path: Path) -> None:
    np.savetxt(tmp_path / "pose.txt", np.diag([1.0, 1.0, -1.0, 1.0]))
    with raises(FormatError, code="syntax", mentions=["pose.txt:4"]):
        raycam.load_cameras(tmp_path / "pose.txt", size=(640, 480))


def test_cameras_accept_rounded_rotations() -> None:
    R = np.round(Rotation.random(random_state=3).as_matrix(), 6)
    with warns(UserWarning, code="repaired_rotation"):
        camera = raycam.Camera(K, R, np.zeros(3), (640, 480))
    np.testing.assert_allclose(camera.R, nearest(R), atol=1e-12)


def test_rounded_mounts_are_read_as_a_rig(tmp_path: Path) -> None:
    mounts = [
        np.round(four(Rotation.random(random_state=i).as_matrix(), np.array([0.1 * i, 0, 0])), 6)
        for i in range(2)
    ]
    text = ""
    for i, mount in enumerate(mounts):
        text += f"cam{i}:\n  T_cam_imu:\n"
        text += "".join(f"  - [{', '.join(f'{v:.6f}' for v in row)}]\n" for row in mount)
        text += "  camera_model: pinhole\n  intrinsics: [500, 501, 320, 240]\n  resolution: [640, 480]\n"
    (tmp_path / "chain.yaml").write_text(text)
    cameras, _ = load(tmp_path / "chain.yaml")
    (rig,) = cameras.rigs.values()
    for camera, mount in zip(rig.values(), mounts, strict=True):
        np.testing.assert_allclose(camera.R, nearest(mount[:3, :3]), atol=1e-6)


@pytest.mark.parametrize("name", ["R_T_of_JSON", "T_BS"])
def test_rounded_stereo_pairs_are_read_as_a_rig(tmp_path: Path, name: str) -> None:
    R = np.round(Rotation.from_rotvec([0.01, 0.2, -0.03]).as_matrix(), 5)
    if name == "T_BS":
        for i, side in enumerate(["left", "right"]):
            mount = four(R, np.array([0.2 * i, 0.0, 0.0]))
            lines = ", ".join(f"{v:.5f}" for v in mount.ravel())
            (tmp_path / f"{side}.yaml").write_text(
                f"T_BS:\n  cols: 4\n  rows: 4\n  data: [{lines}]\nresolution: [640, 480]\n"
                "intrinsics: [500, 501, 320, 240]\ndistortion_model: radial-tangential\n"
                "distortion_coefficients: [0.1, 0, 0, 0]\n"
            )
        cameras, notices = load(tmp_path)
        assert notice_codes(notices) == ["repaired_rotation"]
    else:
        pair = {
            "K1": K.tolist(),
            "K2": K.tolist(),
            "R": R.tolist(),
            "T": [-0.2, 0, 0],
            "img_size": [640, 480],
        }
        (tmp_path / "pair.json").write_text(json.dumps(pair))
        cameras, _ = load(tmp_path / "pair.json")
    (rig,) = cameras.rigs.values()
    left, right = rig.values()
    assert np.linalg.norm(left.C - right.C) == pytest.approx(0.2)


@pytest.mark.parametrize("key", ["rotation", "R", "rvec"])
def test_rotation_vectors_longer_than_two_pi_are_refused(tmp_path: Path, key: str) -> None:
    t = "tvec" if key == "rvec" else "T"
    for vector in ([0.0, 90.0, 0.0], [4.0, 4.0, 4.0]):
        camera = {"K": K.tolist(), "img_size": [640, 480], key: vector, t: [0, 0, 1]}
        (tmp_path / "a.json").write_text(json.dumps(camera))
        with raises(FormatError, code="syntax", mentions=[key, "from_euler"]):
            raycam.load_cameras(tmp_path / "a.json")
    camera[key] = [0.3, -2.0, 1.5]
    (tmp_path / "a.json").write_text(json.dumps(camera))
    (read,) = load(tmp_path / "a.json")[0].values()
    np.testing.assert_allclose(read.R, cv2.Rodrigues(np.array(camera[key]))[0], atol=1e-12)
