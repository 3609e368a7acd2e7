"""An independent camera for tests of calibration files.

It consists of closed forms in NumPy and random poses.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from PIL import Image
from scipy.spatial.transform import Rotation

Array = npt.NDArray[np.float64]
OPENGL = np.diag([1.0, -1.0, -1.0])


def pose(seed: int) -> tuple[Array, Array]:
    """A camera_from_world rotation [3, 3] and a centre [3], in OpenCV's axes."""
    random = np.random.default_rng(seed)
    return Rotation.random(random_state=seed).as_matrix(), random.uniform(-2, 2, 3)


def points(R: Array, C: Array, reach: float = 0.5) -> Array:
    """Points [n, 3] of the world in front of a camera."""
    random = np.random.default_rng(7)
    seen = np.column_stack([random.uniform(-reach, reach, (30, 2)), np.ones(30)]) * random.uniform(
        1, 4, (30, 1)
    )
    return seen @ R + C


def brown(x: Array, k: tuple[float, ...] = (), p: tuple[float, float] = (0.0, 0.0)) -> Array:
    """Points [n, 2] with radial (k1 r^2 + k2 r^4 + ...) and tangential distortion.

    The tangential terms are those of OpenCV.
    """
    r2 = (x**2).sum(axis=1)
    radial = 1 + sum(value * r2 ** (i + 1) for i, value in enumerate(k))
    u, v = x.T
    p1, p2 = p
    moved = np.column_stack([2 * p1 * u * v + p2 * (r2 + 2 * u * u), p1 * (r2 + 2 * v * v) + 2 * p2 * u * v])
    return x * radial[:, None] + moved


def equidistant(x: Array) -> Array:
    """Equidistant fisheye: points of the plane z = 1 scaled to their angles."""
    r = np.linalg.norm(x, axis=1, keepdims=True)
    return x * np.arctan(r) / r


def pixels(K: Array, R: Array, C: Array, world: Array, lens: Any = None) -> Array:
    """The pixels [n, 2] of world points; `lens` distorts points of the plane z = 1."""
    camera = (world - C) @ R.T
    plane = camera[:, :2] / camera[:, 2:]
    plane = plane if lens is None else lens(plane)
    return np.column_stack([plane, np.ones(len(plane))]) @ K[:2].T


def check(camera: Any, K: Array, R: Array, C: Array, lens: Any = None, reach: float = 0.5) -> None:
    """Asserts that a camera has the pixels of the closed form, within 1e-7."""
    world = points(R, C, reach)
    found, seen = camera.project(world)
    assert seen.all()
    np.testing.assert_allclose(found, pixels(K, R, C, world, lens), atol=1e-7)


def four(R: Array, t: Array) -> Array:
    """The matrix [4, 4] of a rotation and a translation."""
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = R, t
    return matrix


def intrinsics(fx: float, fy: float, cx: float, cy: float, skew: float = 0.0) -> Array:
    """The intrinsics K [3, 3]."""
    return np.array([[fx, skew, cx], [0, fy, cy], [0, 0, 1.0]])


def picture(path: Path, size: tuple[int, int] = (640, 480)) -> Path:
    """Writes an image of one colour, in the format of its extension."""
    path.parent.mkdir(parents=True, exist_ok=True)
    Image.new("RGB", size).save(path)
    return path


def rows(matrix: Array) -> str:
    """A matrix as text, one row per line, with all digits."""
    return "".join(" ".join(repr(float(value)) for value in row) + "\n" for row in matrix)
