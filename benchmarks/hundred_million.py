"""Generates a hundred million triangles, builds their tree, and renders an image.

    python benchmarks/hundred_million.py [--triangles 100e6]

The report contains the peak memory. The mesh is a height field. A few rows at a time are written directly
into the arrays that `add_mesh` receives, so that no temporary copy is needed.
"""

from __future__ import annotations

import argparse
import resource
import time
from pathlib import Path

import numpy as np
import raycam
import report

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


def gigabytes() -> float:
    """Returns the peak memory of this process in GB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 / 1e9


def main() -> None:
    """Builds, renders and writes the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--triangles", type=float, default=100e6)
    parser.add_argument("--picture", type=Path, help="file to which the image is saved")
    options = parser.parse_args()
    rows = []
    start = time.perf_counter()

    def step(name: str) -> None:
        nonlocal start
        rows.append([name, f"{time.perf_counter() - start:.1f}", f"{gigabytes():.1f}"])
        print(rows[-1], flush=True)
        start = time.perf_counter()

    n = 1 + round((options.triangles / 2) ** 0.5)
    vertices, faces = height_field(n, 1)
    count = len(faces)
    step("generate, in rows of 64")
    world = raycam.World(up="z")
    world.add_mesh(vertices, faces)
    del vertices, faces
    step("add_mesh")
    world.prepare()
    step("build")
    camera = raycam.Camera.look_at([-1.0, -1.2, 0.6], [0.1, 0.2, 0], [0, 0, 1], size=(640, 480), fov=55)
    world.add_light({"type": "sun", "direction": [1, 0.5, -0.6], "irradiance": [3, 3, 3]})
    frame = raycam.render(world, camera, integrator="direct", samples=4)
    step("render 640 x 480, direct light, 4 samples")
    if options.picture is not None:
        frame.save(options.picture)
    met = (frame["color"].sum(-1) > 0).mean()
    notes = [
        f"{count:,} triangles, {n * n:,} vertices; {met:.0%} of the pixels show them. Memory is the peak of "
        "the resident memory."
    ]
    head = ["step", "seconds", "peak memory so far in GB"]
    report.write("hundred-million", "A hundred million triangles", notes, head, rows)


if __name__ == "__main__":
    main()
