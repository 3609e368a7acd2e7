"""Camera matrices P [3, 4] in YAML and JSON files without K."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import raycam
from support.raises import raises

K = np.array([[800.0, 0.5, 322.0], [0.0, 790.0, 241.0], [0.0, 0.0, 1.0]])
ANGLE = 0.3
R = np.array([[np.cos(ANGLE), 0.0, -np.sin(ANGLE)], [0.0, 1.0, 0.0], [np.sin(ANGLE), 0.0, np.cos(ANGLE)]])
POINTS = np.array([[0.1, 0.2, 5.0], [-1.0, 0.5, 7.0], [0.4, -0.6, 4.0]])


def matrix(center: list[float]) -> np.ndarray:
    return K @ np.column_stack([R, -R @ np.array(center)])


def pixels(P: np.ndarray) -> np.ndarray:
    found = np.column_stack([POINTS, np.ones(3)]) @ P.T
    return found[:, :2] / found[:, 2:]


@pytest.mark.parametrize("key", ["P", "projection_matrix", "proj_mat"])
@pytest.mark.parametrize("suffix", [".yaml", ".json"])
def test_camera_matrix_without_k_is_read(tmp_path: Path, key: str, suffix: str) -> None:
    P = matrix([0.5, 0.1, -1.0])
    path = tmp_path / f"front{suffix}"
    path.write_text(json.dumps({"image_size": [640, 480], key: P.tolist()}), encoding="utf-8")
    cameras = raycam.load_cameras(path)
    assert list(cameras) == ["front"]
    camera = cameras["front"]
    assert camera.size == (640, 480)
    np.testing.assert_allclose(camera.project(POINTS)[0], pixels(P), atol=1e-9)


def test_camera_matrices_of_a_pair_and_of_named_maps_are_read(tmp_path: Path) -> None:
    left, right = matrix([0.0, 0.0, 0.0]), matrix([0.2, 0.0, 0.0])
    pair = {"width": 640, "height": 480, "P1": left.tolist(), "P2": right.tolist()}
    maps = {"left": {"P": left.tolist()}, "right": {"P": right.tolist()}, "image_size": [640, 480]}
    for name, document in (("pair", pair), ("maps", maps)):
        path = tmp_path / f"{name}.json"
        path.write_text(json.dumps(document), encoding="utf-8")
        cameras = list(raycam.load_cameras(path).values())
        assert len(cameras) == 2
        for camera, P in zip(cameras, (left, right), strict=True):
            np.testing.assert_allclose(camera.project(POINTS)[0], pixels(P), atol=1e-9)


def test_pose_next_to_a_camera_matrix_raises(tmp_path: Path) -> None:
    path = tmp_path / "front.json"
    document = {"image_size": [640, 480], "P": matrix([0.0, 0.0, 0.0]).tolist(), "R": R.tolist()}
    path.write_text(json.dumps(document), encoding="utf-8")
    with raises(raycam.FormatError, mentions=["front.json"]):
        raycam.load_cameras(path)
