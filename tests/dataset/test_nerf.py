"""NeRF data sets, read back."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
import raycam
from raycam.dataset import write
from support.box_table import picture, ring, table, truth
from support.raises import raises

NERF_LENS = ("k1", "k2", "k3", "k4", "p1", "p2")


def test_nerf_data_set_contains_the_cameras(tmp_path: Path) -> None:
    cameras = ring()
    write(table(), tmp_path, "nerf", cameras=cameras)
    meta = json.loads((tmp_path / "transforms.json").read_text())
    assert meta["camera_model"] == "PINHOLE"
    assert len(meta["frames"]) == 4
    K = [[meta["fl_x"], 0, meta["cx"]], [0, meta["fl_y"], meta["cy"]], [0, 0, 1]]
    assert meta["camera_angle_x"] == pytest.approx(2 * np.arctan(meta["w"] / (2 * meta["fl_x"])))
    for camera, row in zip(cameras, meta["frames"], strict=True):
        again = raycam.Camera.from_opengl(
            K, row["transform_matrix"], (meta["w"], meta["h"]), pixel_center="half"
        )
        points = np.random.default_rng(0).uniform(-1, 1, (50, 3))
        np.testing.assert_allclose(again.project(points)[0] - 0.5, camera.project(points)[0], atol=1e-9)
        depth = picture(tmp_path / row["depth_file_path"])
        expected = truth(camera, "depth")
        seen = np.isfinite(expected)
        assert np.abs(depth[seen] * 1e-3 - expected[seen]).max() < 0.51e-3
    mixed = [*ring(1, fov=50), *ring(1)]
    write(table(), tmp_path / "mixed", "nerf", cameras=mixed)
    meta = json.loads((tmp_path / "mixed" / "transforms.json").read_text())
    assert "fl_x" not in meta
    assert [row["fl_x"] for row in meta["frames"]] == [camera.K[0, 0] for camera in mixed]


@pytest.mark.parametrize(
    ("model", "lens"),
    [
        ("opencv", [-0.2, 0.05, 1e-3, 2e-3, 0.01]),
        ("opencv", [-0.2, 0.05, 1e-3, 2e-3]),
        ("fisheye", [0.02, 1e-3, 0, 0]),
    ],
)
def test_nerf_lenses_have_the_names_of_nerfstudio(tmp_path: Path, model: Any, lens: list[float]) -> None:
    cameras = ring(2, distortion=lens, model=model)
    write(table(), tmp_path, "nerf", cameras=cameras)
    meta = json.loads((tmp_path / "transforms.json").read_text())
    # As in nerfstudio: two lens names, and coefficients k1 to k4, p1 and p2, which are 0 if missing.
    assert meta["camera_model"] == {"opencv": "OPENCV", "fisheye": "OPENCV_FISHEYE"}[model]
    assert meta.keys() <= {"camera_model", "fl_x", "fl_y", "cx", "cy", "w", "h", "frames", *NERF_LENS}
    k1, k2, k3, k4, p1, p2 = (meta.get(name, 0.0) for name in NERF_LENS)
    points = np.random.default_rng(0).uniform(-0.4, 0.4, (50, 3)) + np.array([0, 0, 1.5])
    K = np.array([[meta["fl_x"], 0, meta["cx"] - 0.5], [0, meta["fl_y"], meta["cy"] - 0.5], [0, 0, 1]])
    if model == "fisheye":
        pixels = cv2.fisheye.projectPoints(
            points[:, None], np.zeros(3), np.zeros(3), K, np.array([k1, k2, k3, k4])
        )[0]
    else:
        assert k4 == 0.0  # k4 must be 0, because nerfstudio interprets it in another way than OpenCV
        pixels = cv2.projectPoints(points, np.zeros(3), np.zeros(3), K, np.array([k1, k2, p1, p2, k3]))[0]
    world = points @ cameras[0].R + cameras[0].C
    np.testing.assert_allclose(cameras[0].project(world)[0], pixels[:, 0], atol=1e-9)


def test_nerf_refuses_unsupported_coefficients(tmp_path: Path) -> None:
    rational = ring(1, distortion=[-0.2, 0.05, 1e-3, 2e-3, 0.01, 0.1, 0.0, 0.0])
    with raises(raycam.CameraError, code="unsupported_camera", mentions=["k3"]):
        write(table(), tmp_path, "nerf", cameras=rational)


@pytest.mark.parametrize("model", ["equirectangular", "fisheye"])
def test_depth_of_wide_angle_cameras_is_the_distance(tmp_path: Path, model: str) -> None:
    """All rays from the centre of a sphere have the same length; nerfstudio expects it for these lenses."""
    world = raycam.World()
    world.add_object(sphere={"radius": 2.0, "level": 6}, location=[1, 0, 0])
    if model == "equirectangular":
        camera = raycam.Camera.equirectangular([1, 0, 0], 10, 20, 30, size=(64, 32))
    else:
        camera = raycam.Camera.look_at(
            [1, 0, 0],
            [3, 1, 0],
            K=[[20, 0, 32], [0, 20, 32], [0, 0, 1]],
            size=(64, 64),
            model=model,
            distortion=[0] * 4,
        )
    write(world, tmp_path, "nerf", cameras=[camera], samples=1, integrator="flat")
    depth = cv2.imread(str(next((tmp_path / "depths").glob("*.png"))), cv2.IMREAD_UNCHANGED)
    assert depth.shape == camera.size[::-1]
    np.testing.assert_allclose(depth, 2000, atol=2)
