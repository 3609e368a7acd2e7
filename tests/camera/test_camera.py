"""Cameras, compared with OpenCV and SciPy."""

from __future__ import annotations

import copy
import pickle

import cv2
import numpy as np
import pytest
import raycam
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

SIZE = (640, 480)


def random_k(rng: np.random.Generator, skew: float = 0.0) -> np.ndarray:
    """A random K with unequal focal lengths and any principal point."""
    fx, fy = rng.uniform(200, 2000, 2)
    cx, cy = rng.uniform(-200, 900, 2)
    return np.array([[fx, skew, cx], [0, fy, cy], [0, 0, 1]])


def random_camera(rng: np.random.Generator, **keys: object) -> raycam.Camera:
    r = Rotation.random(random_state=rng).as_matrix()
    return raycam.Camera(random_k(rng, rng.normal(0, 20)), r, rng.normal(0, 5, 3), SIZE, **keys)  # type: ignore[arg-type]


def in_view(rng: np.random.Generator, camera: raycam.Camera, count: int) -> np.ndarray:
    """World points in front of the camera, near and far, inside and around the image."""
    depth = np.exp(rng.uniform(np.log(0.1), np.log(100), count))
    pixels = rng.uniform([-640, -480, 1], [1280, 960, 1], (count, 3))
    pixels[:, 2] = 1
    return camera.C + depth[:, None] * (pixels @ np.linalg.inv(camera.K).T @ camera.R)


def test_image_corner_is_half_a_pixel_before_the_first_pixel_centre() -> None:
    for center in ("integer", "half"):
        camera = raycam.Camera(np.diag([90, 90, 1]), np.eye(3), [0, 0, 0], (8, 6), pixel_center=center)
        assert camera.rays()[1].shape == (6, 8, 3)
        first = camera.rays()[1][0, 0]
        np.testing.assert_allclose(first, camera.rays([camera.corner + 0.5] * 2)[1])
        assert camera.corner == {"integer": -0.5, "half": 0.0}[center]


def test_project_agrees_with_opencv() -> None:
    rng = np.random.default_rng(1)
    worst = 0.0
    for _ in range(1000):
        k = random_k(rng)
        rotation = Rotation.random(random_state=rng)
        rvec, tvec = rotation.as_rotvec(), rng.normal(0, 3, 3)
        camera = raycam.Camera.from_opencv(k, rvec, tvec, SIZE)
        points = in_view(rng, camera, 1000)
        expected = cv2.projectPoints(points, rvec, tvec, k, None)[0].reshape(-1, 2)
        pixels, in_front = camera.project(points)
        assert in_front.all()
        worst = max(worst, float(np.abs(pixels - expected).max()))
    assert worst <= 1e-9


def test_project_equals_p_times_x() -> None:
    rng = np.random.default_rng(2)
    for _ in range(100):
        camera = random_camera(rng)
        points = np.concatenate([in_view(rng, camera, 50), rng.normal(0, 10, (50, 3))])
        x = np.column_stack([points, np.ones(100)]) @ camera.P.T
        pixels, in_front = camera.project(points)
        assert (in_front == (x[:, 2] > 0)).all()
        expected = x[:, :2] / x[:, 2:]
        assert np.allclose(pixels, expected, rtol=1e-9, atol=1e-7)
        np.testing.assert_allclose(
            camera.P, camera.K @ camera.R @ np.column_stack([np.eye(3), -camera.C]), rtol=1e-12
        )
        np.testing.assert_allclose(camera.t, -camera.R @ camera.C, atol=1e-13)


@pytest.mark.parametrize("pixel_center", ["integer", "half"])
def test_rays_invert_project(pixel_center: str) -> None:
    rng = np.random.default_rng(3)
    for _ in range(50):
        camera = random_camera(rng, pixel_center=pixel_center)
        pixels = rng.uniform([-500, -500], [1000, 1000], (200, 2))
        origins, directions = camera.rays(pixels)
        np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1, atol=1e-14)
        assert (directions @ camera.forward > 0).all()
        back, in_front = camera.project(origins + 7 * directions)
        assert in_front.all()
        np.testing.assert_allclose(back, pixels, atol=1e-9)
        behind = camera.project(origins - 7 * directions)[1]
        assert not behind.any()


@pytest.mark.parametrize(("pixel_center", "offset"), [("integer", 0.0), ("half", 0.5)])
def test_rays_of_all_pixels_pass_through_their_centres(pixel_center: str, offset: float) -> None:
    camera = raycam.Camera.look_at([3, 2, 1], [0, 0, 0], size=(5, 3), pixel_center=pixel_center)  # type: ignore[arg-type]
    origins, directions = camera.rays()
    assert origins.shape == directions.shape == (3, 5, 3)
    one = camera.rays([4 + offset, 2 + offset])[1]
    assert (directions[2, 4] == one).all()
    # The principal point is the image centre in both pixel conventions.
    np.testing.assert_allclose(directions[1, 2], camera.forward, atol=1e-15)


