"""Keypoints compared with NumPy, with SciPy's solutions for motion, and with images."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import raycam
import scipy.optimize
from raycam.annotations.keypoints import keypoints
from raycam.camera._optics import Readout
from scipy.spatial.transform import Rotation, Slerp
from support.bending_plate import FACES, bending_plate, plate_at
from support.raises import Fault, fault, raises
from support.three_lenses import SIZE, cameras


def crates() -> raycam.World:
    world = raycam.World()
    world.add_object(plane={"size": [9, 9]}, name="floor")
    world.add_object(box={"size": [1, 1.5, 0.8]}, location=[0.3, 0.2, 0.4], yaw=20)
    world.add_object(sphere={"radius": 0.4}, location=[1.2, -0.4, 0.5])
    return world


@pytest.mark.parametrize("name", cameras())
def test_keypoints_move_with_their_object(name: str) -> None:
    camera = cameras()[name]
    rng = np.random.default_rng(2)
    # Points on the faces of the box, in its own coordinates, and a point behind the camera.
    points = rng.uniform(-0.5, 0.5, (200, 3))
    points[np.arange(200), np.arange(200) % 3] = rng.choice([-0.5, 0.5], 200)
    points *= [1, 1.5, 0.8]
    found = keypoints(crates(), camera, points, [1] * 200, tolerance=1e-6)
    angle = np.radians(20)
    turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    np.testing.assert_allclose(found.points, points @ turn.T + [0.3, 0.2, 0.4])
    pixels, _ = camera.project(found.points)
    np.testing.assert_array_equal(found.pixels, pixels)
    assert found.visible.any()
    assert {-1, 1, 2} <= set(found.occluder)
    # A face that is turned away from the camera is hidden by the box itself, or by an object in front of the box.
    normals = np.zeros((200, 3))
    normals[np.arange(200), np.arange(200) % 3] = np.sign(points[np.arange(200), np.arange(200) % 3])
    away = ((camera.C - found.points) * (normals @ turn.T)).sum(axis=1) < 0
    assert not found.visible[away].any()
    assert set(found.occluder[~away]) <= {-1, 2}
    behind = keypoints(crates(), camera, [camera.C - camera.forward, [50, 50, 0.0]])
    if name == "pinhole":
        assert np.isnan(behind.pixels[0]).all()
    assert not behind.visible.any()
    assert (behind.occluder == -1).all()
    with raises(raycam.SettingsError, code="wrong_shape", mentions=["objects", "1", "2"]):
        keypoints(crates(), camera, [[0, 0, 0], [1, 1, 1]], [0])


def test_keypoints_off_the_surface_are_not_on_surface() -> None:
    world = raycam.World()
    world.add_object(box={"size": [9, 9, 1]}, location=[0, 0, 5.5])
    world.add_object(box={"size": 0.2}, location=[0, 0, 2])
    camera = raycam.Camera(np.diag([40.0, 40, 1]), np.eye(3), [-1, 0, 0], (96, 64))
    points = [[0.5, 1, 5], [0.5, 1, 4], [0.0, 0, 1.9], [0.0, 0, 2], [0.01, 0.02, 5.5], [99, 0, 5]]
    found = keypoints(world, camera, points)
    assert found.on_surface.tolist() == [True, False, True, False, False, False]
    assert found.visible.tolist() == [True, True, True, False, False, False]


EDGES = np.array([1.0, 0.8, 0.6])
START, END = np.array([-0.4, 0.2, 5.0]), np.array([0.5, -0.2, 5.6])
TURN = 70.0  # degrees per second about the world's z axis
EYE = raycam.Camera([[90, 0, 59.5], [0, 90, 39.5], [0, 0, 1]], np.eye(3), [0.1, 0.1, 0], (120, 80))
EXPOSURE, READOUT = 0.05, 0.4


def turning() -> raycam.World:
    """A sliding and turning box behind a ball that moves in the opposite direction.

    A static wall is behind both.
    """
    world = raycam.World()
    world.add_object(box={"size": EDGES.tolist()}, name="box", location=START.tolist())
    world.add_object(sphere={"radius": 0.3}, name="ball", location=[0.4, 0.1, 3.5])
    world.add_object(box={"size": [9, 9, 0.1]}, location=[0, 0, 7])
    keys = [
        {"time": 0, "object": "box", "location": START.tolist(), "yaw": 0},
        {"time": 1, "object": "box", "location": END.tolist(), "yaw": TURN},
        {"time": 0, "object": "ball", "location": [0.7, 0.1, 3.5]},
        {"time": 1, "object": "ball", "location": [-0.5, 0.2, 3.5]},
    ]
    world.set_video(seconds=1, interpolation="linear", keyframe=keys)
    return world


def box_at(points: np.ndarray, time: float) -> np.ndarray:
    """Points of the box, by the formula of its motion."""
    turned = Rotation.from_euler("z", TURN * time, degrees=True).apply(points)
    return np.asarray(turned + (1 - time) * START + time * END)


def shown_on(line: float, camera: raycam.Camera, still: raycam.Camera, point: np.ndarray) -> np.ndarray:
    """The point's pixel at the time when the given line is half exposed.

    `line` is a fraction of the image, from 0 for the first line to 1 for the last line. `still` is the camera
    at rest.
    """
    track = camera.shutter["track"] if camera.shutter is not None else []
    if len(track) < 2:
        return np.asarray(still.project(point)[0])
    time = READOUT * line + 0.5 * EXPOSURE
    (start, first), (end, last) = ((key["time"], key["pose"]) for key in (track[0], track[-1]))
    part = (time - start) / (end - start)
    turns = Slerp([0, 1], Rotation.from_matrix([first["R"], last["R"]]))
    center = np.array(first["C"]) + part * (np.array(last["C"]) - first["C"])
    return np.asarray(still.at_pose(turns(part).as_matrix(), center).project(point)[0])


def share(pixel: np.ndarray, size: tuple[int, int], direction: Readout) -> float:
    """The fraction of the image's lines that are read before this pixel's line."""
    across = ((pixel + 0.5) / size)[1 if direction in ("down", "up") else 0]
    return float(1 - across if direction in ("up", "left") else across)


@pytest.mark.parametrize("direction", ["down", "up", "right", "left"])
@pytest.mark.parametrize("eye", ["stands", "moves", "lens"])
def test_rolling_shutter_keypoints_of_a_moving_object_equal_scipy(direction: Readout, eye: str) -> None:
    """SciPy finds the line that shows a point.

    The point's position depends on the line's time, and the line on the position.
    """
    camera = EYE.exposing(EXPOSURE, readout=READOUT, direction=direction)
    if eye == "moves":
        turn = Rotation.from_euler("yz", [3, -4], degrees=True).as_matrix()
        there = EYE.at_pose(turn, [0.3, 0.2, 0.2])
        camera = EYE.moving(there, exposure=EXPOSURE, readout=READOUT, direction=direction)
    if eye == "lens":
        lens = raycam.Camera(EYE.K, EYE.R, EYE.C, EYE.size, distortion=[-0.2, 0.05, 0.002, 0.001])
        camera = lens.exposing(EXPOSURE, readout=READOUT, direction=direction)
    rng = np.random.default_rng(5)
    points = rng.uniform(-0.5, 0.5, (300, 3))
    points[np.arange(300), np.arange(300) % 3] = rng.choice([-0.5, 0.5], 300)
    points *= EDGES
    found = keypoints(turning().at(0.5), camera, points, [0] * 300)
    shown = raycam.render(turning().at(0.5), camera, samples=1, channels="instance")["instance"]
    judged, still = 0, camera.still()
    for i, point in enumerate(points):

        def off(line: float, point: np.ndarray = point) -> float:
            pixel = shown_on(line, camera, still, box_at(point, 0.5 + READOUT * (line - 0.5)))
            return share(pixel, camera.size, direction) - line

        if off(0.0) <= 0 or off(1.0) >= 0:
            assert not found.in_picture[i]
            continue
        line = scipy.optimize.brentq(off, 0, 1, xtol=1e-14)
        time = 0.5 + READOUT * (line - 0.5)
        pixel = shown_on(line, camera, still, box_at(point, time))
        if not ((pixel > -0.5) & (pixel < np.array(camera.size) - 0.5)).all():
            assert not found.in_picture[i]
            continue
        assert np.abs(found.pixels[i] - pixel).max() < 1e-9
        assert np.abs(found.points[i] - box_at(point, time)).max() < 1e-9
        x, y = np.rint(pixel).astype(int)
        around = shown[max(y - 1, 0) : y + 2, max(x - 1, 0) : x + 2]
        # If all surrounding pixels show one object, this object is also visible at the point.
        if (around == around[0, 0]).all():
            judged += 1
            assert (0 if found.visible[i] else found.occluder[i]) == around[0, 0]
    assert judged > 60
    assert {-1, 0, 1} == set(found.occluder[found.in_picture])
    standing = keypoints(turning().at(0.5), still, points, [0] * 300)
    assert np.nanmax(np.abs(standing.pixels - found.pixels)) > 0.1


def test_keypoints_of_a_deforming_mesh_follow_a_rolling_shutter(tmp_path: Path) -> None:
    world = bending_plate(tmp_path).at(0.5)
    camera = raycam.Camera.look_at([1, 2, 6], [0.3, 1, 0], [0, 1, 0], size=SIZE, fov=30)
    rolling = camera.exposing(0.01, readout=0.3)
    rng = np.random.default_rng(1)
    weights, triangles = rng.dirichlet([1, 1, 1], 40), rng.integers(0, len(FACES), 40)
    found = keypoints(world, rolling, weights, [0] * 40, triangles=triangles.tolist())
    assert found.in_picture.sum() > 30
    for i in np.flatnonzero(found.in_picture):

        def shown(line: float, i: int = i) -> np.ndarray:
            point = weights[i] @ plate_at(0.5 + 0.3 * (line - 0.5))[FACES[triangles[i]]]
            return np.asarray(camera.project(point)[0])

        line = scipy.optimize.brentq(lambda line: share(shown(line), SIZE, "down") - line, -1, 2, xtol=1e-14)
        assert np.abs(found.pixels[i] - shown(line)).max() < 1e-5  # the file contains float32 values


@pytest.mark.parametrize("direction", ["down", "left"])
def test_keypoints_at_pixel_centres_of_a_rolling_shutter_image_are_visible(
    tmp_path: Path, direction: Readout
) -> None:
    """Keypoints made from an image's triangles and weights are visible at the pixel centres."""
    channels = ["instance", "triangle", "barycentric", "position"]
    plate = bending_plate(tmp_path).at(0.4)
    eye = raycam.Camera.look_at([1, 2, 6], [0.3, 1, 0], [0, 1, 0], size=SIZE, fov=30)
    for world, still in ((plate, eye), (turning().at(0.5), EYE)):
        camera = still.exposing(0.02, readout=0.3, direction=direction)
        frame = raycam.render(world, camera, samples=1, channels=channels)
        seen = frame["instance"] >= 0
        found = keypoints(
            world,
            camera,
            frame["barycentric"][seen],
            frame["instance"][seen].tolist(),
            triangles=frame["triangle"][seen].tolist(),
        )
        row, column = np.nonzero(seen)
        assert np.abs(found.pixels - np.column_stack([column, row])).max() < 1e-4
        assert np.abs(found.points - frame["position"][seen]).max() < 1e-5
        assert found.visible.mean() > 0.999  # edges are excluded, because the weights are float32
        assert found.on_surface.mean() > 0.999


