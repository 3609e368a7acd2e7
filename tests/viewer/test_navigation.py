"""Navigation: what stays where, for every kind of camera."""

from __future__ import annotations

import math

import numpy as np
import pytest
import raycam
from hypothesis import given
from hypothesis import strategies as st
from raycam.viewer.scene import navigation

PIVOT = np.array([0.2, -0.1, 0.4])
PLACE = {"size": (64, 48), "fov": 50}


def pinhole(up: str = "z") -> raycam.Camera:
    eye = [4, -3, 2] if up == "z" else [4, 2, 3]
    return raycam.Camera.look_at(eye, PIVOT, up, **PLACE)


CAMERAS = {
    "z up": pinhole(),
    "y up": pinhole("y"),
    "opencv": raycam.Camera.look_at([4, -3, 2], PIVOT, distortion=[-0.2, 0.05, 0, 0], **PLACE),
    "fisheye": raycam.Camera.look_at([4, -3, 2], PIVOT, distortion=[0.1, 0, 0, 0], model="fisheye", **PLACE),
}
cameras = pytest.mark.parametrize("camera", CAMERAS.values(), ids=CAMERAS)
ANGLES = st.floats(-2, 2)


def is_pose(camera: raycam.Camera) -> bool:
    return np.allclose(camera.R @ camera.R.T, np.eye(3), atol=1e-12) and np.linalg.det(camera.R) > 0


@cameras
@given(yaw=ANGLES, pitch=ANGLES)
def test_orbits_keep_the_pivot_at_its_pixel_and_distance(
    camera: raycam.Camera, yaw: float, pitch: float
) -> None:
    turned = navigation.orbit(camera, PIVOT, yaw, pitch)
    assert is_pose(turned)
    assert np.allclose(turned.project(PIVOT)[0], camera.project(PIVOT)[0], atol=1e-6)
    assert np.linalg.norm(turned.C - PIVOT) == pytest.approx(np.linalg.norm(camera.C - PIVOT))


@cameras
@given(pitch=st.floats(-10, 10))
def test_the_horizon_stays_level(camera: raycam.Camera, pitch: float) -> None:
    turned = navigation.orbit(camera, PIVOT, 0.3, pitch)
    axis = 2 if camera.up == "z" else 1
    assert abs(turned.R[0, axis]) < 1e-9
    assert turned.R[1, axis] < 0
    assert abs(turned.forward[axis]) <= math.sin(navigation.STEEPEST) + 1e-9


@cameras
def test_looking_keeps_the_centre(camera: raycam.Camera) -> None:
    turned = navigation.turn_camera(camera, 0.5, 0.1)
    assert is_pose(turned)
    assert np.array_equal(turned.C, camera.C)
    assert not np.allclose(turned.forward, camera.forward)


@cameras
@given(factor=st.floats(0.1, 10))
def test_coming_nearer_keeps_the_point_under_the_cursor(camera: raycam.Camera, factor: float) -> None:
    point = np.array([0.5, 0.3, 0.1])
    near = navigation.dolly(camera, point, factor)
    assert np.allclose(near.project(point)[0], camera.project(point)[0], atol=1e-6)
    assert np.linalg.norm(near.C - point) == pytest.approx(np.linalg.norm(camera.C - point) / factor)


def test_panning_moves_the_pivot_by_pixels() -> None:
    camera = pinhole()
    moved = navigation.pan(camera, PIVOT, 5, -3)
    assert np.allclose(moved.project(PIVOT)[0] - camera.project(PIVOT)[0], [5, -3])
    assert np.array_equal(moved.R, camera.R)


def test_moving_goes_along_right_up_and_forward() -> None:
    camera = pinhole()
    moved = navigation.move(camera, 1, 2, 3)
    assert np.allclose(moved.C - camera.C, camera.R[0] + [0, 0, 2] + 3 * camera.forward)


def test_rolling_turns_about_the_principal_axis() -> None:
    camera = pinhole()
    rolled = navigation.roll(camera, math.radians(30))
    assert is_pose(rolled)
    assert np.allclose(rolled.forward, camera.forward)
    assert abs(rolled.roll_pitch_yaw[0] - camera.roll_pitch_yaw[0]) == pytest.approx(30)


@cameras
def test_fitting_shows_the_whole_box(camera: raycam.Camera) -> None:
    bounds = np.array([[-3, -1, 0], [2, 5, 4]])
    fitted = navigation.fit(camera, bounds)
    corners = np.array(
        [[bounds[i, 0], bounds[j, 1], bounds[k, 2]] for i in (0, 1) for j in (0, 1) for k in (0, 1)]
    )
    pixels, visible = fitted.project(corners)
    assert visible.all()
    assert (pixels >= camera.corner).all()
    assert (pixels <= np.array(camera.size) + camera.corner).all()


def test_parallel_cameras_are_fitted_in_front_of_the_box() -> None:
    camera = raycam.Camera.orthographic([4, -3, 2], target=[0, 0, 0], size=(64, 48), height=4)
    fitted = navigation.fit(camera, np.array([[-1, -1, -1], [1, 1, 1]]))
    assert ((np.zeros(3) - fitted.location) @ fitted.forward) > 0
