"""Measures the cost of ground truth compared with a flat image.

The generated worlds consist of one mesh or of many meshes.
"""

from __future__ import annotations

import argparse
import time
from typing import Any

import numpy as np
import raycam
import report
from bench_flat_picture import EYE, SIZE, camera_matrices, rock
from path_scenes import ball

FLAT = ["color", "depth", "instance", "triangle"]
FEW = ["depth", "normal", "instance", "triangle"]
TRUTH = [
    "depth",
    "distance",
    "position",
    "normal",
    "normal_camera",
    "shading_normal",
    "shading_normal_camera",
    "instance",
    "category",
    "triangle",
    "barycentric",
    "uv",
    "material",
]


def worlds() -> dict[str, raycam.World]:
    names = {
        "a rock of 1.3 million triangles, not rotated": raycam.World(),
        "the same rock, rotated": raycam.World(),
        "a ball of 20 thousand triangles": raycam.World(),
        "25 balls of 1280 triangles": raycam.World(),
    }
    still, turned, one, many = names.values()
    vertices, faces = rock(8, 1)
    still.add_mesh(vertices, faces)
    matrix = np.eye(4)
    matrix[:3, :3] = [[0.36, 0.48, -0.8], [-0.8, 0.6, 0], [0.48, 0.64, 0.6]]
    turned.add_mesh(vertices, faces, matrix=matrix)
    one.add_mesh(*ball([0, 0, 0], 1.0))
    random = np.random.default_rng(1)
    for _ in range(25):
        many.add_mesh(*ball(list(random.normal(size=3) * 0.6), 0.4, 3))
    return names


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=15, help="images per kind; the kinds take turns")
    options = parser.parse_args()
    K, camera_from_world = camera_matrices()
    camera = raycam.Camera(K, R=camera_from_world[:3, :3], C=EYE, size=SIZE)

    def seconds(world: raycam.World, channels: list[str]) -> float:
        start = time.perf_counter()
        raycam.render(world, camera, integrator="flat", samples=1, channels=channels)
        return time.perf_counter() - start

    rows = []
    kinds: list[list[str]] = [["color"], FLAT, FEW, TRUTH]
    for name, world in worlds().items():
        taken: list[list[float]] = [[] for _ in kinds]
        for turn in range(options.rounds + 1):
            for kind, times in zip(kinds, taken, strict=True):
                took = seconds(world, kind)
                if turn:
                    times.append(took)
        spreads: list[Any] = [report.spread(times) for times in taken]
        row = [name] + [f"{best:.4f}" for best, _ in spreads]
        rows.append([*row, *(f"{spreads[3][k] / spreads[1][k]:.2f}" for k in (0, 1))])
    notes = [
        f"{SIZE[0]} x {SIZE[1]} pixels with one ray each; the worlds are generated and already prepared. Seconds, best"
        f" of {options.rounds} in alternation; the last columns compare all ground truth with the flat image.",
        f"colour: colour only; flat: {', '.join(FLAT)}; few: {', '.join(FEW)}; truth: {', '.join(TRUTH)}.",
    ]
    head = ["world", "colour", "flat", "few", "truth", "ground truth / flat image, best times", "median"]
    report.write("truth", "The time of ground truth", notes, head, rows)


if __name__ == "__main__":
    main()
