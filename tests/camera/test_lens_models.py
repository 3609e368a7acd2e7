"""Lenses that OpenCV lacks, compared with COLMAP and with the formulas of their papers."""

from __future__ import annotations

import mpmath
import numpy as np
import pycolmap
import pytest
import raycam
from support.points_seen import points_seen

SIZE = (640, 480)
R = raycam.Camera.look_at([1, 2, 3], [4, 1, 0], fov=50).R
T = np.array([0.1, -0.2, 2.0])
PINHOLE = [520.0, 515.0, 322.5, 238.25]

# COLMAP's parameters and the corresponding lens.
COLMAP = {
    "SIMPLE_PINHOLE": ([520.0, 322.5, 238.25], "pinhole"),
    "PINHOLE": (PINHOLE, "pinhole"),
    "SIMPLE_RADIAL": ([520.0, 322.5, 238.25, -0.11], "opencv"),
    "RADIAL": ([520.0, 322.5, 238.25, -0.2, 0.05], "opencv"),
    "OPENCV": ([*PINHOLE, -0.28, 0.07, 2e-4, 2e-5], "opencv"),
    "FULL_OPENCV": ([*PINHOLE, 0.4, 0.1, 1e-3, -2e-3, 0.02, 0.5, 0.1, 0.03], "opencv"),
    "SIMPLE_FISHEYE": ([320.0, 322.5, 238.25], "fisheye"),
    "FISHEYE": ([320.0, 315.0, 322.5, 238.25], "fisheye"),
    "SIMPLE_RADIAL_FISHEYE": ([320.0, 322.5, 238.25, 0.02], "fisheye"),
    "RADIAL_FISHEYE": ([320.0, 322.5, 238.25, 0.02, -0.004], "fisheye"),
    "OPENCV_FISHEYE": ([*PINHOLE, -0.0116, 0.054, -0.0754, 0.0367], "fisheye"),
    "THIN_PRISM_FISHEYE": (
        [*PINHOLE, -0.03, 0.01, 1e-3, -2e-3, -0.002, 1e-4, 3e-3, -1e-3],
        "thin_prism_fisheye",
    ),
    "RAD_TAN_THIN_PRISM_FISHEYE": (
        [*PINHOLE, 0.24, -0.19, 0.06, -0.006, 2e-4, 1e-5, 4e-4, -3e-4, 1e-3, -1e-4, 2e-4, 1e-4],
        "rad_tan_thin_prism_fisheye",
    ),
    "FOV": ([*PINHOLE, 0.9], "fov"),
    "SIMPLE_DIVISION": ([520.0, 322.5, 238.25, -0.21], "division"),
    "DIVISION": ([*PINHOLE, 0.1], "division"),
    "EUCM": ([*PINHOLE, 0.63, 1.04], "eucm"),
    "EQUIRECTANGULAR": ([640.0, 480.0], "equirectangular"),
}


def test_every_camera_model_of_colmap_is_supported() -> None:
    names = {name for name in dir(pycolmap.CameraModelId) if name.isupper()} - {"INVALID"}
    assert names == set(COLMAP)


@pytest.mark.parametrize("name", COLMAP)
@pytest.mark.parametrize("pixel_center", ["half", "integer"])
def test_project_agrees_with_colmap(name: str, pixel_center: str) -> None:
    params, model = COLMAP[name]
    camera = raycam.Camera.from_colmap(name, params, R, T, SIZE, pixel_center=pixel_center)
    assert camera.model == model
    points = points_seen(camera, 30_000, 4)
    assert len(points) > 20_000
    judge = pycolmap.Camera(model=name, width=SIZE[0], height=SIZE[1], params=params)
    expected = np.asarray(judge.img_from_cam(points @ R.T + T))
    # COLMAP does not project points behind the camera with some fisheye models.
    known = np.isfinite(expected).all(axis=1)
    if name == "FOV":
        # At radii below 0.01, COLMAP uses a series with an error of 1e-8 pixels.
        known &= np.linalg.norm(expected - PINHOLE[2:], axis=1) > 10
    assert known.mean() > 0.9
    pixels, seen = camera.project(points)
    assert seen.all()
    assert np.abs(pixels - expected + (0.5 if pixel_center == "integer" else 0))[known].max() <= 1e-9


@pytest.mark.parametrize("name", COLMAP)
def test_lens_models_convert_back_to_colmap(name: str) -> None:
    params, _ = COLMAP[name]
    camera = raycam.Camera.from_colmap(name, params, R, T, SIZE)
    back, numbers = camera.colmap
    again = raycam.Camera.from_colmap(back, numbers, R, T, SIZE)
    point = points_seen(camera, 1, 5)
    np.testing.assert_allclose(again.project(point)[0], camera.project(point)[0], atol=1e-10)
    if not name.startswith(("SIMPLE", "RADIAL", "FISHEYE")):
        assert back == name
        np.testing.assert_allclose(numbers, params, rtol=1e-15)


