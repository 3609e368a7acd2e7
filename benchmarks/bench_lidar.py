"""Compares the speed of lidar scans with Open3D's ray casting of the same rays.

    python benchmarks/bench_lidar.py [--rounds 3] [--triangles 1000000] [--only os1-128|hdl64e]

Rates are pulses per second of CPU time of all threads: the best of the rounds, in which the programs
alternate. The scenes are a town of boxes with a rough ground (`--triangles`), and a street of 128 boxes that
move. Open3D casts the rays of the scan's pulses (float32) and returns distances, normals and ids. raycam's
scan also computes the fields, noise and echoes. HELIOS++ is measured if `pyhelios` is installed.
"""

from __future__ import annotations

import argparse
import importlib.metadata
import importlib.util
import time
from collections.abc import Callable

import numpy as np
import raycam
import report
from raycam.lidar.pose import transform

try:
    import open3d
except ImportError:
    open3d = None

DEVICES = {"os1-128": {"mode": "1024x10"}, "hdl64e": {}}
GREY = [0.5, 0.5, 0.5]


def town(triangles: int) -> raycam.World:
    """Returns houses on a rough ground of about `triangles` triangles."""
    random = np.random.default_rng(1)
    world = raycam.World()
    side = max(2, round((triangles / 2) ** 0.5))
    x, y = np.meshgrid(np.linspace(-100, 100, side + 1), np.linspace(-100, 100, side + 1), indexing="ij")
    ground = np.stack([x, y, random.normal(0, 0.02, x.shape)], axis=-1).reshape(-1, 3)
    i, j = np.meshgrid(np.arange(side), np.arange(side), indexing="ij")
    a = (i * (side + 1) + j).reshape(-1)
    faces = np.concatenate(
        [np.stack([a, a + side + 1, a + side + 2], 1), np.stack([a, a + side + 2, a + 1], 1)]
    )
    world.add_mesh(ground, faces, name="ground", color=GREY)
    for number in range(200):
        place = random.uniform(-90, 90, 2)
        if np.abs(place).max() > 6:
            height = random.uniform(3, 15)
            size = [*random.uniform(4, 10, 2), height]
            world.add_object(
                box={"size": size}, name=f"house {number}", location=[*place, height / 2], color=GREY
            )
    return world


def street() -> raycam.World:
    """Returns 128 boxes that move along a street, at time 0."""
    random = np.random.default_rng(2)
    world = raycam.World()
    world.add_object(plane={"size": [200, 200]}, name="road", color=GREY)
    keys = []
    for number in range(128):
        start = np.array([*random.uniform(-60, 60, 2), 0.75])
        end = start + np.array([*random.uniform(-1, 1, 2), 0])
        world.add_object(box={"size": [4, 2, 1.5]}, name=f"car {number}", location=start.tolist(), color=GREY)
        for seconds, place in ((0, start), (1, end)):
            keys.append({"time": seconds, "object": f"car {number}", "location": place.tolist()})
    world.set_video(seconds=1, keyframe=keys)
    return world


def cpu_seconds(work: Callable[[], object], rounds: int) -> float:
    """Returns the minimum CPU time of `work` in seconds."""
    best = np.inf
    for _ in range(rounds):
        start = time.process_time()
        work()
        best = min(best, time.process_time() - start)
    return float(best)


def open3d_cast(world: raycam.World, lidar: raycam.Lidar) -> Callable[[], object]:
    """Casts the rays of a lidar's pulses with Open3D."""
    triangles = world.triangles().reshape(-1, 3)
    scene = open3d.t.geometry.RaycastingScene()
    index = np.arange(len(triangles), dtype=np.uint32).reshape(-1, 3)
    scene.add_triangles(open3d.core.Tensor(triangles.astype(np.float32)), open3d.core.Tensor(index))
    pattern = lidar.pattern()
    turns, places = lidar.track.at(pattern.times)
    starts = transform(turns, pattern.origins) + places
    rays = np.concatenate([starts, transform(turns, pattern.directions)], axis=1).astype(np.float32)
    tensor = open3d.core.Tensor(rays)
    return lambda: scene.cast_rays(tensor)


def measure(name: str, rounds: int, triangles: int) -> list[list[str]]:
    """Returns the report's rows for a device."""
    lidar = raycam.Lidar(name, noise=False, **DEVICES[name]).placed([0, 0, 1.8])
    pulses = len(lidar.pattern())
    static, moving = town(triangles), street()
    at_zero = moving.at(0)
    wide = lidar.replace(beam_samples=7, beam_divergence=3e-3, returns="dual", noise=True)
    pattern = lidar.pattern()
    turns, places = lidar.track.at(pattern.times)
    origins = transform(turns, pattern.origins) + places
    directions = transform(turns, pattern.directions)
    cases: dict[str, Callable[[], object]] = {
        "town: raycam.scan, 1 ray": lambda: raycam.scan(static, lidar),
        "town: raycam.scan, 7 rays, dual": lambda: raycam.scan(static, wide),
        "town: World.cast_rays, same rays": lambda: static.cast_rays(origins, directions),
        "street, static: raycam.scan": lambda: raycam.scan(moving, lidar),
        "street, 128 moving objects: raycam.scan": lambda: raycam.scan(at_zero, lidar),
    }
    if open3d is not None:
        cases["town: Open3D cast_rays, same rays"] = open3d_cast(static, lidar)
    for work in cases.values():
        work()
    rows = []
    for case, work in cases.items():
        seconds = cpu_seconds(work, rounds)
        rows.append([name, case, f"{pulses:,}", f"{pulses / seconds / 1e6:.2f}"])
    return rows


def main() -> None:
    """Prints the table."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--triangles", type=int, default=1_000_000)
    parser.add_argument("--only", choices=list(DEVICES))
    parser.add_argument("--note", action="append", default=[], help="remark for the report")
    options = parser.parse_args()
    import warnings

    warnings.simplefilter("ignore", raycam.Notice)
    rows = []
    for name in DEVICES:
        if options.only in (None, name):
            rows += measure(name, options.rounds, options.triangles)
    peers = [
        f"Open3D {importlib.metadata.version('open3d')}" if open3d is not None else "Open3D not installed"
    ]
    peers.append("HELIOS++ installed" if importlib.util.find_spec("pyhelios") else "HELIOS++ not installed")
    notes = [
        f"{'; '.join(peers)}. Pulses per second of the CPU time of all threads, best of {options.rounds} rounds.",
        *options.note,
    ]
    head = ["device", "case", "pulses", "million pulses per CPU second"]
    report.write("lidar", "Lidar scans", notes, head, rows)


if __name__ == "__main__":
    main()
