"""Navigation: what stays where, for every kind of camera."""

from __future__ import annotations

import math

import numpy as np
import pytest
import raycam
from hypothesis import given
from hypothesis import strategies as st
from raycam.viewer import probe
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


def steps_at(x: float) -> float:
    """The height of the ground of `stairs` at x: steps of 0.2 m, then nothing."""
    return 0.2 * math.floor(x) if 0 <= x < 5 else math.nan


def stairs(up: str) -> raycam.World:
    """Boxes along x, each higher than the one before."""
    world = raycam.World(up=up)
    for i in range(5):
        height = 0.2 * i + 1
        middle, size = [i + 0.5, 0, height / 2 - 1], [1, 4, height]
        if up == "y":
            middle, size = ([each[0], each[2], -each[1]] for each in (middle, size))
        world.add_object(box={"size": np.abs(size).tolist()}, location=middle)
    return world


@pytest.mark.parametrize("pitch", [-90, -30, 0, 60, 90])
@pytest.mark.parametrize("up", ["z", "y"])
def test_a_walk_keeps_the_height_of_the_eyes_on_stairs(up: str, pitch: float) -> None:
    world, axis = stairs(up), 2 if up == "z" else 1
    upwards, angle = np.eye(3)[axis], math.radians(pitch)
    right = np.cross([1, 0, 0], upwards)
    forward = np.array([math.cos(angle), 0, 0]) + math.sin(angle) * upwards
    ahead = np.array([right, np.cross(forward, right), forward])
    camera = pinhole(up).at_pose(ahead, [0.4, 0.3, 0.3] + (1.6 - 0.3) * upwards)

    def below(place: np.ndarray) -> float | None:
        return probe.ground_below(world, camera, place, 0.01)

    for i in range(1, 10):
        camera = navigation.walk(camera, 0, 0, 0.4, below)
        assert camera.location[0] == pytest.approx(0.4 + 0.4 * i)
        assert camera.location[axis] == pytest.approx(1.6 + steps_at(camera.location[0] + 0.01), abs=1e-5)
        assert np.allclose(camera.R, ahead, atol=1e-12)
    camera = navigation.walk(camera, 0, 0.5, 0, below)  # taller
    high = camera.location[axis]
    camera = navigation.walk(camera, 0, 0, -2, below)
    assert camera.location[axis] == pytest.approx(high - 0.4, abs=1e-5)
    beside = navigation.walk(camera, 0.2, 0, 0, below).location - camera.location
    assert beside == pytest.approx(0.2 * camera.R[0], abs=1e-6)


def test_a_walk_stays_level_where_there_is_no_ground_and_over_cracks() -> None:
    world = stairs("z")
    camera = raycam.Camera.look_at([4.5, 0, 2.4], [9, 0, 2.4], size=(64, 48), fov=60)

    def below(place: np.ndarray) -> float | None:
        return probe.ground_below(world, camera, place, 0.1)

    away = navigation.walk(camera, 0, 0, 5, below)
    assert below(away.location) is None
    assert away.location == pytest.approx([9.5, 0, 2.4])
    assert navigation.walk(away, 0, 0, -5, below).location == pytest.approx([4.5, 0, 2.4])
    # 5 cm between two floors, and a cellar far below.
    boards = raycam.World()
    for y in (-1.025, 1.025):
        boards.add_object(box={"size": [2, 2, 0.1]}, location=[0, y, -0.05])
    boards.add_object(box={"size": [9, 9, 1]}, location=[0, 0, -9])
    assert probe.ground_below(boards, camera, np.array([0, 0, 1.5]), 0.1) == pytest.approx(1.5)
    assert probe.ground_below(boards, camera, np.array([0, 0, 1.5]), 0.01) == pytest.approx(10)


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
