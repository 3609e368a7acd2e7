"""Lenses, compared with OpenCV."""

from __future__ import annotations

import copy
import pickle
from pathlib import Path
from typing import Any

import cv2
import mpmath
import numpy as np
import numpy.typing as npt
import pytest
import raycam
from support.points_seen import points_seen
from support.raises import raises

K = np.array([[535.9, 0, 342.3], [0, 530.1, 235.6], [0, 0, 1]])
SIZE = (640, 480)
RVEC, TVEC = np.array([0.3, -0.5, 0.2]), np.array([0.1, -0.2, 2.0])

OPENCV = [
    [-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05],
    [-0.2663726, -0.038588899, 0.0017831947, -0.00028122100, 0.23839153],
    [4.2, 1.9, 1e-4, -2e-4, 0.05, 4.5, 3.4, 0.4],
    [-0.2, 0.05, 1e-3, -1e-3, 0, 0.01, 0, 0, 2e-3, -1e-3, -3e-3, 1e-3],
    [-0.2, 0.05, 1e-3, -1e-3, 0, 0.01, 0, 0, 2e-3, -1e-3, -3e-3, 1e-3, 0.05, -0.08],
]
FISHEYE = [[0, 0, 0, 0], [-0.011602611404, 0.053990588928, -0.07542693755, 0.036663653163]]

# Calibrations of real cameras: OpenCV's left_intrinsics.yml, and EuRoC's cam0 with both models.
REAL = {
    "opencv": (
        [[535.91573, 0, 342.28315], [0, 535.91573, 235.57083], [0, 0, 1]],
        (640, 480),
        OPENCV[1],
        "opencv",
    ),
    "euroc": ([[458.654, 0, 367.215], [0, 457.296, 248.375], [0, 0, 1]], (752, 480), OPENCV[0], "opencv"),
    "euroc fisheye": (
        [[461.34185, 0, 366.4281], [0, 460.138857, 248.841557], [0, 0, 1]],
        (752, 480),
        FISHEYE[1],
        "fisheye",
    ),
}


@pytest.mark.parametrize("distortion", OPENCV, ids=len)
def test_project_agrees_with_opencv(distortion: list[float]) -> None:
    camera = raycam.Camera.from_opencv(K, RVEC, TVEC, SIZE, distortion)
    points = points_seen(camera, 160_000, 1)
    assert len(points) > 140_000
    expected = cv2.projectPoints(points, RVEC, TVEC, K, np.array(distortion))[0].reshape(-1, 2)
    pixels, seen = camera.project(points)
    assert seen.all()
    assert np.abs(pixels - expected).max() <= 1e-9


@pytest.mark.parametrize("distortion", FISHEYE)
def test_project_agrees_with_opencv_fisheye(distortion: list[float]) -> None:
    camera = raycam.Camera.from_opencv(K, RVEC, TVEC, SIZE, distortion, model="fisheye")
    points = points_seen(camera, 160_000, 2)
    assert len(points) > 140_000
    expected = cv2.fisheye.projectPoints(points[:, None], RVEC, TVEC, K, np.array(distortion, dtype=float))[0]
    pixels, seen = camera.project(points)
    assert seen.all()
    assert np.abs(pixels - expected.reshape(-1, 2)).max() <= 1e-9


@pytest.mark.parametrize("name", REAL)
def test_rays_and_projection_of_every_pixel_round_trip(name: str) -> None:
    k, size, distortion, model = REAL[name]
    camera = raycam.Camera(k, np.eye(3), [1, 2, 3], size, skew=0.7, distortion=distortion, model=model)
    assert camera.valid().all()
    origins, directions = camera.rays()
    pixels, seen = camera.project((origins + 5 * directions).reshape(-1, 3))
    u, v = np.meshgrid(np.arange(size[0]), np.arange(size[1]))
    assert seen.all()
    assert np.abs(pixels - np.stack([u, v], axis=-1).reshape(-1, 2)).max() <= 1e-9


def wall() -> raycam.World:
    """A wall at z = 2 whose colour changes at x = 0.3."""
    world = raycam.World()
    for name, x, color in (("left", -20.0, [1.0, 0, 0]), ("right", 0.3, [0, 1.0, 0])):
        corners = [[x, -20, 2], [x + 20.3, -20, 2], [x + 20.3, 20, 2], [x, 20, 2]]
        world.add_mesh(corners, [[0, 1, 2], [0, 2, 3]], name=name, color=color)
    return world


