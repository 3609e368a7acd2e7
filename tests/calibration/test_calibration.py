"""Calibration files, compared with the libraries that define the formats."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pycolmap
import pytest
import raycam
from support.raises import raises

K = np.array([[812.25, 0.0, 331.5], [0.0, 790.5, 229.125], [0.0, 0.0, 1.0]])
DISTORTION = [-0.21, 0.083, 0.0011, -0.0007, 0.013]


def camera(distortion: list[float] | None = None) -> raycam.Camera:
    rvec, tvec = [0.3, -0.5, 0.2], [0.4, -0.1, 2.5]
    return raycam.Camera.from_opencv(K, rvec, tvec, size=(640, 480), distortion=distortion)


@pytest.mark.parametrize("ending", ["yaml", "json", "xml"])
def test_opencv_files_round_trip_with_opencv(tmp_path: Path, ending: str) -> None:
    ours, theirs = tmp_path / f"ours.{ending}", tmp_path / f"theirs.{ending}"
    raycam.save_cameras(ours, camera(DISTORTION), "opencv")
    storage = cv2.FileStorage(str(ours), cv2.FILE_STORAGE_READ)
    assert np.array_equal(storage.getNode("camera_matrix").mat(), K)
    assert np.array_equal(storage.getNode("distortion_coefficients").mat().ravel(), DISTORTION)
    storage = cv2.FileStorage(str(theirs), cv2.FILE_STORAGE_WRITE)
    storage.write("image_width", 640)
    storage.write("image_height", 480)
    storage.write("camera_matrix", K)
    storage.write("distortion_coefficients", np.array(DISTORTION))
    storage.release()
    (read,) = raycam.load_cameras(theirs).values()
    assert np.array_equal(read.K, K)
    assert np.array_equal(read.distortion, DISTORTION)


@pytest.mark.parametrize("format", ["colmap", "colmap-binary"])
def test_colmap_models_round_trip_with_pycolmap(tmp_path: Path, format: str) -> None:
    given = {"a.png": camera(DISTORTION[:4]), "folder/b.png": camera()}
    raycam.save_cameras(tmp_path / "model", given, format)
    model = pycolmap.Reconstruction(str(tmp_path / "model"))
    points = np.random.default_rng(1).uniform(-0.5, 0.5, (20, 3))
    for image in model.images.values():
        in_camera = [image.cam_from_world() * point for point in points]
        pixels = np.array([image.camera.img_from_cam(point) for point in in_camera])
        expected, _ = given[image.name].project(points)
        np.testing.assert_allclose(pixels, expected + 0.5, atol=1e-8)
    (tmp_path / "again").mkdir()
    if format == "colmap":
        model.write_text(str(tmp_path / "again"))
    else:
        model.write_binary(str(tmp_path / "again"))
    again = raycam.load_cameras(tmp_path / "again")
    first = raycam.load_cameras(tmp_path / "model")
    for name in given:
        assert again[name] == first[name]
        assert again[name].pixel_center == "half"


def test_file_without_an_image_size_requires_the_size_argument(tmp_path: Path) -> None:
    path = tmp_path / "calib.txt"
    path.write_text("P0: 700 0 320 0 0 700 240 0 0 0 1 0\nP1: 700 0 320 -350 0 700 240 0 0 0 1 0\n")
    with raises(raycam.CameraError, code="missing_argument", mentions=["calib.txt"]):
        raycam.load_cameras(path)["P1"]
    right = raycam.load_cameras(path, size=(640, 480))["P1"]
    np.testing.assert_allclose(right.C, [0.5, 0.0, 0.0], atol=1e-12)


@pytest.mark.parametrize("cameras", ["opencv", [1], None])
def test_save_cameras_refuses_objects_that_are_not_cameras(tmp_path: Path, cameras: Any) -> None:
    with raises(raycam.SettingsError, code="wrong_type"):
        raycam.save_cameras(tmp_path / "a.yaml", cameras, "opencv")
    if cameras is not None:
        with raises(raycam.SettingsError, code="wrong_type"):
            raycam.load_cameras(tmp_path / "poses.tum", intrinsics=cameras)


@pytest.mark.parametrize("format", ["opencv", "colmap", "nerf"])
def test_size_argument_scales_cameras_of_files_with_a_size(tmp_path: Path, format: str) -> None:
    raycam.save_cameras(tmp_path / "a", {"a": camera(DISTORTION[:4])}, format)
    (half,) = raycam.load_cameras(tmp_path / "a", size=(320, 240)).values()
    (full,) = raycam.load_cameras(tmp_path / "a").values()
    point = np.array([0.1, 0.2, 0.3])
    # Scaling keeps the image corner in place, and distances from the corner are halved.
    (a, _), (b, _) = half.project(point), full.project(point)
    np.testing.assert_allclose(a - half.corner, (b - full.corner) / 2, atol=1e-9)
    with raises(raycam.errors.CameraError, code="conflicting_values"):
        raycam.load_cameras(tmp_path / "a", size=(640, 640))["a"]
    raycam.save_cameras(tmp_path / "b.json", raycam.load_cameras(tmp_path / "a", size=(320, 240)), "nerf")
    assert next(iter(raycam.load_cameras(tmp_path / "b.json").values())).size == (320, 240)
