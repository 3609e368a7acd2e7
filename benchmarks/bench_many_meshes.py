"""Measures the cost of dividing the same triangles into many overlapping meshes.

Models with one mesh per material are examples of such scenes. The triangles of a generated town (400,000) are
distributed to 1, 10, 50 and 200 meshes, in runs of 500, so that each mesh is spread over the whole town.
raycam and Mitsuba 3 (`--mitsuba PYTHON`, variant llvm) path trace the town under a uniform sky, in
alternation.
"""

from __future__ import annotations

import argparse
import contextlib
import tempfile
from pathlib import Path

import numpy as np
import path_raycam
import path_worker
import report
from path_scenes import DEPTH, SIZE, Scene
from raycam.bench.scenes import SCENES

TRIANGLES, RUN = 400_000, 500


def scene(folder: Path, meshes: int) -> Scene:
    """Returns the town, distributed to `meshes` meshes, whose files are written to `folder`."""
    town = SCENES["town"](np.random.default_rng(1), TRIANGLES)
    whose = np.arange(len(town.faces)) // RUN % meshes
    objects = []
    for number in range(meshes):
        used, faces = np.unique(town.faces[whose == number], return_inverse=True)
        path = folder / f"{meshes}-{number}.npz"
        np.savez(path, vertices=town.vertices[used], faces=faces.reshape(-1, 3).astype(np.uint32))
        objects.append((str(path), {"matte": [0.7] * 3}))
    camera = {"eye": list(town.eye), "target": list(town.target), "fov": float(town.fov)}
    return {"camera": camera, "lights": [{"sky": [0.4, 0.5, 0.7]}], "objects": objects}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--mitsuba", metavar="PYTHON", help="Python interpreter with Mitsuba")
    parser.add_argument("--samples", type=int, default=4)
    parser.add_argument("--repeat", type=int, default=5)
    options = parser.parse_args()
    rows = []
    with tempfile.TemporaryDirectory() as name:
        for meshes in (1, 10, 50, 200):
            parts = scene(Path(name), meshes)
            with contextlib.ExitStack() as stack:
                renderers = [path_raycam.picture(parts, SIZE)]
                if options.mitsuba:
                    worker = path_worker.picture(
                        "mitsuba", options.mitsuba, parts, SIZE, variant="llvm_ad_rgb"
                    )
                    renderers.append(stack.enter_context(worker))
                times: list[list[float]] = [[] for _ in renderers]
                for renderer in renderers:
                    renderer(options.samples, 0)
                for seed in range(options.repeat):
                    for renderer, took in zip(renderers, times, strict=True):
                        took.append(renderer(options.samples, 1 + seed)[1])
            row = [str(meshes)]
            for took in times:
                row += [f"{seconds:.2f}" for seconds in report.spread(took)]
            if options.mitsuba:
                row.append(f"{min(times[1]) / min(times[0]):.2f}")
            rows.append(row)
    head = ["meshes", "raycam best s", "median s"]
    if options.mitsuba:
        head += ["Mitsuba llvm best s", "median s", "times faster"]
    notes = [
        f"{SIZE[0]} x {SIZE[1]}, {options.samples} samples, paths of at most {DEPTH} segments; generated."
    ]
    report.write("many_meshes", "The same triangles, divided into many meshes", notes, head, rows)


if __name__ == "__main__":
    main()