def test_pixels_beyond_the_fold_of_a_lens_are_invalid() -> None:
    camera = raycam.Camera(K, np.eye(3), np.zeros(3), SIZE, distortion=[-0.9, 0, 0, 0])
    valid = camera.valid()
    # r (1 - 0.9 r²) grows up to the radius sqrt(1 / 2.7), whose image is 2/3 of it.
    u, v = np.meshgrid(np.arange(640), np.arange(480))
    radius = np.hypot((u - K[0, 2]) / K[0, 0], (v - K[1, 2]) / K[1, 1])
    assert (valid == (radius < 2 / 3 * np.sqrt(1 / 2.7))).all()
    assert 0 < valid.sum() < valid.size
    frame = raycam.render(
        wall(), camera, integrator="flat", samples=1, channels=["color", "depth", "instance"]
    )
    assert ((frame["instance"] >= 0) == valid).all()
    assert np.isinf(frame["depth"][~valid]).all()
    pixel, seen = camera.project([2, 0, 2])
    assert not seen
    assert np.isnan(pixel).all()


RATIONAL = [
    [-0.25, 0.12, 0, 0, -0.05, 0.02, -0.01, 0.004],
    [-0.3, 0.1, 0.002, -0.001, -0.02, 0.05, 0.02, -0.005],
    [0.08, -0.15, 0.02, -0.03, 0.05, 0.9, 0.1, -0.2],
]


@pytest.mark.parametrize("distortion", RATIONAL)
def test_rays_near_the_fold_of_a_rational_lens_are_exact(distortion: list[float]) -> None:
    k = np.array([[60.0, 0, 100], [0, 61.0, 80], [0, 0, 1]])
    camera = raycam.Camera(k, np.eye(3), np.zeros(3), (200, 160), distortion=distortion, pixel_center="half")
    k1, k2, p1, p2, k3, k4, k5, k6 = map(mpmath.mpf, distortion)

    def factor(s: Any) -> Any:
        return (1 + s * (k1 + s * (k2 + s * k3))) / (1 + s * (k4 + s * (k5 + s * k6)))

    def image(x: Any, y: Any) -> npt.NDArray[Any]:
        s, g = x * x + y * y, factor(x * x + y * y)
        moved = 2 * p1 * x * y + p2 * (s + 2 * x * x), p1 * (s + 2 * y * y) + 2 * p2 * x * y
        return np.array([x * g + moved[0], y * g + moved[1]])

    v, u = np.mgrid[:160, :200] + 0.5
    wanted = np.dstack([(u - k[0, 2]) / k[0, 0], (v - k[1, 2]) / k[1, 1]])
    valid, rays = camera.valid(), camera.rays()[1]
    assert 1000 < valid.sum() < valid.size - 1000
    if p1 == p2 == 0:  # the distorted radius grows up to where its derivative is 0
        fold = mpmath.findroot(lambda r: mpmath.diff(lambda q: q * factor(q * q), r), 1.2)
        reach = float(fold * factor(fold**2))
        np.testing.assert_array_equal(valid, np.hypot(*np.moveaxis(wanted, 2, 0)) < reach)
    # The pixels with the largest errors are at the fold.
    edge = valid & (np.hypot(*np.gradient(valid.astype(float))) > 0)
    assert edge.sum() > 100
    for row, column in np.argwhere(edge):
        at = rays[row, column, :2] / rays[row, column, 2]
        root = mpmath.findroot(lambda x, y, to=wanted[row, column]: [*(image(x, y) - to)], tuple(at))
        assert np.abs(np.array([float(value) for value in root]) - at).max() < 1e-11


@pytest.mark.parametrize("name", REAL)
def test_hits_project_to_their_pixels(name: str) -> None:
    k, size, distortion, model = REAL[name]
    camera = raycam.Camera(k, np.eye(3), np.zeros(3), size, distortion=distortion, model=model)
    frame = raycam.render(wall(), camera, samples=1, integrator="flat", channels=["position", "instance"])
    v, u = np.nonzero(frame["instance"] >= 0)
    assert len(u) > 0.95 * size[0] * size[1]
    pixels, seen = camera.project(frame["position"][v, u])
    assert seen.all()
    assert np.abs(pixels - np.column_stack([u, v])).max() <= 1e-3


