"""Rectified pairs, compared with OpenCV."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
import raycam
from support.raises import raises

SIZE = (640, 480)
K1 = np.array([[500.0, 0, 322], [0, 510, 236], [0, 0, 1]])
K2 = np.array([[520.0, 0, 310], [0, 505, 250], [0, 0, 1]])
D1, D2 = np.array([-0.2, 0.05, 1e-3, -2e-3, 0.01]), np.array([-0.1, 0.02, 1e-3, 2e-3, 0.0])
TURN = cv2.Rodrigues(np.array([0.02, -0.05, 0.03]))[0]
STEP = np.array([[-0.2], [0.01], [0.02]])


def pair(turn: np.ndarray = TURN, step: np.ndarray = STEP) -> raycam.Rig:
    R = cv2.Rodrigues(np.array([0.3, -1.0, 0.5]))[0]
    left = raycam.Camera(K1, R, [1, 2, 3], SIZE, distortion=D1)
    R2, t2 = turn @ left.R, turn @ left.t + step[:, 0]
    right = raycam.Camera(K2, R2, -R2.T @ t2, SIZE, distortion=D2)
    return raycam.Rig.of({"a": left, "b": right})


def test_rectifying_rotations_equal_opencv() -> None:
    rig = pair()
    R1, R2, *_ = cv2.stereoRectify(K1, D1, K2, D2, SIZE, TURN, STEP, flags=cv2.CALIB_ZERO_DISPARITY, alpha=-1)
    made = rig.rectified()
    np.testing.assert_allclose(made["left"].R, R1 @ rig["a"].R, atol=1e-12)
    np.testing.assert_allclose(made["right"].R, R2 @ rig["b"].R, atol=1e-12)
    np.testing.assert_allclose(made.baseline(), [np.linalg.norm(STEP), 0, 0], atol=1e-12)


def test_rectified_points_equal_opencvs_maps() -> None:
    rig = pair()
    R1, R2, P1, P2, *_ = cv2.stereoRectify(
        K1, D1, K2, D2, SIZE, TURN, STEP, flags=cv2.CALIB_ZERO_DISPARITY, alpha=-1
    )
    made = rig.rectified(K=P1[:, :3])
    depth = np.random.default_rng(0).uniform(2, 9, (100, 1))
    points = rig["a"].C + depth * rig["a"].rays(np.random.default_rng(1).uniform(100, 380, (100, 2)))[1]
    for name, other, K, D, R, P in (("a", "left", K1, D1, R1, P1), ("b", "right", K2, D2, R2, P2)):
        seen, _ = rig[name].project(points)
        expected = cv2.undistortPoints(seen[:, None], K, D, R=R, P=P)[:, 0]
        np.testing.assert_allclose(made[other].project(points)[0], expected, atol=1e-4)
    rows = [made[name].project(points)[0][:, 1] for name in made]
    np.testing.assert_allclose(rows[0], rows[1], atol=1e-9)


@pytest.mark.parametrize("alpha", [-1.0, 0.0, 1.0])
def test_rectification_maps_equal_opencv(alpha: float) -> None:
    rig = pair()
    R1, R2, P1, P2, *_ = cv2.stereoRectify(
        K1, D1, K2, D2, SIZE, TURN, STEP, flags=cv2.CALIB_ZERO_DISPARITY, alpha=alpha
    )
    made = rig.rectified(K=P1[:, :3])
    # P of the second camera contains the baseline in pixels.
    np.testing.assert_allclose(-P1[0, 0] * made.baseline()[0], P2[0, 3], atol=1e-9)
    u, v = np.meshgrid(np.arange(SIZE[0]), np.arange(SIZE[1]))
    grid = np.stack([u, v, np.ones_like(u)], axis=-1).reshape(-1, 3)
    for name, other, K, D, R, P in (("a", "left", K1, D1, R1, P1), ("b", "right", K2, D2, R2, P2)):
        # The exact pixel position in float64.
        seen = grid @ np.linalg.inv(P[:, :3]).T @ R
        exact, _ = cv2.projectPoints(seen, np.zeros(3), np.zeros(3), K, D)
        origin, directions = made[other].rays(grid[:, :2])
        np.testing.assert_allclose(rig[name].project(origin + directions)[0], exact[:, 0], atol=1e-6)
        # The maps are float32: the error is at most one unit in the last place.
        x, y = cv2.initUndistortRectifyMap(K, D, R, P[:, :3], SIZE, cv2.CV_32FC1)
        ours = made[other].pixel_map(rig[name])
        np.testing.assert_allclose(ours, np.stack([x, y], axis=-1), atol=6.2e-5)


def test_rectified_images_are_centred() -> None:
    rig = pair()
    made = rig.rectified()
    middle = np.array(SIZE) / 2 - 0.5
    seen = [made["left"].K @ made["left"].R @ rig[name].rays(middle)[1] for name in rig]
    np.testing.assert_allclose(np.mean([x[:2] / x[2] for x in seen], axis=0), middle, atol=1e-9)
    assert made.rectified().mounts["left"].size == SIZE


def test_rectification_requires_the_second_camera_on_the_right() -> None:
    for step in ([0.2, 0, 0], [0, -0.2, 0], [0.0, 0, 0]):
        with raises(raycam.CameraError, code="unsupported_camera"):
            pair(np.eye(3), np.array(step)[:, None]).rectified()
