"""Flow against reprojection by NumPy, closed forms and itself backwards."""

from __future__ import annotations

import numpy as np
import pytest
import raycam
from raycam.flow import disparity, flow

SIZE = (160, 120)


def room() -> raycam.World:
    """A floor, a box that slides and turns, a ball that hides a part of it."""
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
def test_flow_is_reprojection(distortion: list[float] | None) -> None:
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
    # What hides a point is found by the rays of the world itself.
    hits = later.cast_rays(second.C, moved - second.C)
    clear = (np.abs(hits["t"] - 1) < 1e-4) | (hits["t"] > 1)
    hidden = (hits["t"] < 1 - 1e-4) & inside
    assert found["occluded"][seen][hidden].all()
    assert not found["occluded"][seen][clear].any()
    assert 50 < hidden.sum() < 0.3 * len(hidden)


def test_forward_and_backward_agree() -> None:
    world = room()
    later = world.at(0.5)
    first, second = eye(), eye(0.2)
    forward = flow(world, first, later, second)
    fine = np.isfinite(forward["flow"][..., 0]) & ~forward["occluded"] & ~forward["outside"]
    assert fine.sum() > 5000
    for index in np.random.default_rng(1).choice(fine.sum(), 40, replace=False):
        row, column = (axis[index] for axis in np.nonzero(fine))
        target = np.array([column, row]) + forward["flow"][row, column].astype(np.float64)
        # A second camera whose picture is shifted by a part of a pixel has a centre where the point went.
        x, y = np.rint(target).astype(int)
        shift = np.zeros((3, 3))
        shift[:2, 2] = [x, y] - target
        moved = raycam.Camera(second.K + shift, second.R, second.C, SIZE)
        if not (0 <= x < SIZE[0] and 0 <= y < SIZE[1]):
            continue
        back = flow(later, moved, world, first)
        assert np.abs(back["flow"][y, x] - ([column, row] - np.array([x, y]))).max() < 1e-3
        assert not back["occluded"][y, x]


def test_nothing_moves_where_nothing_moves() -> None:
    world = room()
    found = flow(world, eye())
    seen = np.isfinite(found["depth"])
    assert 0 < seen.sum() < seen.size
    assert np.abs(found["flow"][seen]).max() < 1e-6
    assert np.abs(found["scene_flow"][seen]).max() < 1e-6
    assert not found["occluded"].any()
    assert not found["outside"].any()


def test_what_is_behind_the_second_camera_has_no_flow() -> None:
    world = raycam.World()
    world.add_object(plane={"size": [100, 100]})
    first = raycam.Camera.look_at([0, 0, 1], [10, 0, 0], size=SIZE)
    second = raycam.Camera.look_at([0, 0, 1], [-10, 0, 0], size=SIZE)
    found = flow(world, first, world, second)
    assert np.isnan(found["flow"]).all()
    seen = np.isfinite(found["depth"])
    assert seen.any()
    np.testing.assert_array_equal(found["outside"], seen)


def test_disparity_is_focal_length_times_baseline_over_depth() -> None:
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
    with pytest.raises(raycam.CameraError, match="not a rectified pair, because of the baseline"):
        disparity(world, right, left)
    with pytest.raises(raycam.CameraError, match="different rotations"):
        disparity(world, left, eye(0.1))


def test_worlds_must_be_of_the_same_triangles() -> None:
    world = room()
    other = room()
    other.add_object(box={"size": 1})
    with pytest.raises(raycam.WorldError, match="3 objects, the second 4"):
        flow(world, eye(), other)
    other = raycam.World()
    for _ in range(3):
        other.add_object(box={"size": 1})
    with pytest.raises(raycam.WorldError, match=r"object 0 has \d+ triangles"):
        flow(world, eye(), other)