def test_project_and_rays_accept_a_single_point_or_pixel() -> None:
    camera = raycam.Camera.look_at([0, -5, 0], [0, 0, 0], size=(101, 101))
    pixel, in_front = camera.project([0, 0, 0])
    np.testing.assert_allclose(pixel, [50, 50], atol=1e-12)
    assert in_front is np.True_
    origin, direction = camera.rays(pixel)
    np.testing.assert_allclose([origin, direction], [[0, -5, 0], [0, 1, 0]], atol=1e-14)


@settings(max_examples=200, deadline=None)
@given(seed=st.integers(0, 2**32), log_scale=st.floats(-8, 8), sign=st.sampled_from([-1.0, 1.0]))
def test_from_matrix_accepts_any_scale_and_sign(seed: int, log_scale: float, sign: float) -> None:
    camera = random_camera(np.random.default_rng(seed))
    again = raycam.Camera.from_matrix(sign * 10**log_scale * camera.P, SIZE)
    np.testing.assert_allclose(again.K, camera.K, rtol=1e-9, atol=1e-7)
    np.testing.assert_allclose(again.R, camera.R, atol=1e-9)
    np.testing.assert_allclose(again.C, camera.C, atol=1e-8)
    point = camera.C + 3 * camera.forward
    assert again.project(point)[1]


def test_from_matrix_keeps_the_digits_of_an_ill_conditioned_matrix() -> None:
    p = raycam.Camera([[3e4, 0, 320], [0, 3e4, 240], [0, 0, 1]], np.eye(3), [5e5, 4e6, -300], SIZE).P
    again = raycam.Camera.from_matrix(p * 17, SIZE).P
    np.testing.assert_allclose(again, p, rtol=1e-12)


def test_roll_pitch_yaw_agree_with_scipy() -> None:
    rng = np.random.default_rng(4)
    camera_from_body = np.array([[0.0, -1, 0], [0, 0, -1], [1, 0, 0]])
    for _ in range(300):
        roll, yaw = rng.uniform(-180, 180, 2)
        pitch = rng.uniform(-90, 90)
        camera = raycam.Camera.from_pose([1, 2, 3], roll, pitch, yaw, size=SIZE, focal=500)
        world_from_body = Rotation.from_euler("ZYX", [yaw, pitch, roll], degrees=True).as_matrix()
        np.testing.assert_allclose(camera.R, camera_from_body @ world_from_body.T, atol=1e-14)
        np.testing.assert_allclose(camera.roll_pitch_yaw, [roll, pitch, yaw], atol=1e-9)


@pytest.mark.parametrize(
    ("angles", "forward", "right"),
    [
        ((0, 0, 0), [1, 0, 0], [0, -1, 0]),
        ((0, 0, 90), [0, 1, 0], [1, 0, 0]),
        ((0, 90, 0), [0, 0, -1], [0, -1, 0]),
        ((90, 0, 0), [1, 0, 0], [0, 0, -1]),
    ],
)
def test_roll_pitch_and_yaw_turn_about_their_axes(
    angles: tuple[int, int, int], forward: list[int], right: list[int]
) -> None:
    camera = raycam.Camera.from_pose([0, 0, 0], *angles, fov=45)
    np.testing.assert_allclose(camera.forward, forward, atol=1e-15)
    np.testing.assert_allclose(camera.R[0], right, atol=1e-15)


def test_camera_with_y_up_looks_along_minus_z() -> None:
    camera = raycam.Camera.from_pose([0, 0, 0], fov=45, up="y")
    np.testing.assert_allclose(camera.R, [[1, 0, 0], [0, -1, 0], [0, 0, -1]], atol=0)
    np.testing.assert_allclose(camera.roll_pitch_yaw, 0, atol=1e-15)
    turned = raycam.Camera.look_at([0, 0, 0], [-1, 0, 0], "y")
    assert turned.up == "y"
    np.testing.assert_allclose(turned.roll_pitch_yaw, [0, 0, 90], atol=1e-12)


def test_roll_pitch_yaw_of_a_vertical_view_restore_the_rotation() -> None:
    for pitch in (-90, 90):
        camera = raycam.Camera.from_pose([0, 0, 0], 0, pitch, 40, fov=60)
        roll, p, yaw = camera.roll_pitch_yaw
        again = raycam.Camera.from_pose([0, 0, 0], roll, p, yaw, fov=60)
        np.testing.assert_allclose(again.R, camera.R, atol=1e-12)


def test_from_opencv_accepts_rotation_vectors_and_matrices() -> None:
    rng = np.random.default_rng(5)
    k, t = random_k(rng), rng.normal(size=3)
    rvec = Rotation.random(random_state=rng).as_rotvec()
    matrix = cv2.Rodrigues(rvec)[0]
    cameras = [
        raycam.Camera.from_opencv(k, r, tvec, SIZE, d)
        for r in (rvec, rvec[:, None], rvec[None], matrix)
        for tvec, d in ((t, None), (t[:, None], np.zeros(5)), (t[None], [[0.0] * 5]))
    ]
    for camera in cameras:
        np.testing.assert_allclose(camera.R, matrix, atol=1e-14)
        np.testing.assert_allclose(camera.t, t, atol=1e-13)


