"""The transforms.json of the NeRF family.

Notices and file names are checked, and lenses are compared with OpenCV and pycolmap.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pycolmap
import pytest
import raycam
from raycam.errors import FormatError
from support.raises import has_notice, raises

POINTS = np.random.default_rng(5).uniform([-0.5, -0.4, 1.5], [0.5, 0.4, 3.0], (30, 3))
K = np.array([[510.0, 0, 322.5], [0, 505.0, 238.0], [0, 0, 1]])
IDENTITY = np.diag([1.0, -1.0, -1.0, 1.0]).tolist()


def scene(path: Path, frames: int = 1, *, per_frame: bool = False, **keys: Any) -> Path:
    shared = {"fl_x": 510.0, "fl_y": 505.0, "cx": 322.5, "cy": 238.0, "w": 640, "h": 480, **keys}
    own = shared if per_frame else {}
    listed = [{"file_path": f"{i}.png", "transform_matrix": IDENTITY, **own} for i in range(frames)]
    path.write_text(json.dumps({**({} if per_frame else shared), "frames": listed}))
    return path


@pytest.mark.parametrize("per_frame", [True, False])
def test_distortion_params_follow_the_order_of_nerfstudio(tmp_path: Path, per_frame: bool) -> None:
    k1, k2, k3, p1, p2 = -0.11, 0.03, 0.004, 0.002, -0.0015
    file = scene(
        tmp_path / "a.json",
        per_frame=per_frame,
        camera_model="OPENCV",
        distortion_params=[k1, k2, k3, 0.0, p1, p2],
    )
    (camera,) = raycam.load_cameras(file).values()
    zero = np.zeros(3)
    expected = cv2.projectPoints(POINTS, zero, zero, K, np.array([k1, k2, p1, p2, k3]))[0][:, 0]
    np.testing.assert_allclose(camera.project(POINTS)[0], expected, atol=1e-8)


def test_fisheye_with_tangential_terms_is_read_completely(tmp_path: Path) -> None:
    k1, k2, k3, k4, p1, p2 = 0.03, -0.01, 0.005, -0.001, 0.002, -0.003
    file = scene(
        tmp_path / "a.json", camera_model="OPENCV_FISHEYE", distortion_params=[k1, k2, k3, k4, p1, p2]
    )
    (camera,) = raycam.load_cameras(file).values()
    theirs = pycolmap.Camera(
        model="THIN_PRISM_FISHEYE",
        width=640,
        height=480,
        params=[510, 505, 322.5, 238, k1, k2, p1, p2, k3, k4, 0, 0],
    )
    expected = np.array([theirs.img_from_cam(point) for point in POINTS])
    np.testing.assert_allclose(camera.project(POINTS)[0], expected, atol=1e-8)


@pytest.mark.parametrize(
    ("params", "code"),
    [([0.1, 0, 0, 0.2, 0, 0], "unsupported_feature"), ([0.1, 0, 0, 0], "wrong_shape")],
)
def test_coefficients_without_a_model_are_refused(tmp_path: Path, params: list[float], code: str) -> None:
    with raises(FormatError, code=code, mentions=["a.json:1"]):
        raycam.load_cameras(scene(tmp_path / "a.json", distortion_params=params))


def test_equirectangular_model_is_read_as_a_panorama(tmp_path: Path) -> None:
    file = scene(
        tmp_path / "a.json", camera_model="EQUIRECTANGULAR", w=800, h=400, fl_x=400, fl_y=400, cx=400, cy=200
    )
    (camera,) = raycam.load_cameras(file).values()
    # The forward direction is the image centre; 90 degrees to the right is a quarter of the width away.
    np.testing.assert_allclose(
        camera.project([[0, 0, 2.0], [3.0, 0, 0]])[0], [[400, 200], [600, 200]], atol=1e-9
    )


def test_ignored_keys_and_transforms_give_one_notice_each(tmp_path: Path) -> None:
    file = scene(tmp_path / "a.json", 7, per_frame=True, blur=0.3, offset=[1, 2, 3])
    text = json.loads(file.read_text())
    text |= {"applied_transform": [[0, 1, 0, 0], [1, 0, 0, 0], [0, 0, -1, 0]], "applied_scale": 0.5}
    file.write_text(json.dumps(text))
    notices = raycam.load_cameras(file).notices
    frames, placed = sorted(notices, key=lambda notice: str(notice.code))
    assert has_notice([frames], "ignored_key", "blur", "offset", 7)
    assert has_notice([placed], "placed_cameras", "applied_transform", "[0.0, 1.0", "applied_scale", 0.5)


def test_written_panorama_has_the_rays_of_nerfstudio(tmp_path: Path) -> None:
    """Expected rays: nerfstudio's cameras.py, `_generate_rays_from_coords`, for EQUIRECTANGULAR."""
    camera = raycam.Camera.equirectangular([1, 2, 3], yaw=40, pitch=10, size=(64, 32))
    raycam.save_cameras(tmp_path / "transforms.json", {"a": camera}, "nerf")
    text = json.loads((tmp_path / "transforms.json").read_text())
    keys = {**text, **text["frames"][0]}
    assert keys["camera_model"] == "EQUIRECTANGULAR"
    pose = np.array(keys["transform_matrix"])
    for column, row in [(0.5, 0.5), (20.25, 7.5), (63.5, 31.0), (32, 16)]:
        x, y = (column - keys["cx"]) / keys["fl_x"], -(row - keys["cy"]) / keys["fl_y"]
        theta, phi = -np.pi * x, np.pi * (0.5 - y)
        local = [-np.sin(theta) * np.sin(phi), np.cos(phi), -np.cos(theta) * np.sin(phi)]
        shift = 0.5 if camera.pixel_center == "integer" else 0.0
        _, directions = camera.rays([[column - shift, row - shift]])
        np.testing.assert_allclose(directions[0], pose[:3, :3] @ local, atol=1e-9)
    (read,) = raycam.load_cameras(tmp_path / "transforms.json").values()
    assert read.model == "equirectangular"
    np.testing.assert_allclose(read.C, camera.C)
    np.testing.assert_allclose(read.R, camera.R, atol=1e-12)


@pytest.mark.parametrize(
    ("size", "focal", "fault"),
    [((64, 33), 1, "64 x 33"), ((64, 16), 1, "64 x 16"), ((64, 32), 2, "partial panorama")],
)
def test_partial_panorama_is_not_written(
    tmp_path: Path, size: tuple[int, int], focal: float, fault: str
) -> None:
    whole = raycam.Camera.equirectangular([0, 0, 0], size=(64, 32))
    part = raycam.Camera(np.diag([focal, 1, 1]) @ whole.K, whole.R, whole.C, size, model="equirectangular")
    with raises(raycam.FormatError, code="cannot_write", mentions=[fault]):
        raycam.save_cameras(tmp_path / "transforms.json", {"a": part}, "nerf")


def test_lens_coefficients_of_a_panorama_are_refused(tmp_path: Path) -> None:
    frames = [{"file_path": "a.png", "transform_matrix": np.eye(4).tolist()}]
    document = {
        "camera_model": "EQUIRECTANGULAR",
        "fl_x": 256,
        "fl_y": 256,
        "w": 512,
        "h": 256,
        "frames": frames,
    }
    path = tmp_path / "transforms.json"
    path.write_text(json.dumps({**document, "k1": 0.0}))
    assert raycam.load_cameras(path)["a.png"].model == "equirectangular"
    path.write_text(json.dumps({**document, "k1": 0.1}))
    with raises(raycam.FormatError, code="syntax", mentions=["camera_model", "k1"]):
        raycam.load_cameras(path)
