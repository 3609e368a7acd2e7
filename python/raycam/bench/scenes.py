"""Generated benchmark scenes: four families with any number of triangles.

The scenes are different for every seed. Terrain and rock are smooth and finely tessellated. The scene "town"
mixes long thin triangles with tiny triangles. Hair is the worst case for bounding boxes.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ..arguments import Floats, whole
from ..errors import SettingsError, nearest

__all__ = ["SCENES", "BenchScene", "generate"]

Faces = npt.NDArray[np.int64]

LIMIT = 100_000_000


class BenchScene(NamedTuple):
    """A triangle mesh, a camera position and a light."""

    vertices: Floats
    """The vertices in metres, float64 [v, 3]."""
    faces: Faces
    """Vertex indices of the triangles, int64 [t, 3]."""
    eye: tuple[float, float, float]
    target: tuple[float, float, float]
    fov: float
    """Vertical field of view in degrees; z is up."""
    light: tuple[float, float, float]
    """The position of a point light [3]."""


def generate(name: str, triangles: int, seed: int = 1) -> BenchScene:
    """Generates a scene of about `triangles` triangles with random numbers from `seed`.

    The number of a rock's triangles is 20 * 4^n, the nearest such number to `triangles`. Raises `SettingsError` with
    the most similar name for a name that is not in `SCENES`.
    """
    if name not in SCENES:
        raise SettingsError(nearest("scene", name, list(SCENES)), code="unknown_name")
    count = whole("triangles", triangles, 1, LIMIT)
    return SCENES[name](np.random.default_rng(whole("seed", seed, 0, (1 << 63) - 1)), count)


def _grid(n: int) -> Faces:
    """Two triangles for each cell of n x n vertices."""
    i = np.arange(n * n).reshape(n, n)
    a, b, c, d = i[:-1, :-1], i[1:, :-1], i[1:, 1:], i[:-1, 1:]
    return np.concatenate([np.stack(corners, -1).reshape(-1, 3) for corners in ((a, b, c), (a, c, d))])


def _terrain(rng: np.random.Generator, triangles: int) -> BenchScene:
    """A fractal height field."""
    n = 1 + max(1, round((triangles / 2) ** 0.5))
    x, y = np.meshgrid(np.linspace(-1, 1, n), np.linspace(-1, 1, n), indexing="ij")
    z = np.zeros_like(x)
    for k in 2.0 ** np.arange(10):
        for _ in range(3):
            t, p = rng.uniform(0, 6.28, 2)
            z += 0.12 / k**1.1 * np.sin(k * 3 * (x * np.cos(t) + y * np.sin(t)) + p)
    vertices = np.stack([x, y, z], -1).reshape(-1, 3)
    return BenchScene(vertices, _grid(n), (-1.0, -1.2, 0.6), (0.1, 0.2, 0.0), 55, (0.5, -0.8, 1.5))


def _icosphere(levels: int) -> tuple[Floats, Faces]:
    """Returns an icosphere with vertices on the unit sphere.

    The triangles of an icosahedron are divided into four `levels` times.
    """
    g = (1 + 5**0.5) / 2
    corners = [(-1, g, 0), (1, g, 0), (-1, -g, 0), (1, -g, 0)]
    vertices = np.array([np.roll(corner, turn) for turn in range(3) for corner in corners])
    vertices /= np.hypot(1, g)
    # Vertices one edge length apart are neighbours. Three mutual neighbours make a triangle, oriented outwards.
    near = np.abs(vertices @ vertices.T - 1 / 5**0.5) < 1e-9
    three = np.argwhere(near[:, :, None] & near[None] & near[:, None])
    three = three[(three[:, 0] < three[:, 1]) & (three[:, 0] < three[:, 2])]
    faces = three[np.linalg.det(vertices[three]) > 0]
    for _ in range(levels):
        sides = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2))
        _, first, number = np.unique(
            sides[:, 0] * len(vertices) + sides[:, 1], return_index=True, return_inverse=True
        )
        middles = vertices[sides[first]].sum(1)
        m = len(vertices) + number.reshape(-1, 3)
        vertices = np.concatenate([vertices, middles / np.linalg.norm(middles, axis=1)[:, None]])
        parts = [[faces[:, k], m[:, k], m[:, k - 1]] for k in range(3)] + [[m[:, 0], m[:, 1], m[:, 2]]]
        faces = np.concatenate([np.stack(part, -1) for part in parts])
    return vertices, faces


def _rock(rng: np.random.Generator, triangles: int) -> BenchScene:
    """A sphere with bumps of seven sizes."""
    v, faces = _icosphere(max(0, round(np.log(triangles / 20) / np.log(4))))
    r = np.ones(len(v))
    for o in range(7):
        for _ in range(4):
            d = rng.normal(size=3)
            d /= np.linalg.norm(d)
            r += 0.06 / 2**o * np.sin(2**o * 4 * v @ d + rng.uniform(0, 6.28))
    return BenchScene(v * r[:, None], faces, (2.3, 1.4, 1.0), (0, 0, 0), 45, (3, -2, 4))


BOX_VERTICES = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
BOX_SIDES = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
BOX_FACES = np.array([corners for a, b, c, d in BOX_SIDES for corners in ((a, b, c), (a, c, d))])


def _town(rng: np.random.Generator, triangles: int) -> BenchScene:
    """Blocks of boxes of many sizes on a plane: long thin and tiny triangles, deep occlusion."""
    boxes = 25
    n = max(1, round((triangles / (12 * boxes)) ** 0.5))
    vertices = [np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) * n * 1.2]
    faces = [np.array([[0, 1, 2], [0, 2, 3]])]
    base = 4
    for i in range(n):
        for j in range(n):
            size = np.array([rng.uniform(0.3, 0.8), rng.uniform(0.3, 0.8), rng.gamma(2.0, 0.6)])
            place = np.array([i - n / 2, j - n / 2, 0.0])
            sizes = np.concatenate([size[None], rng.uniform(0.01, 0.08, (boxes - 1, 3))])
            places = np.concatenate([place[None], place + rng.uniform(0, 1, (boxes - 1, 3)) * size])
            vertices.append((BOX_VERTICES[None] * sizes[:, None] + places[:, None]).reshape(-1, 3))
            faces.append((BOX_FACES[None] + base + 8 * np.arange(boxes)[:, None, None]).reshape(-1, 3))
            base += 8 * boxes
    s = n / 70
    eye, light = (-30 * s, -33 * s, 8.0), (20 * s, -30 * s, 40.0)
    return BenchScene(np.concatenate(vertices), np.concatenate(faces), eye, (0, 0, 0), 60, light)


def _hair(rng: np.random.Generator, triangles: int) -> BenchScene:
    """Thin curved blades."""
    segments = 12
    n = max(1, round(triangles / (2 * segments)))
    root, lean = rng.uniform(-1, 1, (n, 2)), rng.normal(0, 0.25, (n, 2))
    w = rng.normal(size=(n, 2))
    w /= np.linalg.norm(w, axis=1)[:, None]
    t = np.linspace(0, 1, segments + 1)
    c = np.zeros((n, segments + 1, 3))
    c[..., :2] = root[:, None] + lean[:, None] * t[None, :, None] ** 2
    c[..., 2] = t * 0.5 * rng.uniform(0.5, 1.3, (n, 1))
    off = np.zeros_like(c)
    off[..., :2] = w[:, None] * (0.004 * (1 - t * 0.9))[None, :, None]
    vertices = np.stack([c - off, c + off], 2).reshape(-1, 3)
    base = (np.arange(n) * (segments + 1) * 2)[:, None] + (np.arange(segments) * 2)[None]
    a, b, d, e = base, base + 1, base + 2, base + 3
    faces = np.concatenate([np.stack(corners, -1).reshape(-1, 3) for corners in ((a, b, e), (a, e, d))])
    return BenchScene(vertices, faces, (-1.8, -1.5, 0.9), (0, 0, 0.2), 45, (2, -2, 3))


SCENES: dict[str, Callable[[np.random.Generator, int], BenchScene]] = {
    "terrain": _terrain,
    "rock": _rock,
    "town": _town,
    "hair": _hair,
}
"""Generators of the scenes by name."""