def test_from_opengl_flips_the_y_and_z_axes() -> None:
    rng = np.random.default_rng(6)
    camera = random_camera(rng)
    pose = np.eye(4)
    pose[:3, :3] = camera.R.T @ np.diag([1.0, -1, -1])
    pose[:3, 3] = camera.C
    again = raycam.Camera.from_opengl(camera.K, pose, SIZE)
    np.testing.assert_allclose(again.P, camera.P, rtol=1e-12, atol=1e-9)


def test_fov_focal_length_and_k_give_the_expected_intrinsics() -> None:
    camera = raycam.Camera.from_pose([0, 0, 0], size=(200, 100), fov=90)
    np.testing.assert_allclose(camera.K, [[50, 0, 99.5], [0, 50, 49.5], [0, 0, 1]])
    half = raycam.Camera.from_pose([0, 0, 0], size=(200, 100), fov=90, pixel_center="half")
    np.testing.assert_allclose(half.K, [[50, 0, 100], [0, 50, 50], [0, 0, 1]])
    both = raycam.Camera.from_pose([0, 0, 0], focal=(300, 310), skew=2, principal_point=(10, 20))
    np.testing.assert_allclose(both.K, [[300, 2, 10], [0, 310, 20], [0, 0, 1]])
    given_k = raycam.Camera.look_at([1, 0, 0], [0, 0, 0], K=2 * both.K)
    np.testing.assert_allclose(given_k.K, both.K)
    skewed = raycam.Camera([[300, 0, 10], [0, 310, 20], [0, 0, 1]], np.eye(3), [0, 0, 0], SIZE, skew=2)
    np.testing.assert_allclose(skewed.K, both.K)


@pytest.mark.parametrize("pixel_center", ["integer", "half"])
def test_resized_keeps_the_edges_of_the_view(pixel_center: str) -> None:
    camera = random_camera(np.random.default_rng(7), pixel_center=pixel_center)
    double = camera.resized((1280, 1440))
    offset = 0.5 if pixel_center == "integer" else 0.0
    corners = np.array([[0, 0], [640, 480], [100, 33]]) - offset
    np.testing.assert_allclose(
        double.rays((corners + offset) * [2, 3] - offset)[1], camera.rays(corners)[1], atol=1e-13
    )
    assert double.size == (1280, 1440)


def test_arrays_of_every_dtype_and_layout_give_the_same_camera() -> None:
    k = np.array([[500.0, 0, 320], [0, 400, 240], [0, 0, 1]])
    r, c = np.eye(3)[[1, 2, 0]], np.array([1.0, 2, 3])
    expected = raycam.Camera(k, r, c, SIZE)
    wide = np.zeros((6, 6))
    wide[::2, ::2] = k
    variants = [
        (k.tolist(), r.tolist(), tuple(c)),
        (wide[::2, ::2], np.asfortranarray(r), c[::-1][::-1]),
        (k.astype(">f8"), r.astype(np.int8), c.astype(">i4")),
        (k.astype(np.float32), r.astype(np.float16), c.astype(np.uint8)),
    ]
    for variant in variants:
        assert raycam.Camera(*variant, size=np.array(SIZE)) == expected
    points = np.random.default_rng(8).normal(size=(10, 3)).astype(np.float32)
    reference = expected.project(points.astype(np.float64))[0]
    for array in (
        points.astype(">f4"),
        points.tolist(),
        np.asfortranarray(points),
        np.repeat(points, 2, 0)[::2],
    ):
        np.testing.assert_array_equal(expected.project(array)[0], reference)
    assert expected.project(np.zeros((0, 3)))[0].shape == (0, 2)
    assert expected.rays(np.zeros((0, 2)))[1].shape == (0, 3)


def test_cameras_support_equality_hash_pickle_and_copy() -> None:
    rng = np.random.default_rng(9)
    camera = random_camera(rng)
    cameras = [
        camera,
        raycam.Camera.from_matrix(camera.P, SIZE),
        raycam.Camera.from_pose([1, 2, 3], 4, 5, 6, fov=50, up="y"),
        raycam.Camera.look_at([1, 2, 3], [0, 0, 0]),
        raycam.Camera.from_opencv(camera.K, [0.1, 0.2, 0.3], [1, 2, 3], SIZE),
        raycam.Camera.from_opengl(camera.K, np.eye(4), SIZE, pixel_center="half"),
    ]
    for one in cameras:
        again = pickle.loads(pickle.dumps(one))
        assert again == one
        assert hash(again) == hash(one)
        assert copy.deepcopy(one) == one
        assert sum(one == other for other in cameras) == 1
    assert camera != "camera"


def test_repr_of_a_camera_shows_its_values() -> None:
    text = repr(raycam.Camera.look_at([4, -6, 3], [0, 0, 0], size=(64, 48)))
    for part in ("64 x 48", "K =", "R =", "C = [ 4. -6.  3.]", "22.5885", "123.69", "integer"):
        assert part in text
