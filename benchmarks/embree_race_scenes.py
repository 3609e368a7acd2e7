"""Scenes for the race against Embree: four families of triangles, a new variation for every seed.

`NAME.tri`: uint32 vertex count V, uint32 triangle count T, V x 3 float32, T x 3 uint32, little endian.
`NAME.cam`: 13 float32: eye, target, up, vertical field of view in degrees, position of the light.
"""

import pathlib

import numpy as np
import trimesh

BOX_VERTICES = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
BOX_FACES = np.array(
    [
        0,
        1,
        3,
        0,
        3,
        2,
        4,
        6,
        7,
        4,
        7,
        5,
        0,
        4,
        5,
        0,
        5,
        1,
        2,
        3,
        7,
        2,
        7,
        6,
        0,
        2,
        6,
        0,
        6,
        4,
        1,
        5,
        7,
        1,
        7,
        3,
    ]
).reshape(-1, 3)


def terrain(rng, n):
    """A fractal height field of n x n vertices."""
    x = np.linspace(-1, 1, n)
    X, Y = np.meshgrid(x, x, indexing="ij")
    z = np.zeros_like(X)
    for k in 2.0 ** np.arange(10):
        for _ in range(3):
            t, p = rng.uniform(0, 6.28, 2)
            z += 0.12 / k**1.1 * np.sin(k * 3 * (X * np.cos(t) + Y * np.sin(t)) + p)
    i = np.arange(n * n).reshape(n, n)
    a, b, c, d = i[:-1, :-1], i[1:, :-1], i[1:, 1:], i[:-1, 1:]
    faces = [np.stack(corners, -1).reshape(-1, 3) for corners in ((a, b, c), (a, c, d))]
    return np.stack([X, Y, z], -1).reshape(-1, 3), np.concatenate(faces)


def rock(rng, level):
    """A sphere with bumps of seven sizes."""
    sphere = trimesh.creation.icosphere(level)
    v = np.array(sphere.vertices)
    r = np.ones(len(v))
    for o in range(7):
        for _ in range(4):
            d = rng.normal(size=3)
            d /= np.linalg.norm(d)
            r += 0.06 / 2**o * np.sin(2**o * 4 * v @ d + rng.uniform(0, 6.28))
    return v * r[:, None], np.array(sphere.faces)


def town(rng, n):
    """n x n blocks of boxes of many sizes on a plane: long thin and tiny triangles, deep occlusion."""
    vertices = [np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) * n * 1.2]
    faces = [np.array([[0, 1, 2], [0, 2, 3]])]
    base, k = 4, 24
    for i in range(n):
        for j in range(n):
            size = np.array([rng.uniform(0.3, 0.8), rng.uniform(0.3, 0.8), rng.gamma(2.0, 0.6)])
            place = np.array([i - n / 2, j - n / 2, 0.0])
            sizes = np.concatenate([size[None], rng.uniform(0.01, 0.08, (k, 3))])
            places = np.concatenate([place[None], place + rng.uniform(0, 1, (k, 3)) * size])
            vertices.append((BOX_VERTICES[None] * sizes[:, None] + places[:, None]).reshape(-1, 3))
            faces.append((BOX_FACES[None] + base + 8 * np.arange(k + 1)[:, None, None]).reshape(-1, 3))
            base += 8 * (k + 1)
    return np.concatenate(vertices), np.concatenate(faces)


def hair(rng, n):
    """n thin curved blades: the worst case for axis-aligned boxes."""
    segments = 12
    root, lean = rng.uniform(-1, 1, (n, 2)), rng.normal(0, 0.25, (n, 2))
    w = rng.normal(size=(n, 2))
    w /= np.linalg.norm(w, axis=1)[:, None]
    t = np.linspace(0, 1, segments + 1)
    c = np.zeros((n, segments + 1, 3))
    c[..., :2] = root[:, None] + lean[:, None] * t[None, :, None] ** 2
    c[..., 2] = t * 0.5 * rng.uniform(0.5, 1.3, (n, 1))
    off = np.zeros_like(c)
    off[..., :2] = w[:, None] * (0.004 * (1 - t * 0.9))[None, :, None]
    base = (np.arange(n) * (segments + 1) * 2)[:, None] + (np.arange(segments) * 2)[None]
    a, b, d, e = base, base + 1, base + 2, base + 3
    faces = [np.stack(corners, -1).reshape(-1, 3) for corners in ((a, b, e), (a, e, d))]
    return np.stack([c - off, c + off], 2).reshape(-1, 3), np.concatenate(faces)


# name: (make, size, [eye, target, up, field of view, light])
SCENES = {
    "terrain": (terrain, 1201, [-1.0, -1.2, 0.6, 0.1, 0.2, 0, 0, 0, 1, 55, 0.5, -0.8, 1.5]),
    "rock": (rock, 8, [2.3, 1.4, 1.0, 0, 0, 0, 0, 0, 1, 45, 3, -2, 4]),
    "town": (town, 70, [-30, -33, 8, 0, 0, 0, 0, 0, 1, 60, 20, -30, 40]),
    "hair": (hair, 50000, [-1.8, -1.5, 0.9, 0, 0, 0.2, 0, 0, 1, 45, 2, -2, 3]),
}


def write(folder: pathlib.Path, seed: int) -> None:
    """Writes all scenes of a seed."""
    rng = np.random.default_rng(seed)
    folder.mkdir(parents=True, exist_ok=True)
    for name, (make, size, camera) in SCENES.items():
        vertices, faces = make(rng, size)
        with open(folder / f"{name}.tri", "wb") as file:
            np.array([len(vertices), len(faces)], "<u4").tofile(file)
            np.ascontiguousarray(vertices, "<f4").tofile(file)
            np.ascontiguousarray(faces, "<u4").tofile(file)
        np.array(camera, "<f4").tofile(folder / f"{name}.cam")
