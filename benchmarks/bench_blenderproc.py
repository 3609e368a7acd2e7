"""Compares the time of label images in raycam and in BlenderProc.

`--python` names an interpreter with `blenderproc` and `bpy`.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import raycam
import raycam.dataset
import report
from bench_dataset import SIZE, cameras, table

WORKER = Path(__file__).with_name("blenderproc_worker.py")


def described(world: raycam.World, seen: list[raycam.Camera], path: Path) -> None:
    """Writes BlenderProc's input: triangles in the world, and cameras with OpenGL's axes."""
    numbers = {name: number for number, name in world.categories.items()}
    poses = np.tile(np.eye(4), (len(seen), 1, 1))
    for pose, camera in zip(poses, seen, strict=True):
        pose[:3, :3] = camera.R.T @ np.diag([1.0, -1.0, -1.0])
        pose[:3, 3] = camera.C
    triangles = {f"triangles{item.id}": world.triangles(item.id) for item in world.objects}
    categories = [0 if item.category is None else 1 + numbers[item.category] for item in world.objects]
    colors = np.random.default_rng(1).uniform(0.2, 0.9, (len(categories), 3))
    np.savez(path, K=seen[0].K, size=SIZE, poses=poses, categories=categories, colors=colors, **triangles)


def theirs(python: str, given: Path, folder: Path) -> dict[str, object]:
    command = [python, str(WORKER), str(given), str(os.cpu_count()), str(folder)]
    done = subprocess.run(
        command, capture_output=True, text=True, check=True, env={**os.environ, "TMPDIR": str(folder)}
    )
    line = next(line for line in done.stdout.splitlines() if line.startswith("found "))
    return dict(json.loads(line.removeprefix("found ")))


def ours(world: raycam.World, seen: list[raycam.Camera], folder: Path) -> dict[str, float]:
    def seconds(channels: list[str]) -> float:
        start = time.perf_counter()
        for camera in seen:
            raycam.render(world, camera, integrator="flat", samples=1, channels=channels)
        return time.perf_counter() - start

    taken = {
        "masks": seconds(["instance", "category"]),
        "all": seconds(["color", "depth", "normal", "instance", "category"]),
    }
    start = time.perf_counter()
    raycam.dataset.write(world, folder, "coco", cameras=seen, integrator="flat", samples=1)
    taken["coco"] = time.perf_counter() - start
    return taken


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--python", required=True, help="Python interpreter with blenderproc and bpy")
    parser.add_argument("--frames", type=int, default=40)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument(
        "--folder", default=None, help="output folder; use a folder in memory to exclude the disk's time"
    )
    options = parser.parse_args()
    world, seen = table(), cameras(options.frames)
    world.prepare()
    best: dict[str, list[float]] = {"masks": [], "all": [], "coco": []}
    rates: dict[str, list[float]] = {"masks": [], "all": [], "coco": []}
    for _ in range(options.rounds):
        with tempfile.TemporaryDirectory(dir=options.folder) as folder:
            given = Path(folder) / "given.npz"
            described(world, seen, given)
            found = theirs(options.python, given, Path(folder) / "theirs")
            taken = found["seconds"]
            mine = ours(world, seen, Path(folder) / "ours")
        assert min(found["objects"]) > 1, "BlenderProc rendered no object"
        best["masks"].append(taken["masks"])
        best["all"].append(taken["masks"] + taken["maps"])
        best["coco"].append(taken["masks"] + taken["color"] + taken["coco"])
        for name, value in mine.items():
            rates[name].append(value)
        print(found, mine, file=sys.stderr)
    names = {
        "masks": "instance and category, as arrays",
        "all": "colour, depth, normals, instance and category, as arrays",
        "coco": "a COCO data set; BlenderProc writes masks and boxes, raycam also amodal boxes and visible fractions",
    }
    rows = []
    for name, text in names.items():
        a, b = options.frames / min(best[name]), options.frames / min(rates[name])
        rows.append([text, f"{a:.1f}", f"{b:.1f}", f"{b / a:.1f}"])
    notes = [
        f"BlenderProc {found['blenderproc']} in Blender {found['blender']} as a Python module, Cycles with one sample,"
        f" no denoiser, {os.cpu_count()} threads; raycam renders flat colours. {options.frames} frames of"
        f" {SIZE[0]} x {SIZE[1]} pixels of twenty objects on a table, with the same triangles and cameras. "
        "Rates are frames"
        f" per second: the best of {options.rounds} rounds in alternation, without start-up and preparation.",
    ]
    report.write(
        "blenderproc",
        "Labels compared with BlenderProc",
        notes,
        ["what", "BlenderProc", "raycam", "times"],
        rows,
    )


if __name__ == "__main__":
    main()
