"""Compares loading with another build of raycam, by processor time.

    python benchmarks/loading_in_turn.py --before FOLDER [--triangles N] [--turns N] [--only NAME ...]

The files are glTF, OBJ, PLY, STL, USD, world files and COLMAP models. `--before` names the folder that
contains the package `raycam` of the other build. In each turn, a process of each build loads a small file of
the same kind, so that everything is imported, then the file, and then the file again several times. The best
of these loads counts; times include all threads, and child processes that have ended. The builds swap their
order from turn to turn. The table contains the best and the median of the turns.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from bench_loading import grid, write_files

MEASURE = """
import json, os, resource, sys, time, warnings
import raycam
warnings.simplefilter("ignore")
small, path = sys.argv[1:]
ended = lambda: resource.getrusage(resource.RUSAGE_CHILDREN)
cpu = lambda: time.process_time() + ended().ru_utime + ended().ru_stime
load = raycam.load_cameras if os.path.isdir(path) else raycam.load
load(small), load(path)
times = []
for _ in range(int({loads})):
    start = cpu()
    load(path)
    times.append(cpu() - start)
print(json.dumps(min(times)))
"""


def write_usd(path: Path, triangles: int) -> None:
    """Writes the wavy square as a USD text file."""
    vertices, faces = grid(triangles)
    points = ", ".join(f"({x:.6f}, {y:.6f}, {z:.6f})" for x, y, z in vertices.tolist())
    path.write_text(
        f'#usda 1.0\n(upAxis = "Z")\ndef Mesh "grid" {{\n    point3f[] points = [{points}]\n'
        f"    int[] faceVertexCounts = {[3] * len(faces)}\n"
        f"    int[] faceVertexIndices = {faces.ravel().tolist()}\n}}\n"
    )


def write_world(path: Path, objects: int) -> None:
    """Writes boxes and balls with separate materials, and a moving camera."""
    lines = ['up = "z"']
    for i in range(objects):
        shape = ["box = { size = 0.2 }", "sphere = { radius = 0.1, level = 2 }"][i % 2]
        lines += [
            "[[object]]",
            f'name = "thing {i}"',
            shape,
            f"location = [{i % 40}, {i // 40}, 0.5]",
            f"yaw = {i % 360}",
            'type = "principled"',
            f'color = "#{(i * 7919) % 0xFFFFFF:06x}"',
            "roughness = 0.4",
        ]
    path.write_text("\n".join([*lines, ""]))


def write_colmap(folder: Path, images: int) -> None:
    """Writes cameras and images in COLMAP's text format, without points."""
    folder.mkdir()
    (folder / "cameras.txt").write_text(
        "".join(f"{i + 1} OPENCV 640 480 500 500 320 240 0.01 0.02 0 0\n" for i in range(10))
    )
    turns = np.random.default_rng(1).normal(size=(images, 4))
    turns /= np.linalg.norm(turns, axis=1, keepdims=True)
    (folder / "images.txt").write_text(
        "".join(
            f"{i + 1} {' '.join(map(str, turn))} {i % 10} 0 2 {i % 10 + 1} image{i:06}.jpg\n\n"
            for i, turn in enumerate(turns.tolist())
        )
    )
    (folder / "points3D.txt").write_text("")


def files(folder: Path, triangles: int) -> list[Path]:
    """Writes a file of each kind."""
    folder.mkdir()
    meshes = write_files(folder, triangles)
    write_usd(folder / "grid.usda", triangles // 5)
    write_world(folder / "things.toml", max(10, triangles // 500))
    write_colmap(folder / "colmap", max(4, triangles // 100))
    return [*meshes, folder / "grid.usda", folder / "things.toml", folder / "colmap"]


def main() -> None:
    """Prints the best and the median time of each build, and the ratio of the medians."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--before", required=True, type=Path)
    parser.add_argument(
        "--now", type=Path, help="package folder of the new build (default: the build that Python imports)"
    )
    parser.add_argument("--triangles", type=int, default=1_000_000)
    parser.add_argument("--turns", type=int, default=7)
    parser.add_argument("--loads", type=int, default=3)
    parser.add_argument("--only", nargs="*", default=[], help="names of the files to load (default: all)")
    options = parser.parse_args()
    builds = {"now": options.now, "before": options.before}
    print("| file | now: best, median | before: best, median | now / before: best, median |")
    print("| --- | --: | --: | --: |")
    with tempfile.TemporaryDirectory() as name:
        small = files(Path(name) / "small", 200)
        for path, warm in zip(files(Path(name) / "large", options.triangles), small, strict=True):
            if options.only and path.name not in options.only:
                continue
            found: dict[str, list[float]] = {"now": [], "before": []}
            for turn in range(options.turns):
                for build in [*builds][:: 1 if turn % 2 else -1]:
                    place = builds[build]
                    environment = {**os.environ, **({"PYTHONPATH": str(place)} if place else {})}
                    script = MEASURE.format(loads=options.loads)
                    done = subprocess.run(
                        [sys.executable, "-c", script, str(warm), str(path)],
                        capture_output=True,
                        text=True,
                        check=False,
                        env=environment,
                    )
                    if done.returncode == 0:
                        found[build].append(json.loads(done.stdout.splitlines()[-1]))
                    else:
                        print(done.stderr.splitlines()[-1], file=sys.stderr)
            print(row(path.name, found["now"], found["before"]), flush=True)


def row(name: str, now: list[float], before: list[float]) -> str:
    """Formats a row of the table."""
    if not now or not before:
        cells = [f"{min(times):.4f} s" if times else "-" for times in (now, before)]
        return f"| {name} | {cells[0]} | {cells[1]} | - |"
    middle = [statistics.median(times) for times in (now, before)]
    ratios = f"{min(now) / min(before):.3f}, {middle[0] / middle[1]:.3f}"
    return f"| {name} | {min(now):.4f}, {middle[0]:.4f} s | {min(before):.4f}, {middle[1]:.4f} s | {ratios} |"


if __name__ == "__main__":
    main()
