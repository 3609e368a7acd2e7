"""Copies of cameras, compared with OpenCV where it has an equivalent."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
import raycam
from raycam.errors import CameraError
from support.raises import raises

K = np.array([[510.0, 0, 322.5], [0, 505.0, 238.0], [0, 0, 1]])
BROWN = np.array([-0.21, 0.083, 0.0011, -0.0007, 0.013])
POINTS = np.random.default_rng(2).uniform([-0.4, -0.3, 1.5], [0.4, 0.3, 3.0], (30, 3))


def camera(**options: object) -> raycam.Camera:
    return raycam.Camera(K, np.eye(3), np.zeros(3), (640, 480), distortion=BROWN, **options)  # type: ignore[arg-type]


@pytest.mark.parametrize("center", ["integer", "half"])
def test_replace_keeps_the_other_values(center: str) -> None:
    given = camera(pixel_center=center).with_aperture(0.01, focus=2.0)
    moved = given.replace(C=[0.1, 0.2, -0.3])
    assert moved.pixel_center == center
    assert moved.aperture == given.aperture
    assert np.array_equal(moved.distortion, BROWN)
    pixels = cv2.projectPoints(POINTS, np.zeros(3), -np.array([0.1, 0.2, -0.3]), K, BROWN)[0][:, 0]
    np.testing.assert_allclose(moved.project(POINTS)[0], pixels, atol=1e-9)
    assert given.replace() == given
    assert given.pinhole().replace(distortion=BROWN) == given


def test_replacing_the_pixel_center_keeps_the_image() -> None:
    half = camera().replace(pixel_center="half")
    np.testing.assert_allclose(half.project(POINTS)[0], camera().project(POINTS)[0] + 0.5, atol=1e-12)
    assert half.replace(pixel_center="integer") == camera()


def test_cropped_camera_shifts_the_pixels() -> None:
    part = camera().cropped(100, 50, 200, 150)
    assert part.size == (200, 150)
    np.testing.assert_allclose(part.project(POINTS)[0], camera().project(POINTS)[0] - [100, 50], atol=1e-9)
    with raises(CameraError, code="wrong_type"):
        camera().cropped(0.5, 0, 10, 10)  # type: ignore[arg-type]


def border_rule(sides: list[np.ndarray], balance: float) -> np.ndarray:
    """K [3, 3] by OpenCV's rule, from the undistorted points of the image's four sides.

    The points lie on the plane z = 1.
    """
    made, everything = np.eye(3), np.concatenate(sides)
    for axis, last in ((0, 639.0), (1, 479.0)):
        first, second = (side[:, axis] for side in sides[2 * axis : 2 * axis + 2])
        inner = (first.max(), second.min())
        outer = (everything[:, axis].min(), everything[:, axis].max())
        ends = [(last / (high - low), -low * last / (high - low)) for low, high in (inner, outer)]
        made[axis, [axis, 2]] = (1 - balance) * np.array(ends[0]) + balance * np.array(ends[1])
    return made


def border(columns: int, rows: int) -> list[np.ndarray]:
    """The pixels [n, 2] of the left, right, upper and lower sides of the image."""
    u, v = np.linspace(0, 639, columns), np.linspace(0, 479, rows)
    upright = [np.column_stack([np.full(rows, x), v]) for x in (0.0, 639.0)]
    return upright + [np.column_stack([u, np.full(columns, y)]) for y in (0.0, 479.0)]


def undistort(pixels: np.ndarray, lens: np.ndarray) -> np.ndarray:
    """Points [n, 2] on the plane z = 1 that `cv2.projectPoints` maps to these pixels."""
    found = (pixels - K[:2, 2]) / [K[0, 0], K[1, 1]]
    for _ in range(200):
        seen = cv2.projectPoints(
            np.column_stack([found, np.ones(len(found))]), np.zeros(3), np.zeros(3), K, lens
        )[0]
        found = found + (pixels - seen[:, 0]) / [K[0, 0], K[1, 1]]
    return found


STRONG = np.array([-0.35, 0.15, 0.0, 0.0, -0.02])


@pytest.mark.parametrize("lens", [BROWN, STRONG])
@pytest.mark.parametrize("balance", [0.0, 0.4, 1.0])
def test_undistorted_equals_opencvs_optimal_new_camera_matrix(balance: float, lens: np.ndarray) -> None:
    ours = camera().replace(distortion=lens).undistorted(balance)
    theirs, _ = cv2.getOptimalNewCameraMatrix(K, lens, (640, 480), balance)

    # OpenCV uses nine points of each side, and inverts the lens by five iterations, whose result is not exact.
    nine = [cv2.undistortPoints(side[:, None], K, lens)[:, 0] for side in border(9, 9)]
    np.testing.assert_allclose(border_rule(nine, balance), theirs, atol=1e-9)
    # raycam applies the same rule to all points, with the exact inverse.
    exact = [undistort(side, lens) for side in border(640, 480)]
    np.testing.assert_allclose(ours.K, border_rule(exact, balance), atol=1e-9)
    assert np.abs(ours.K - theirs).max() < 0.25
    assert ours.model == "pinhole"
    half = camera().replace(distortion=lens, pixel_center="half").undistorted(balance)
    assert half == ours.replace(pixel_center="half") or np.allclose(half.K[:2, 2], ours.K[:2, 2] + 0.5)


@pytest.mark.parametrize("lens", [BROWN, STRONG])
def test_undistorted_image_shows_only_pixels_of_the_original(lens: np.ndarray) -> None:
    given = camera().replace(distortion=lens)
    shown = given.undistorted(0.0).pixel_map(given).reshape(-1, 2)
    assert shown.min() > -1e-4
    assert (shown.max(axis=0) - [639, 479]).max() < 1e-4
    # The valid region reaches each side of the image, so the image is used fully.
    assert (shown.min(axis=0) < 1e-3).all()
    assert (shown.max(axis=0) > [638.999, 478.999]).all()


def test_undistortion_map_equals_that_of_opencv() -> None:
    plain = camera().undistorted(0.0)
    ours = plain.pixel_map(camera())
    x, y = cv2.initUndistortRectifyMap(K, BROWN, np.eye(3), plain.K, (640, 480), cv2.CV_32FC1)
    np.testing.assert_allclose(ours, np.stack([x, y], axis=-1), atol=1e-3)
    assert ours.min() > -0.01
    assert (ours[..., 0].max(), ours[..., 1].max()) <= (639.01, 479.01)
    with raises(CameraError, code="unsupported_camera"):
        plain.replace(C=[1, 0, 0]).pixel_map(camera())


def test_lenses_wider_than_180_degrees_cannot_be_undistorted() -> None:
    wide = raycam.Camera(
        [[150, 0, 320], [0, 150, 240], [0, 0, 1]],
        np.eye(3),
        np.zeros(3),
        (640, 480),
        distortion=[0, 0, 0, 0],
        model="fisheye",
    )
    with raises(CameraError, code="unsupported_camera"):
        wide.undistorted(1.0)
    with raises(CameraError, code="unsupported_camera"):
        raycam.Camera.equirectangular([0, 0, 0]).pinhole()


@pytest.mark.parametrize("order", ["wxyz", "xyzw"])
@pytest.mark.parametrize("direction", ["world_from_camera", "camera_from_world"])
def test_from_quaternion_equals_its_rotation_vector(order: str, direction: str) -> None:
    rvec, t = np.array([0.4, -0.7, 0.3]), np.array([0.5, -1.0, 2.0])
    angle = np.linalg.norm(rvec)
    w, xyz = np.cos(angle / 2), np.sin(angle / 2) * rvec / angle
    q = [w, *xyz] if order == "wxyz" else [*xyz, w]
    made = raycam.Camera.from_quaternion(K, q, t, (640, 480), order=order, direction=direction)  # type: ignore[arg-type]
    turn = cv2.Rodrigues(rvec)[0]
    R, C = (turn.T, t) if direction == "world_from_camera" else (turn, -turn.T @ t)
    np.testing.assert_allclose(made.R, R, atol=1e-12)
    np.testing.assert_allclose(made.C, C, atol=1e-12)
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = turn, t
    again = raycam.Camera.from_transform(K, size=(640, 480), **{direction: pose})  # type: ignore[arg-type]
    np.testing.assert_allclose(again.P, made.P, atol=1e-9)


@pytest.mark.parametrize("name", ["from_opengl", "from_transform", "from_x_forward"])
def test_pose_and_size_are_accepted_in_either_order(name: str) -> None:
    make = getattr(raycam.Camera, name)
    pose = np.array([[0, 0, 1, 4], [1, 0, 0, 5], [0, 1, 0, 6], [0, 0, 0, 1.0]])
    size = (640, 480)
    made = [
        make(K, pose, size),
        make(K, size, pose),
        make(K, pose, size=size),
        make(K, size, world_from_camera=pose),
        make(K, world_from_camera=pose, size=np.array(size)),
        make(K, [640, 480], pose.tolist()),
    ]
    # The third column is z: forward in OpenCV, backward in OpenGL; the first is the body's forward axis.
    column, sign = {"from_opengl": (2, -1), "from_transform": (2, 1), "from_x_forward": (0, 1)}[name]
    for camera in made:
        assert camera.size == size
        np.testing.assert_allclose(camera.forward, sign * pose[:3, column], atol=0)
        np.testing.assert_allclose(camera.C, pose[:3, 3], atol=0)


def test_from_pose_matrix_accepts_named_axes() -> None:
    pose = np.eye(4)
    pose[:3, 3] = [1, 2, 3]
    forward = {"opencv": [0, 0, 1], "opengl": [0, 0, -1], "x_forward": [1, 0, 0]}
    for axes, ahead in forward.items():
        made = raycam.Camera.from_transform(K, pose, (640, 480), axes=axes)  # type: ignore[arg-type]
        np.testing.assert_allclose(made.forward, ahead, atol=0)
        np.testing.assert_allclose(made.C, [1, 2, 3])
    same = raycam.Camera.from_opengl(K, pose, (640, 480))
    made = raycam.Camera.from_transform(K, pose, (640, 480), axes="opengl")
    np.testing.assert_array_equal(same.P, made.P)
    with raises(CameraError, code="invalid_matrix"):
        raycam.Camera.from_transform(K, pose.T, (640, 480))
    with raises(CameraError, code="missing_value"):
        raycam.Camera.from_transform(K, size=(640, 480))
    with raises(CameraError, code="missing_value"):
        raycam.Camera.from_transform(K, pose)
    with raises(CameraError, code="not_a_rotation"):
        raycam.Camera.from_quaternion(
            K, [1, 1, 0, 0], [0, 0, 0], (640, 480), order="wxyz", direction="world_from_camera"
        )
