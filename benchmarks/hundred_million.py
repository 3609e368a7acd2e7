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

import raycam
import report
from height_field import height_field


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
