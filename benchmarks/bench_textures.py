"""Renders many large generated images with and without a limit of texture memory.

    python benchmarks/bench_textures.py [--images N] [--side TEXELS] [--limits SIZE ...] [--samples N]

Every image is the texture of one object. The first view shows all objects from above, next to each other. In
the second view ("near"), one object fills the image, so that each texel is looked up. Each limit runs in a
process of its own; `none` means no limit.

The table contains the seconds for loading and rendering, the process's peak memory in addition to the memory
before loading (Linux: VmHWM; while loading and in total), the bytes read from the temporary file, and whether
the images equal those of the first limit.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import report
from PIL import Image

MEASURE = r"""
import hashlib, json, re, sys, time
import raycam
folder, count, limit, samples = sys.argv[1], int(sys.argv[2]), sys.argv[3], int(sys.argv[4])
peak = lambda: int(open("/proc/self/status").read().split("VmHWM:")[1].split()[0]) / 1024
columns = int(count**0.5 + 0.999)
def view(eye, target, fov):
    return raycam.Camera.look_at(eye, target, up=[0, 1, 0], size=(640, 480), fov=fov)
far = view([0, -columns, columns], [0, 0, 0], 60)
near = view([0, -0.3, 0.5], [0, 0, 0], 60)
raycam.render(raycam.World(), far, integrator="path", samples=1)
before = peak()
start = time.perf_counter()
if limit == "none":
    world = raycam.World(folder=folder)
else:
    world = raycam.World(folder=folder, texture_memory=limit)
for i in range(count):
    place = [1.05 * (i % columns - columns // 2), 1.05 * (i // columns - columns // 2), 0]
    world.add_object(plane={"size": 1}, location=place, texture=f"{i}.png")
world.add_light(type="sky", radiance=[1, 1, 1])
loaded = time.perf_counter() - start
peaks = [peak() - before]
world.prepare()
times, read, digest = [], 0.0, hashlib.sha256()
for camera in (far, far, near):
    start = time.perf_counter()
    frame = raycam.render(world, camera, integrator="path", samples=samples, max_depth=2)
    times.append(time.perf_counter() - start)
    digest.update(frame["color"].tobytes())
    for notice in frame.notices:
        found = re.search(r"tiles of textures \(([0-9.]+) (.)iB\)", notice)
        read += float(found[1]) / (1024 if found[2] == "K" else 1) if found else 0
print(json.dumps([loaded, *times, *peaks, peak() - before, read, digest.hexdigest()]))
"""


def make(folder: Path, count: int, side: int) -> None:
    """Writes images of coloured blocks with fine noise, which PNG compresses little.

    All are shifted copies of one image.
    """
    random = np.random.default_rng(0)
    blocks = np.kron(
        random.integers(0, 240, (side // 64, side // 64, 3), np.uint8), np.ones((64, 64, 1), np.uint8)
    )
    texels = blocks + random.integers(0, 16, (side, side, 3), np.uint8)
    for i in range(count):
        Image.fromarray(np.roll(texels, 97 * i, (0, 1))).save(folder / f"{i}.png", compress_level=1)


def main() -> None:
    """Runs the measurements, and saves the table."""
    options = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    options.add_argument("--images", type=int, default=24)
    options.add_argument("--side", type=int, default=4096)
    options.add_argument("--limits", nargs="+", default=["none", "64GiB", "512MiB", "64MiB", "4MiB"])
    options.add_argument("--samples", type=int, default=16)
    given = options.parse_args()
    rows, first = [], None
    with tempfile.TemporaryDirectory(dir=os.environ.get("TMPDIR", "/var/tmp")) as name:
        make(Path(name), given.images, given.side)
        for limit in given.limits:
            command = [sys.executable, "-c", MEASURE, name, str(given.images), limit, str(given.samples)]
            ran = subprocess.run(command, capture_output=True, text=True, check=True)
            loaded, cold, again, near, load_peak, whole_peak, read, digest = json.loads(ran.stdout)
            first = first or digest
            seconds = [f"{value:.2f}" for value in (loaded, cold, again, near)]
            memory = [f"{value:.0f}" for value in (load_peak, whole_peak, read)]
            rows.append([limit, *seconds, *memory, "yes" if digest == first else "NO"])
            print(rows[-1], file=sys.stderr, flush=True)
    report.write(
        "textures",
        "Textures that exceed their memory limit",
        [
            f"{given.images} images of {given.side} x {given.side}, 8 bits; 640 x 480 pixels, {given.samples} samples."
        ],
        ["limit", "load s", "far s", "again s", "near s", "load MiB", "peak MiB", "read MiB", "same"],
        rows,
    )


if __name__ == "__main__":
    main()
