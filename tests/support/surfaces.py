"""Closed and open meshes for tests."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Faces = npt.NDArray[np.int64]
Surface = tuple[Floats, Faces]


def cube(low: npt.ArrayLike = (0, 0, 0), high: npt.ArrayLike = (1, 1, 1), cells: int = 1) -> Surface:
    """A box with `cells` x `cells` quads per side, facing outwards; sides do not share vertices."""
    low, high = np.array(low, float), np.array(high, float)
    steps = np.linspace(0, 1, cells + 1)
    vertices, faces = [], []
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        for side in (0, 1):
            first = sum(map(len, vertices))
            grid = np.zeros((cells + 1, cells + 1, 3))
            grid[..., axis] = side
            grid[..., u], grid[..., v] = np.meshgrid(steps, steps, indexing="ij")
            vertices.append((low + grid * (high - low)).reshape(-1, 3))
            for i in range(cells):
                for j in range(cells):
                    a = first + i * (cells + 1) + j
                    b, c, d = a + cells + 1, a + cells + 2, a + 1
                    quad = [(a, b, c), (a, c, d)]
                    faces += quad if side else [t[::-1] for t in quad]
    return np.concatenate(vertices), np.array(faces)


def torus(
    rings: int = 12, sides: int = 8, radius: float = 1.0, tube: float = 0.4, twist: bool = False
) -> Surface:
    """A torus, or with `twist` a Klein bottle, which is closed but has no inside."""
    u, v = np.meshgrid(np.arange(rings) / rings, np.arange(sides) / sides, indexing="ij")
    a, b = 2 * np.pi * u, 2 * np.pi * v
    if twist:
        # The figure-eight immersion (Banchoff 1976).
        r = radius + tube * (np.cos(a / 2) * np.sin(b) - np.sin(a / 2) * np.sin(2 * b))
        z = tube * (np.sin(a / 2) * np.sin(b) + np.cos(a / 2) * np.sin(2 * b))
    else:
        r, z = radius + tube * np.cos(b), tube * np.sin(b)
    vertices = np.stack([r * np.cos(a), r * np.sin(a), z], axis=-1).reshape(-1, 3)
    faces = []
    for i in range(rings):
        for j in range(sides):
            last = i + 1 == rings
            ends = [((i + 1) % rings, -k % sides if twist and last else k % sides) for k in (j, j + 1)]
            p, q = (i * sides + k % sides for k in (j, j + 1))
            r0, r1 = (m * sides + k for m, k in ends)
            faces += [(p, r0, r1), (p, r1, q)]
    return vertices, np.array(faces)


def joined(*surfaces: Surface) -> Surface:
    """Several meshes in one."""
    first = np.cumsum([0, *(len(vertices) for vertices, _ in surfaces[:-1])])
    faces = [triangles + at for at, (_, triangles) in zip(first, surfaces, strict=True)]
    return np.concatenate([vertices for vertices, _ in surfaces]), np.concatenate(faces)
