"""Compares cameras with OpenCV and with their formulas in 40 digits.

Also measures the speed of each lens model.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable, Sequence

import cv2
import mpmath
import numpy as np
import raycam
import report

SIZE = (640, 480)
K = np.array([[535.9, 0, 342.3], [0, 530.1, 235.6], [0, 0, 1]])
RVEC, TVEC = np.array([0.3, -0.5, 0.2]), np.array([0.1, -0.2, 2.0])
FAR = np.array([1e6, -1e6, 1e6])
Formula = Callable[..., tuple[object, object]]

OPENCV = {
    "pinhole": [],
    "opencv, 4": [-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05],
    "opencv, 5": [-0.2663726, -0.038588899, 0.0017831947, -0.00028122100, 0.23839153],
    "opencv, 8": [4.2, 1.9, 1e-4, -2e-4, 0.05, 4.5, 3.4, 0.4],
    "opencv, 12": [-0.2, 0.05, 1e-3, -1e-3, 0, 0.01, 0, 0, 2e-3, -1e-3, -3e-3, 1e-3],
    "opencv, 14": [-0.2, 0.05, 1e-3, -1e-3, 0, 0.01, 0, 0, 2e-3, -1e-3, -3e-3, 1e-3, 0.05, -0.08],
    "fisheye": [-0.011602611404, 0.053990588928, -0.07542693755, 0.036663653163],
}
OTHERS = {
    "pinhole with skew": ("pinhole", []),
    "thin_prism_fisheye": ("thin_prism_fisheye", [-0.03, 0.01, 1e-3, -2e-3, -0.002, 1e-4, 3e-3, -1e-3]),
    "rad_tan_thin_prism_fisheye": (
        "rad_tan_thin_prism_fisheye",
        [0.24, -0.19, 0.06, -0.006, 2e-4, 1e-5, 4e-4, -3e-4, 1e-3, -1e-4, 2e-4, 1e-4],
    ),
    "fov": ("fov", [0.9]),
    "division": ("division", [-0.21]),
    "omni": ("omni", [1.9, -0.2, 0.05, 1e-3, -2e-3]),
    "eucm": ("eucm", [0.63, 1.04]),
    "ds": ("ds", [-0.2, 0.59]),
    "equirectangular": ("equirectangular", None),
    "cylindrical": ("cylindrical", None),
    "orthographic": ("orthographic", []),
    "affine matrix": ("affine", []),
}
AFFINE = [[80.0, 6.0, -35.0, 330.0], [9.0, -70.0, 42.0, 235.0], [0.0, 0.0, 0.0, 1.0]]
"""A camera matrix with its centre at infinity, skew and unequal scales, in pixels per unit."""


def opencv_camera(name: str, shift: float = 0.0) -> raycam.Camera:
    """Returns a camera that OpenCV supports, optionally far from the origin."""
    model = "fisheye" if name == "fisheye" else "opencv"
    camera = raycam.Camera.from_opencv(K, RVEC, TVEC, SIZE, OPENCV[name] or None, model=model)
    return camera.at_pose(camera.R, camera.C + shift * FAR / 1e6)


def other_camera(name: str) -> raycam.Camera:
    model, coefficients = OTHERS[name]
    if model == "affine":
        return raycam.Camera.from_matrix(AFFINE, SIZE)
    panorama = coefficients is None
    focal = 100.0 if panorama else 260.0 if model in ("eucm", "ds") else 520.0
    k = [[focal, 1.5, 330.0], [0, focal, 235.0], [0, 0, 1]]
    R = opencv_camera("pinhole").R
    if model == "orthographic":
        k = [[90.0, 1.5, 330.0], [0, 85.0, 235.0], [0, 0, 1]]
        table = {"projection": "orthographic", "K": k, "R": R.tolist(), "C": [1.0, -2.0, 0.5], "size": SIZE}
        return raycam.Camera.from_dict(table)
    kind = "opencv" if model == "pinhole" else model
    return raycam.Camera(k, R, [1.0, -2.0, 0.5], SIZE, distortion=coefficients or None, model=kind)


def points_of(camera: raycam.Camera, count: int, seed: int) -> np.ndarray:
    """Returns world points [count, 3] on the rays of random pixels.

    The pixels are inside the image and up to 10 pixels outside of it.
    """
    random = np.random.default_rng(seed)
    found: list[np.ndarray] = []
    while sum(map(len, found)) < count:
        origins, directions = camera.rays(random.uniform([-10, -10], [SIZE[0] + 9, SIZE[1] + 9], (count, 2)))
        points = origins + random.uniform(0.2, 50, (count, 1)) * directions
        found.append(points[np.isfinite(points).all(axis=1)])
    return np.concatenate(found)[:count]


def off_axis(camera: raycam.Camera, points: np.ndarray, pixels: np.ndarray) -> float:
    """Returns the largest sine of the angle between a pixel's ray and its point's direction.

    The point's direction runs from the camera's centre (for parallel rays: from the ray's start) to the
    point.
    """
    origins, directions = camera.rays(pixels)
    true = points - (origins if camera.is_parallel else camera.C)
    true /= np.linalg.norm(true, axis=1, keepdims=True)
    return float(np.linalg.norm(np.cross(directions, true), axis=1).max())


# The models in mpmath: from points in camera axes to the image plane at focal length 1-----------------------


def mp_pinhole(x, y, z):
    return x / z, y / z


def mp_prism(x, y, z, k1, k2, p1, p2, k3, k4, sx1, sy1):
    u, v, r2 = mp_equidistant(x, y, z)
    g = 1 + r2 * (k1 + r2 * (k2 + r2 * (k3 + r2 * k4)))
    du = 2 * p1 * u * v + p2 * (r2 + 2 * u * u) + sx1 * r2
    dv = 2 * p2 * u * v + p1 * (r2 + 2 * v * v) + sy1 * r2
    return u * g + du, v * g + dv


def mp_equidistant(x, y, z):
    r = mpmath.hypot(x, y)
    theta = mpmath.atan2(r, z)
    u, v = x * theta / r, y * theta / r
    return u, v, u * u + v * v


def mp_aria(x, y, z, *c):
    k, (p0, p1), (s0, s1, s2, s3) = c[:6], c[6:8], c[8:]
    u, v, r2 = mp_equidistant(x, y, z)
    g = 1 + mpmath.fsum(value * r2 ** (i + 1) for i, value in enumerate(k))
    u, v = u * g, v * g
    r2 = u * u + v * v
    du = 2 * u * (p0 * u + p1 * v) + p0 * r2 + s0 * r2 + s1 * r2 * r2
    dv = 2 * v * (p0 * u + p1 * v) + p1 * r2 + s2 * r2 + s3 * r2 * r2
    return u + du, v + dv


def mp_fov(x, y, z, omega):
    r = mpmath.hypot(x, y) / z
    g = mpmath.atan(2 * r * mpmath.tan(omega / 2)) / omega / r
    return x / z * g, y / z * g


def mp_division(x, y, z, k):
    x, y = x / z, y / z
    g = 2 / (1 + mpmath.sqrt(1 - 4 * k * (x * x + y * y)))
    return x * g, y * g


def mp_omni(x, y, z, xi, k1=0, k2=0, p1=0, p2=0):
    d = mpmath.sqrt(x * x + y * y + z * z)
    x, y = x / (z + xi * d), y / (z + xi * d)
    s = x * x + y * y
    g = 1 + k1 * s + k2 * s * s
    return x * g + 2 * p1 * x * y + p2 * (s + 2 * x * x), y * g + p1 * (s + 2 * y * y) + 2 * p2 * x * y


def mp_eucm(x, y, z, alpha, beta):
    below = alpha * mpmath.sqrt(beta * (x * x + y * y) + z * z) + (1 - alpha) * z
    return x / below, y / below


def mp_ds(x, y, z, xi, alpha):
    d1 = mpmath.sqrt(x * x + y * y + z * z)
    d2 = mpmath.sqrt(x * x + y * y + (xi * d1 + z) ** 2)
    below = alpha * d2 + (1 - alpha) * (xi * d1 + z)
    return x / below, y / below


def mp_sphere(x, y, z):
    return mpmath.atan2(x, z), mpmath.atan2(y, mpmath.hypot(x, z))


def mp_cylinder(x, y, z):
    return mpmath.atan2(x, z), y / mpmath.hypot(x, z)


def mp_parallel(x, y, z):
    return x, y


FORMULAS: dict[str, Formula] = {
    "pinhole": mp_pinhole,
    "thin_prism_fisheye": mp_prism,
    "rad_tan_thin_prism_fisheye": mp_aria,
    "fov": mp_fov,
    "division": mp_division,
    "omni": mp_omni,
    "eucm": mp_eucm,
    "ds": mp_ds,
    "equirectangular": mp_sphere,
    "cylindrical": mp_cylinder,
    "orthographic": mp_parallel,
}


def from_formula(name: str, camera: raycam.Camera, points: np.ndarray, pixels: np.ndarray) -> float:
    """Returns the largest distance, in pixels, from the model's formula computed with 40 digits."""
    model, coefficients = OTHERS[name]
    worst = mpmath.mpf(0)
    with mpmath.workdps(40):
        k = mpmath.matrix(camera.K.tolist())
        rotation, center = camera.R.tolist(), camera.location.tolist()
        given = [mpmath.mpf(value) for value in coefficients or []]
        for point, pixel in zip(points.tolist(), pixels.tolist(), strict=True):
            if model == "affine":  # this model uses the matrix as given, not its decomposition
                u, v, _ = (mpmath.fdot(row, [*map(mpmath.mpf, point), 1]) for row in AFFINE)
                worst = max(worst, mpmath.hypot(u - pixel[0], v - pixel[1]))
                continue
            away = [mpmath.mpf(a) - mpmath.mpf(b) for a, b in zip(point, center, strict=True)]
            local = [mpmath.fdot(map(mpmath.mpf, row), away) for row in rotation]
            x, y = FORMULAS[model](*local, *given)
            u = k[0, 0] * x + k[0, 1] * y + k[0, 2]
            v = k[1, 1] * y + k[1, 2]
            worst = max(worst, mpmath.hypot(u - pixel[0], v - pixel[1]))
    return float(worst)


# Images ----------------------------------------------------------------------------------------------------


def room(middle: np.ndarray) -> raycam.World:
    """Returns a world of six walls around the camera, and a bumpy ball in front of the camera."""
    world = raycam.World()
    box = np.array([[x, y, z] for x in (-6, 6) for y in (-5, 5) for z in (-4, 4)], dtype=float)
    faces = [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6]]
    faces += [[0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]
    world.add_mesh(box + middle, faces, color=[0.6, 0.6, 0.6])
    return world


def returned(camera: raycam.Camera) -> tuple[float, float]:
    """Returns the largest reprojection error of an image's positions, in pixels.

    The first value is that of a camera near the origin, the second that of a camera a million units away.
    """
    found = []
    for shift in (np.zeros(3), FAR):
        here = camera.at_pose(camera.R, np.array([0.3, -0.2, 0.1]) + shift)
        frame = raycam.render(room(shift), here, samples=1, channels=["position"])
        found.append(frame.reprojection_error())
    return found[0], found[1]


def speed(camera: raycam.Camera, rounds: int) -> list[float]:
    """Returns each round's seconds for a flat image with four rays per pixel."""
    world, seconds = room(np.zeros(3)).prepare(), []
    here = camera.at_pose(camera.R, [0.3, -0.2, 0.1])
    for _ in range(rounds + 1):
        start = time.perf_counter()
        raycam.render(world, here, integrator="flat", samples=4, channels=["color", "depth", "instance"])
        seconds.append(time.perf_counter() - start)
    return seconds[1:]


def rows(names: Sequence[str], points: int, digits: int, rounds: int) -> list[Sequence[str]]:
    made, base = [], 0.0
    for name in names:
        camera = opencv_camera(name) if name in OPENCV else other_camera(name)
        chosen = points_of(camera, points if name in OPENCV else digits, 1)
        pixels, seen = camera.project(chosen)
        assert seen.all()
        if name in OPENCV:
            judge = cv2.fisheye.projectPoints if name == "fisheye" else cv2.projectPoints
            given = chosen[:, None] if name == "fisheye" else chosen
            expected = judge(given, RVEC, TVEC, K, np.array(OPENCV[name], dtype=float))[0].reshape(-1, 2)
            off = float(np.linalg.norm(pixels - expected, axis=1).max())
            many = points_of(camera, points, 2)
        else:
            off = from_formula(name, camera, chosen, pixels)
            many = points_of(camera, points, 2)
        parallel = off_axis(camera, many, camera.project(many)[0])
        near, far = returned(camera)
        _, median = report.spread(speed(camera, rounds))
        base = base or median
        judged = "OpenCV" if name in OPENCV else "mpmath"
        errors = [f"{value:.1e}" for value in (off, parallel, near, far)]
        made.append([name, judged, *errors, f"{median * 1e3:.0f}", f"{median / base:.2f}"])
        print(made[-1], file=sys.stderr)
    return made


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--points", type=int, default=1_000_000, help="points per lens model")
    parser.add_argument(
        "--digits", type=int, default=5_000, help="points per lens model that are compared with mpmath"
    )
    parser.add_argument("--rounds", type=int, default=7, help="images per lens model")
    parser.add_argument("--only", nargs="+", default=[*OPENCV, *OTHERS], help="lens models to measure")
    options = parser.parse_args()
    notes = [
        f"project: the largest distance in pixels from OpenCV {cv2.__version__} over {options.points:,} points, or from"
        f" the model's formula in 40 digits (mpmath) over {options.digits:,}. ray: the largest sine of the angle"
        f" between ray(project(X)) and X - C (for parallel rays, X minus the start of the ray) over {options.points:,}"
        " points."
        " near, far: the largest distance in pixels between a pixel and the projection of the surface"
        " point that its ray hits, in a room at the origin and in a room a million units away along each axis.",
        f"ms: the median of {options.rounds} flat images of {SIZE[0]} x {SIZE[1]} pixels with four rays per "
        "pixel, depth"
        " and ids. times: ms relative to the pinhole.",
    ]
    head = ["model", "beside", "project, px", "ray, sine", "near, px", "far, px", "ms", "times"]
    report.write(
        "cameras", "Cameras", notes, head, rows(options.only, options.points, options.digits, options.rounds)
    )


if __name__ == "__main__":
    main()
