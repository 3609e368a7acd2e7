"""Optical flow, compared with reprojection in NumPy, closed forms and the backward flow."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import raycam
import scipy.optimize
from raycam.annotations.flow import disparity, flow
from scipy.spatial.transform import Rotation, Slerp
from support.bending_plate import FACES, bending_plate, plate_at
from support.raises import raises

SIZE = (160, 120)


def room() -> raycam.World:
    """A floor, a box that slides and turns, and a ball that hides a part of the box."""
    world = raycam.World()
    world.add_object(plane={"size": [9, 9]}, name="floor")
    world.add_object(box={"size": [1, 1.5, 0.8]}, name="box", location=[0.3, 0.2, 0.4])
    world.add_object(sphere={"radius": 0.4}, name="ball", location=[1.2, -0.4, 0.5])
    world.set_video(
        fps=10,
        seconds=1,
        keyframe=[
            {"time": 0, "object": "box", "location": [0.3, 0.2, 0.4]},
            {"time": 1, "object": "box", "location": [-0.2, 0.5, 0.9], "roll": 10, "yaw": 40},
        ],
    )
    return world


def eye(shift: float = 0.0, **options: object) -> raycam.Camera:
    return raycam.Camera.look_at([4 + shift, -3 + shift, 2.5], [0, 0, 0.4], size=SIZE, fov=40, **options)


@pytest.mark.parametrize("distortion", [None, [-0.2, 0.05, 0.001, -0.002]])
def test_flow_equals_reprojection_by_numpy(distortion: list[float] | None) -> None:
    world = room()
    later = world.at(0.7)
    first, second = eye(distortion=distortion), eye(0.3, distortion=distortion, pixel_center="half")
    found = flow(world, first, later, second)
    frame = raycam.render(world, first, samples=1, channels=["position", "instance", "depth"])
    seen = frame["instance"] >= 0
    moves = np.stack(
        [b.matrix @ np.linalg.inv(a.matrix) for a, b in zip(world.objects, later.objects, strict=True)]
    )
    points = np.concatenate([frame["position"][seen], np.ones((seen.sum(), 1))], axis=1)
    moved = np.einsum("nij,nj->ni", moves[frame["instance"][seen]], points)[:, :3]
    pixels, in_front = second.project(moved)
    assert in_front.all()
    row, column = np.nonzero(seen)
    expected = pixels - 0.5 - np.stack([column, row], axis=1)
    assert np.abs(found["flow"][seen] - expected).max() < 1e-4
    assert np.abs(found["scene_flow"][seen] - (moved - points[:, :3])).max() < 1e-6
    assert np.abs(found["scene_flow"][frame["instance"] == 1]).max() > 0.3
    np.testing.assert_allclose(found["depth"][seen], (moved - second.C) @ second.forward, rtol=1e-6)
    assert np.isnan(found["flow"][~seen]).all()
    inside = ((pixels >= 0) & (pixels < SIZE)).all(axis=1)
    np.testing.assert_array_equal(found["outside"][seen], ~inside)
    # Rays cast in the later world show which points are occluded.
    hits = later.cast_rays(second.C, moved - second.C)
    clear = (np.abs(hits["t"] - 1) < 1e-4) | (hits["t"] > 1)
    hidden = (hits["t"] < 1 - 1e-4) & inside
    assert found["occluded"][seen][hidden].all()
    assert not found["occluded"][seen][clear].any()
    assert 50 < hidden.sum() < 0.3 * len(hidden)


def test_forward_and_backward_flow_agree() -> None:
    world = room()
    later = world.at(0.5)
    first, second = eye(), eye(0.2)
    forward = flow(world, first, later, second)
    fine = np.isfinite(forward["flow"][..., 0]) & ~forward["occluded"] & ~forward["outside"]
    assert fine.sum() > 5000
    for index in np.random.default_rng(1).choice(fine.sum(), 40, replace=False):
        row, column = (axis[index] for axis in np.nonzero(fine))
        target = np.array([column, row]) + forward["flow"][row, column].astype(np.float64)
        # A second camera, shifted by a fraction of a pixel, has a pixel centre at the point's new position.
        x, y = np.rint(target).astype(int)
        shift = np.zeros((3, 3))
        shift[:2, 2] = [x, y] - target
        moved = raycam.Camera(second.K + shift, second.R, second.C, SIZE)
        if not (0 <= x < SIZE[0] and 0 <= y < SIZE[1]):
            continue
        back = flow(later, moved, world, first)
        assert np.abs(back["flow"][y, x] - ([column, row] - np.array([x, y]))).max() < 1e-3
        assert not back["occluded"][y, x]


def test_flow_is_zero_without_motion() -> None:
    world = room()
    found = flow(world, eye())
    seen = np.isfinite(found["depth"])
    assert 0 < seen.sum() < seen.size
    assert np.abs(found["flow"][seen]).max() < 1e-6
    assert np.abs(found["scene_flow"][seen]).max() < 1e-6
    assert not found["occluded"].any()
    assert not found["outside"].any()


def test_points_behind_the_second_camera_have_no_flow() -> None:
    world = raycam.World()
    world.add_object(plane={"size": [100, 100]})
    first = raycam.Camera.look_at([0, 0, 1], [10, 0, 0], size=SIZE)
    second = raycam.Camera.look_at([0, 0, 1], [-10, 0, 0], size=SIZE)
    found = flow(world, first, world, second)
    assert np.isnan(found["flow"]).all()
    seen = np.isfinite(found["depth"])
    assert seen.any()
    np.testing.assert_array_equal(found["outside"], seen)


def test_disparity_equals_focal_length_times_baseline_over_depth() -> None:
    world = room()
    left = eye()
    shifted = left.K + np.array([[0, 0, 7.5], [0, 0, 0], [0, 0, 0]])
    right = raycam.Camera(shifted, left.R, left.C + 0.4 * left.R[0], SIZE)
    found = disparity(world, left, right)
    depth = raycam.render(world, left, samples=1, channels=["depth"])["depth"].astype(np.float64)
    seen = np.isfinite(depth)
    expected = left.K[0, 0] * 0.4 / depth[seen] - 7.5
    assert np.abs(found["disparity"][seen] - expected).max() < 1e-4
    assert np.isnan(found["disparity"][~seen]).all()
    assert found["occluded"].any()
    assert found["outside"].any()
    with raises(raycam.CameraError, code="unsupported_camera"):
        disparity(world, right, left)
    with raises(raycam.CameraError, code="unsupported_camera"):
        disparity(world, left, eye(0.1))


def test_flow_requires_equal_objects_and_triangles() -> None:
    world = room()
    other = room()
    other.add_object(box={"size": 1})
    with raises(raycam.WorldError, code="invalid_world", mentions=["3", "4"]):
        flow(world, eye(), other)
    other = raycam.World()
    for _ in range(3):
        other.add_object(box={"size": 1})
    with raises(raycam.WorldError, code="invalid_world", mentions=["12"]):
        flow(world, eye(), other)


def test_flow_follows_skins_and_morph_targets(tmp_path: Path) -> None:
    world = bending_plate(tmp_path)
    first, later = world.at(0.2), world.at(0.7)
    np.testing.assert_allclose(later.triangles(), plate_at(0.7)[FACES], atol=1e-6)
    one = raycam.Camera.look_at(
        [1, 2, 6], [0, 1, 0], [0, 1, 0], size=SIZE, fov=30, distortion=[-0.1, 0.02, 0, 0]
    )
    two = raycam.Camera.look_at([2, 1, 6], [0.3, 1, 0], [0, 1, 0], size=SIZE, fov=30)
    found = flow(first, one, later, two)
    frame = raycam.render(first, one, samples=1, channels=["triangle", "barycentric"])
    seen = frame["triangle"] >= 0
    assert seen.sum() > 1500
    corners = FACES[frame["triangle"][seen]]
    weights = frame["barycentric"][seen].astype(np.float64)[..., None]
    before, after = ((plate_at(time)[corners] * weights).sum(axis=1) for time in (0.2, 0.7))
    row, column = np.nonzero(seen)
    moved = two.project(after)[0] - np.column_stack([column, row])
    assert np.abs(found["flow"][seen] - moved).max() < 1e-3
    assert np.abs(found["scene_flow"][seen] - (after - before)).max() < 1e-5
    assert np.linalg.norm(moved, axis=1).max() > 20
    # The second image shows the same triangle at the point's new position, unless the point is hidden there.
    there = raycam.render(later, two, samples=1, channels=["triangle", "depth"])
    place = np.rint(moved + np.column_stack([column, row])).astype(int)
    clear = ~found["occluded"][seen] & ~found["outside"][seen]
    x, y = place[clear].clip(0, np.array(SIZE) - 1).T
    same = there["triangle"][y, x] == frame["triangle"][seen][clear]
    assert same.mean() > 0.95  # only pixels at triangle edges differ
    np.testing.assert_allclose(there["depth"][y, x][same], found["depth"][seen][clear][same], rtol=0.01)


def test_flow_of_a_bending_plate_and_its_flow_back_sum_to_zero(tmp_path: Path) -> None:
    world = bending_plate(tmp_path)
    first, later = world.at(0.2), world.at(0.7)
    camera = raycam.Camera.look_at([1, 2, 6], [0.2, 1, 0], [0, 1, 0], size=SIZE, fov=30)
    forward = flow(first, camera, later, camera)
    fine = np.isfinite(forward["flow"][..., 0]) & ~forward["occluded"] & ~forward["outside"]
    rows, columns = (axis[:: fine.sum() // 20] for axis in np.nonzero(fine))
    for row, column in zip(rows, columns, strict=True):
        target = np.array([column, row]) + forward["flow"][row, column].astype(np.float64)
        x, y = np.rint(target).astype(int)
        if not (0 <= x < SIZE[0] and 0 <= y < SIZE[1]):
            continue
        shift = np.zeros((3, 3))
        shift[:2, 2] = [x, y] - target
        moved = raycam.Camera(camera.K + shift, camera.R, camera.C, SIZE)
        back = flow(later, moved, first, camera)
        assert np.abs(back["flow"][y, x] - ([column, row] - np.array([x, y]))).max() < 1e-3


SPEED = np.array([0.9, -0.4, 0.6])


def sliding() -> raycam.World:
    """A moving box, a ball that hides a part of it, and a static wall.

    The given positions apply at 0.5 s.
    """
    world = raycam.World()
    world.add_object(box={"size": 1}, name="box", location=[0, 0, 5])
    world.add_object(sphere={"radius": 0.3}, name="ball", location=[0.4, 0.1, 3.5])
    world.add_object(box={"size": [9, 9, 0.1]}, location=[0, 0, 7])
    keys = [
        {"time": t, "object": name, "location": (np.array(at) + sign * (t - 0.5) * SPEED).tolist()}
        for t in (0, 1)
        for name, at, sign in (("box", [0, 0, 5], 1), ("ball", [0.4, 0.1, 3.5], -1))
    ]
    world.set_video(seconds=1, interpolation="linear", keyframe=keys)
    return world


VELOCITIES = np.array([SPEED, -SPEED, [0.0, 0.0, 0.0]])
EYE = raycam.Camera([[90, 0, 59.5], [0, 90, 39.5], [0, 0, 1]], np.eye(3), [0.3, 0.2, 0], (120, 80))


def seen_by(camera: raycam.Camera) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """The visible points, their velocities, rows and columns.

    The camera reads its rows from 0.3 s to 0.7 s.
    """
    frame = raycam.render(sliding().at(0.5), camera, samples=1, channels=["position", "instance"])
    seen = frame["instance"] >= 0
    row, column = np.nonzero(seen)
    return frame["position"][seen], VELOCITIES[frame["instance"][seen]], row, column


def test_flow_from_a_rolling_shutter_image_equals_the_formula_of_the_motion() -> None:
    """The motion's formula gives the shift of each point from its line's time to the later time."""
    world = sliding()
    rolling = EYE.exposing(0.05, readout=0.4)
    found = flow(world.at(0.5), rolling, world.at(0.9), EYE)
    points, speed, row, column = seen_by(rolling)
    time = 0.5 + 0.4 * ((row + 0.5) / 80 - 0.5)
    moves = (0.9 - time)[:, None] * speed
    pixels, _ = EYE.project(points + moves)
    assert np.abs(found["flow"][row, column] - (pixels - np.column_stack([column, row]))).max() < 1e-3
    assert np.abs(found["scene_flow"][row, column] - moves).max() < 1e-5
    assert flow(world, EYE, world, rolling)["flow"].shape == (80, 120, 2)  # a static world


@pytest.mark.parametrize("direction", ["down", "up", "right", "left"])
@pytest.mark.parametrize("moving", [False, True])
def test_flow_to_rolling_shutter_equals_scipy(direction: raycam.camera._optics.Readout, moving: bool) -> None:
    """SciPy finds the line that shows a point.

    The point's position depends on the line's time, and the line on the position.
    """
    world = sliding()
    rolling = EYE.exposing(0.05, readout=0.4, direction=direction)
    if moving:
        turn = Rotation.from_euler("yz", [3, -4], degrees=True).as_matrix()
        rolling = EYE.moving(
            EYE.at_pose(turn, [0.2, 0.1, 0.2]), exposure=0.05, readout=0.4, direction=direction
        )
    found = flow(world.at(0.3), EYE, world.at(0.5), rolling)
    frame = raycam.render(world.at(0.3), EYE, samples=1, channels=["position", "instance"])
    there = raycam.render(world.at(0.5), rolling, samples=1, channels=["position", "instance"])
    hidden = 0
    for row, column in np.random.default_rng(0).integers([80, 120], size=(150, 2)):
        number = frame["instance"][row, column]
        if number < 0:
            continue
        point, speed = frame["position"][row, column], VELOCITIES[number]

        def at(line: float, point: np.ndarray = point, speed: np.ndarray = speed) -> np.ndarray:
            return point + (0.5 + 0.4 * (line - 0.5) - 0.3) * speed

        def off(line: float) -> float:
            pixel = shown_on(line, rolling, at(line))
            across = (pixel + 0.5) / [120, 80]
            share = across[1 if direction in ("down", "up") else 0]
            return float((1 - share if direction in ("up", "left") else share) - line)

        if off(0.0) <= 0 or off(1.0) >= 0:
            assert found["outside"][row, column]
            continue
        line = scipy.optimize.brentq(off, 0, 1, xtol=1e-14)
        pixel = shown_on(line, rolling, at(line))
        assert np.abs(found["flow"][row, column] - (pixel - [column, row])).max() < 1e-3
        x, y = np.rint(pixel).astype(int)
        if found["outside"][row, column] or not (0 <= x < 120 and 0 <= y < 80):
            continue
        same = np.linalg.norm(there["position"][y, x] - at(line)) < 0.1
        hidden += int(found["occluded"][row, column])
        # The nearest pixel shows the point or its occluder, except at edges.
        edge = there["instance"][max(y - 1, 0) : y + 2, max(x - 1, 0) : x + 2]
        if (edge == edge[0, 0]).all():
            assert same != found["occluded"][row, column]
    assert hidden > 1


def shown_on(line: float, camera: raycam.Camera, point: np.ndarray) -> np.ndarray:
    """The point's pixel at the time when the given line is half exposed.

    `line` is a fraction of the image, from 0 for the first line to 1 for the last line.
    """
    track = camera.shutter["track"] if camera.shutter is not None else []
    if len(track) < 2:
        return np.asarray(camera.still().project(point)[0])
    time = 0.4 * line + 0.025
    (start, first), (end, last) = ((key["time"], key["pose"]) for key in (track[0], track[-1]))
    part = (time - start) / (end - start)
    turns = Slerp([0, 1], Rotation.from_matrix([first["R"], last["R"]]))
    center = np.array(first["C"]) + part * (np.array(last["C"]) - first["C"])
    return np.asarray(EYE.at_pose(turns(part).as_matrix(), center).project(point)[0])


def test_flow_follows_a_deforming_mesh_to_a_rolling_shutter_image(tmp_path: Path) -> None:
    world = bending_plate(tmp_path)
    camera = raycam.Camera.look_at([1, 2, 6], [0.3, 1, 0], [0, 1, 0], size=SIZE, fov=30)
    rolling = camera.exposing(0.01, readout=0.2)
    found = flow(world.at(0.2), camera, world.at(0.5), rolling)
    frame = raycam.render(world.at(0.2), camera, samples=1, channels=["triangle", "barycentric"])
    height = SIZE[1]
    rows, columns = np.nonzero(frame["triangle"] >= 0)
    for row, column in list(zip(rows, columns, strict=True))[:: len(rows) // 60]:
        corners = FACES[frame["triangle"][row, column]]
        weights = frame["barycentric"][row, column].astype(np.float64)

        def shown(line: float, corners: np.ndarray = corners, weights: np.ndarray = weights) -> np.ndarray:
            point = weights @ plate_at(0.5 + 0.2 * (line - 0.5))[corners]
            return np.asarray(camera.project(point)[0])

        def off(line: float) -> float:
            return float((shown(line)[1] + 0.5) / height - line)

        pixel = shown(scipy.optimize.brentq(off, -0.2, 1.2, xtol=1e-14))
        if found["outside"][row, column]:
            continue
        assert np.abs(found["flow"][row, column] - (pixel - [column, row])).max() < 1e-3
        if not found["occluded"][row, column]:
            assert np.isfinite(found["depth"][row, column])
    assert np.isfinite(flow(world.at(0.5), rolling, world.at(0.2), camera)["flow"]).any()


def test_flow_to_a_rolling_shutter_image_limits_the_number_of_objects() -> None:
    def world(count: int) -> raycam.World:
        world = raycam.World()
        for number in range(count):
            place = [0.1 * (number % 50), 0.1 * (number // 50), 5]
            world.add_object(box={"size": 0.05}, name=f"b{number}", location=place)
        keys = [{"time": t, "object": "b7", "location": [0.7 + t, 0, 5]} for t in (0, 1)]
        world.set_video(seconds=1, interpolation="linear", keyframe=keys)
        return world

    camera = raycam.Camera([[60, 0, 10], [0, 60, 10], [0, 0, 1]], np.eye(3), [0, 0, 0], (40, 24))
    rolling = camera.exposing(0, readout=0.2)
    many = world(300)
    found = flow(many.at(0.5), camera, many.at(0.5), rolling)
    seen = np.isfinite(found["flow"][..., 0])
    assert seen.any()
    tall = raycam.Camera([[60, 0, 10], [0, 60, 10], [0, 0, 1]], np.eye(3), [0, 0, 0], (4, 1 << 15)).exposing(
        0, readout=0.2
    )
    with raises(raycam.WorldError, code="invalid_world", mentions=["32768", "300"]):
        flow(many.at(0.5), camera, many.at(0.5), tall)