def test_barycentric_keypoints_are_placed_and_invalid_keypoints_are_refused(tmp_path: Path) -> None:
    world = crates()
    corners = world.triangles(1)
    found = keypoints(world, cameras()["lens"], [[0.2, 0.3, 0.5]], [1], triangles=[4])
    np.testing.assert_allclose(found.points[0], np.array([0.2, 0.3, 0.5]) @ corners[4], atol=1e-12)
    camera = cameras()["pinhole"]

    def refused(expected: Fault, world: raycam.World, *given: object, **keys: object) -> None:
        with raises(raycam.SettingsError, **expected):
            keypoints(world, camera, *given, **keys)

    refused(fault("invalid_settings", "point 1", "object 9"), world, [[0, 0, 0]] * 2, [0, 9])
    refused(fault("invalid_settings", "triangle 12", "object 1"), world, [[1, 0, 0]], [1], triangles=[12])
    refused(fault("invalid_settings", "[1, 0, 1]"), world, [[1, 0, 1]], [1], triangles=[1])
    refused(fault("wrong_shape", "triangles"), world, [[1, 0, 0]], triangles=[1])
    refused(fault("wrong_shape", "triangles", "2"), world, [[1, 0, 0]], [0], triangles=[1, 0])
    refused(fault("out_of_range", "objects", "-1"), world, [[1, 0, 0]], [-1])
    refused(fault("invalid_settings", "object 0"), bending_plate(tmp_path), [[0, 0, 0]], [0])


def test_parallel_cameras_find_occluders_in_front_of_a_keypoint() -> None:
    world = raycam.World()
    world.add_object(box={"size": 1}, name="far", location=[0, 0, 40])
    world.add_object(box={"size": 0.2}, name="near", location=[0, 0, -30])
    affine = raycam.Camera.from_matrix([[10, 0, 0, 20], [0, 10, 0, 20], [0, 0, 0, 1]], size=(40, 40))
    found = keypoints(world, affine, [[0, 0, 39.5], [0.4, 0, 39.5], [0.4, 0.4, 40]])
    assert found.occluder.tolist() == [1, -1, 0]
    assert found.on_surface.tolist() == [False, True, False]