def test_image_of_a_straight_edge_bends_as_in_opencv() -> None:
    k, size, distortion, _ = REAL["opencv"]
    camera = raycam.Camera(k, np.eye(3), np.zeros(3), size, distortion=distortion)
    ids = raycam.render(wall(), camera, samples=1, integrator="flat", channels="instance")["instance"]
    edge = np.column_stack([np.full(4000, 0.3), np.linspace(-1.2, 1.2, 4000), np.full(4000, 2.0)])
    line = cv2.projectPoints(edge, np.zeros(3), np.zeros(3), np.array(k), np.array(distortion))[0].reshape(
        -1, 2
    )
    assert np.ptp(line[(line[:, 1] >= 0) & (line[:, 1] <= 479), 0]) > 2
    for row in range(480):
        column = np.interp(row, line[:, 1], line[:, 0])
        first = int(np.argmax(ids[row] == 1))
        assert first - 1 <= column + 1e-3
        assert column - 1e-3 <= first


def test_copies_and_pickles_keep_the_lens(tmp_path: Path) -> None:
    camera = raycam.Camera.from_opencv(K, RVEC, TVEC, SIZE, np.array([OPENCV[1]]))
    assert camera.model == "opencv"
    np.testing.assert_array_equal(camera.distortion, OPENCV[1])
    assert "-0.2663726" in repr(camera)
    assert pickle.loads(pickle.dumps(camera)) == copy.copy(camera) == camera
    assert camera != raycam.Camera.from_opencv(K, RVEC, TVEC, SIZE)
    small = camera.resized((320, 240))
    point = points_seen(camera, 1, 3)[0]
    np.testing.assert_allclose(small.project(point)[0] + 0.5, (camera.project(point)[0] + 0.5) / 2, atol=1e-9)
    world = wall()
    world.add_camera(camera)
    assert world.cameras["camera"] == camera
    again = pickle.loads(pickle.dumps(world.cameras["camera"]))  # pickling keeps only the matrix P
    np.testing.assert_allclose(again.project(point)[0], camera.project(point)[0], atol=1e-9)
    raycam.render(world, camera, samples=1).save(tmp_path / "a.exr")
    header = (tmp_path / "a.exr").read_bytes()[:4000]
    assert b"raycam.lens" in header
    assert " ".join(str(v) for v in OPENCV[1]).encode()[:12] in header


def test_world_files_define_lenses() -> None:
    table = {
        "size": [640, 480],
        "focal": 500,
        "location": [0, 0, 0],
        "lens": "fisheye",
        "distortion": FISHEYE[1],
    }
    camera = raycam.World.from_dict({"camera": table}).default_camera()
    assert camera.model == "fisheye"
    expected = raycam.Camera.from_pose([0, 0, 0], focal=500, distortion=FISHEYE[1], model="fisheye")
    np.testing.assert_array_equal(camera.rays([3, 4])[1], expected.rays([3, 4])[1])
    video = {"seconds": 1, "orbit": {"target": [5, 0, 0], "degrees": 90}}
    world = raycam.World.from_dict({"camera": table, "video": video})
    moved = world.camera_at(world.default_camera(), 0.5)
    assert moved.model == "fisheye"
    np.testing.assert_array_equal(moved.distortion, FISHEYE[1])
    for change, code in (
        ({"distortion": [1, 2, 3]}, "invalid_lens"),
        ({"distortion": None}, "missing_value"),
        ({"lens": "brown"}, "unknown_name"),
    ):
        wrong = {key: value for key, value in (table | change).items() if value is not None}
        with raises(raycam.Error, code=code, mentions=["camera[0]"]):
            raycam.World.from_dict({"camera": wrong})
    with raises(raycam.Error, code="conflicting_values"):
        raycam.World.from_dict({"camera": {"matrix": K @ np.eye(3, 4), "distortion": OPENCV[0]}})


def test_zero_distortion_is_a_pinhole() -> None:
    plain = raycam.Camera.from_opencv(K, RVEC, TVEC, SIZE)
    zeros = raycam.Camera.from_opencv(K, RVEC, TVEC, SIZE, np.zeros(5))
    assert plain == zeros
    assert plain.model == "pinhole"
    assert plain.distortion is None
    assert plain.valid().all()
    assert plain.rays()[1].tobytes() == zeros.rays()[1].tobytes()


def test_reference_integrator_refuses_lens_distortion() -> None:
    camera = raycam.Camera.from_opencv(K, RVEC, TVEC, SIZE, OPENCV[0])
    with raises(raycam.CameraError, code="unsupported_camera"):
        raycam.render(wall(), camera, integrator="reference")
