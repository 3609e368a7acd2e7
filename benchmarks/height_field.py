"""Generates a large mesh without temporary copies, for programs that may not have raycam."""

from __future__ import annotations

import numpy as np

ROWS = 64


def height_field(n: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Returns a height field of n x n vertices and the triangles between them.

    Vertices are float64 [n * n, 3], triangles uint32 [2 * (n - 1)^2, 3].
    """
    rng = np.random.default_rng(seed)
    waves = [(k, *rng.uniform(0, 6.28, 2)) for k in 2.0 ** np.arange(12) for _ in range(2)]
    vertices, faces = np.empty((n, n, 3)), np.empty((n - 1, n - 1, 2, 3), np.uint32)
    y = np.linspace(-1, 1, n)
    for first in range(0, n, ROWS):
        rows = vertices[first : first + ROWS]
        x = np.linspace(-1, 1, n)[first : first + ROWS, None]
        rows[..., 0], rows[..., 1], rows[..., 2] = x, y, 0.0
        for k, turn, phase in waves:
            rows[..., 2] += 0.12 / k**1.1 * np.sin(k * 3 * (x * np.cos(turn) + y * np.sin(turn)) + phase)
        a = np.arange(first, min(first + ROWS, n - 1), dtype=np.uint32)[:, None] * n
        a = a + np.arange(n - 1, dtype=np.uint32)
        b, c, d = a + n, a + n + 1, a + 1
        faces[first : first + ROWS] = np.stack([a, b, c, a, c, d], -1).reshape(*a.shape, 2, 3)
    return vertices.reshape(-1, 3), faces.reshape(-1, 3)