def mei(x, y, z, xi, k1=0, k2=0, p1=0, p2=0):
    d = mpmath.sqrt(x * x + y * y + z * z)
    x, y = x / (z + xi * d), y / (z + xi * d)
    s = x * x + y * y
    g = 1 + k1 * s + k2 * s * s
    return x * g + 2 * p1 * x * y + p2 * (s + 2 * x * x), y * g + p1 * (s + 2 * y * y) + 2 * p2 * x * y


def eucm(x, y, z, alpha, beta):
    d = mpmath.sqrt(beta * (x * x + y * y) + z * z)
    return x / (alpha * d + (1 - alpha) * z), y / (alpha * d + (1 - alpha) * z)


def ds(x, y, z, xi, alpha):
    d1 = mpmath.sqrt(x * x + y * y + z * z)
    d2 = mpmath.sqrt(x * x + y * y + (xi * d1 + z) ** 2)
    below = alpha * d2 + (1 - alpha) * (xi * d1 + z)
    return x / below, y / below


def fov(x, y, z, omega):
    r = mpmath.hypot(x, y) / z
    factor = mpmath.atan(2 * r * mpmath.tan(omega / 2)) / omega / r
    return x / z * factor, y / z * factor


def cylindrical(x, y, z):
    return mpmath.atan2(x, z), y / mpmath.hypot(x, z)


FORMULAS = [
    ("omni", mei, [0.7]),
    ("omni", mei, [1.9, -0.2, 0.05, 1e-3, -2e-3]),
    ("eucm", eucm, [0.63, 1.04]),
    ("ds", ds, [-0.2, 0.59]),
    ("ds", ds, [0.25, 0.4]),
    ("fov", fov, [1.1]),
    ("cylindrical", cylindrical, []),
]


@pytest.mark.parametrize(("model", "formula", "coefficients"), FORMULAS)
def test_project_equals_the_published_formulas(model, formula, coefficients) -> None:
    focal = 500.0 if len(coefficients) == 5 else 200.0
    K = np.array([[focal, 1.5, 330.0], [0, focal, 235.0], [0, 0, 1]])
    camera = raycam.Camera(K, R, [1, -2, 0.5], SIZE, distortion=coefficients or None, model=model)
    points = points_seen(camera, 300, 6)
    assert len(points) > 100
    pixels, seen = camera.project(points)
    assert seen.all()
    behind = 0
    with mpmath.workdps(40):
        given = [mpmath.mpf(float(c)) for c in coefficients]
        for pixel, point in zip(pixels, points, strict=True):
            local = [
                mpmath.fsum(
                    mpmath.mpf(float(R[i, j])) * mpmath.mpf(float(point[j] - camera.C[j])) for j in range(3)
                )
                for i in range(3)
            ]
            behind += local[2] < 0
            x, y = formula(*local, *given)
            u = focal * x + mpmath.mpf(1.5) * y + 330
            assert abs(u - float(pixel[0])) <= 1e-9
            assert abs(focal * y + 235 - float(pixel[1])) <= 1e-9
    assert behind > 0 or model == "fov"
    back = camera.rays(pixels)[1]
    true = (points - camera.C) / np.linalg.norm(points - camera.C, axis=1)[:, None]
    assert np.linalg.norm(np.cross(back, true), axis=1).max() <= 1e-12


def test_wide_lenses_show_points_behind_the_camera() -> None:
    """A panorama and a 360-degree fisheye in a room also show the wall behind the camera."""
    world = raycam.World()
    world.add_object({"name": "room", "box": {"size": [4, 4, 4]}, "color": [0.5, 0.5, 0.5]})
    for model in ("equirectangular", "cylindrical"):
        camera = raycam.Camera(
            [[100 / np.pi, 0, 99.5], [0, 100 / np.pi, 49.5], [0, 0, 1]],
            np.eye(3),
            [0, 0, 0],
            (200, 100),
            model=model,
        )
        frame = raycam.render(
            world, camera, samples=1, integrator="flat", channels=["position", "depth", "distance"]
        )
        pixels, seen = camera.project(frame["position"].reshape(-1, 3))
        assert seen.all()
        u, v = np.meshgrid(np.arange(200), np.arange(100))
        assert np.abs(pixels - np.stack([u, v], -1).reshape(-1, 2)).max() <= 1e-9
        # These points are behind the camera.
        np.testing.assert_allclose(frame["position"][50, 0, 2], -2, atol=1e-12)
        np.testing.assert_allclose(frame["depth"][50, 0], -2, atol=1e-6)
        np.testing.assert_allclose(frame["distance"][50, 100], 2, rtol=1e-3)
