"""Measures seconds and memory of data sets with a thousand small images of a prepared world."""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import report
from raycam.dataset import FORMATS

SIZE = (320, 240)


def table() -> object:
    """Returns twenty objects of four shapes on a table."""
    import raycam

    world = raycam.World()
    world.add_object(plane={"size": [8, 8]}, color=[0.7, 0.7, 0.65])
    random = np.random.default_rng(0)
    shapes = [
        {"box": {"size": [0.4, 0.3, 0.5]}},
        {"sphere": {"radius": 0.25, "level": 4}},
        {"cylinder": {"radius": 0.2, "height": 0.6}},
        {"torus": {"radius": 0.3, "tube": 0.1}},
    ]
    for number in range(20):
        place = [*random.uniform(-1.8, 1.8, 2), 0.3]
        kind = shapes[number % 4]
        angles = dict(zip(("roll", "pitch", "yaw"), random.uniform(0, 360, 3), strict=True))
        color = random.uniform(0.2, 0.9, 3)
        world.add_object({**kind, "location": place, "color": color, "category": next(iter(kind)), **angles})
    world.add_light({"type": "sun", "direction": [-1, -1, -2], "irradiance": [3, 3, 3]})
    return world


def cameras(count: int) -> list[object]:
    import raycam

    angles = np.linspace(0, 2 * np.pi, count, endpoint=False)
    return [
        raycam.Camera.look_at(
            [4 * np.cos(a), 4 * np.sin(a), 2.0 + np.sin(5 * a)], [0, 0, 0.2], size=SIZE, fov=40
        )
        for a in angles
    ]


def work(name: str, frames: int) -> None:
    """Writes a data set in a separate process; prints seconds and memory growth as JSON.

    The growth is that of the peak memory, from the first half of the images to the second half.
    """
    import raycam.dataset

    peaks: dict[int, int] = {}
    world, seen = table(), cameras(frames)

    def progress(done: int, total: int, failed: int) -> None:
        if done in (total // 8, total // 2, total):
            peaks[done] = peak()
            # Resets the peak, so that the next value is the peak of the next part of the job.
            Path("/proc/self/clear_refs").write_text("5")

    with tempfile.TemporaryDirectory() as folder:
        start = time.perf_counter()
        raycam.dataset.write(
            world, folder, name, cameras=seen, integrator="flat", samples=1, progress=progress
        )
        seconds = time.perf_counter() - start
    _, early, late = peaks.values()
    growth = max(late, peak()) / early - 1  # the second peak includes the index files
    print(json.dumps({"seconds": seconds, "growth": growth, "peak": max(*peaks.values(), peak())}))


def peak() -> int:
    """Returns the peak resident memory in KiB since the last reset."""
    status = Path("/proc/self/status").read_text()
    return int(status.partition("VmHWM:")[2].split()[0])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--frames", type=int, default=1000)
    parser.add_argument("--only", nargs="+", default=sorted(FORMATS))
    parser.add_argument("--worker", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.worker:
        work(options.worker, options.frames)
        return
    rows = []
    for name in options.only:
        command = [sys.executable, __file__, "--worker", name, "--frames", str(options.frames)]
        found = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
        rate = options.frames / found["seconds"]
        rows.append(
            [
                name,
                f"{found['seconds']:.1f}",
                f"{rate:.1f}",
                f"{found['peak'] / 1024:.0f}",
                f"{found['growth']:.2%}",
            ]
        )
        print(rows[-1], file=sys.stderr)
    notes = [
        f"{options.frames} frames of {SIZE[0]} x {SIZE[1]} pixels of twenty objects on a table, flat colours, "
        "labels, no"
        " light; every file is synced to the disk. MiB is the peak memory of the process. Growth compares the peak"
        " resident memory of the second half, including the index files, with that of the first half without its first"
        " quarter.",
        "bench_blenderproc.py measures BlenderProc itself. Its users report about 50 images per minute (0.8 per"
        " second; DLR-RM/BlenderProc issue 6, colour with labels by path tracing, size and machine not stated) and 17"
        " images in 10.5 minutes (0.03 per second; issue 496, segmentation).",
    ]
    report.write("dataset", "Data sets", notes, ["format", "seconds", "frames/s", "MiB", "growth"], rows)


if __name__ == "__main__":
    main()
