"""Measures how the time of a primary ray grows with the number of triangles.

    python benchmarks/scaling.py [SCENE ...] [--triangles 0.25e6 1e6 ...] [--threads 1 2] [--size 1024 768]

Also measures the gain of a second thread. Generated scenes with increasing numbers of triangles are rendered
with the same camera: one ray for each pixel, in tiles of 8 x 8 pixels. The example `ray_bench` of crates/bvh
casts the rays, and Embree casts them for comparison on one thread (medium quality; the better of single rays
and packets). In images with few pixels, there are soon more triangles than rays. Neighbouring rays then read
fewer triangles and nodes in common.
"""

from __future__ import annotations

import argparse
import gc
import re
import subprocess
import tempfile
from pathlib import Path

import embree_race
import embree_race_scenes
import numpy as np
import report
from raycam import Camera
from raycam.bench import tile_order
from raycam.bench.scenes import SCENES, generate

ROOT = Path(__file__).resolve().parent.parent
RAY_BENCH = ROOT / "target/release/examples/ray_bench"


def prepare(folder: Path, name: str, triangles: int, size: tuple[int, int]) -> int:
    """Writes a scene and its rays; returns the number of triangles."""
    scene = generate(name, triangles)
    camera = Camera.look_at(scene.eye, scene.target, [0, 0, 1], size=size, fov=scene.fov)
    origins, directions = camera.rays(tile_order(*size))
    rays = np.concatenate([origins, directions, np.full((len(origins), 1), np.inf)], axis=1)
    rays.astype("<f4").tofile(folder / "primary.rays")
    embree_race_scenes.write_one(folder / "scene", scene)
    return len(scene.faces)


def play(folder: Path, threads: int, repeat: int) -> dict[str, float]:
    """Returns ray_bench's figures: build rate, bytes per triangle, and million rays per second."""
    command = [str(RAY_BENCH), str(folder / "scene.tri"), "--threads", str(threads), "--repeat", str(repeat)]
    command.append(str(folder / "primary.rays"))
    text = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    number = r"\s+([\d.]+)"
    build = re.search(rf"build{number} s{number} Mtri/s\s+held{number} B/tri\s+peak{number}", text)
    rays = re.search(rf"primary\s+best{number}", text)
    if build is None or rays is None:
        raise SystemExit(f"ray_bench printed: {text}")
    names = ("seconds", "build", "held", "peak")
    return dict(zip(names, map(float, build.groups()), strict=True)) | {"rays": float(rays[1])}


def embree_rays(driver: Path, folder: Path, size: tuple[int, int]) -> float:
    """Returns million primary rays per second on one thread."""
    command = [str(driver), str(folder / "scene"), "--threads", "1", "--size", "{}x{}".format(*size)]
    return embree_race.run(command)["primary"]


def grown(count0: float, time0: float, count: float, time: float) -> str:
    """Returns the factor by which the time of a ray grows if there are four times the triangles."""
    return f"{(time / time0) ** (np.log(4) / np.log(count / count0)):.2f}"


def main() -> None:
    """Measures and writes the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenes", nargs="*", default=list(SCENES))
    parser.add_argument("--triangles", type=float, nargs="+", default=[0.25e6, 1e6, 4e6, 16e6, 64e6])
    parser.add_argument("--threads", type=int, nargs="+", default=[1, 2])
    parser.add_argument("--repeat", type=int, default=7)
    parser.add_argument("--size", type=int, nargs=2, default=[1024, 768], help="image size in pixels")
    options = parser.parse_args()
    cargo = ["cargo", "build", "-q", "--locked", "--release", "-p", "raycam-bvh", "--example", "ray_bench"]
    subprocess.run(cargo, cwd=ROOT, check=True)
    size = (options.size[0], options.size[1])
    rows = []
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        driver = embree_race.embree_driver(folder)
        for name in options.scenes:
            before: list[float] = []
            for asked in options.triangles:
                count = prepare(folder, name, int(asked), size)
                gc.collect()
                found = [play(folder, threads, options.repeat) for threads in options.threads]
                times = [1e3 / rate for rate in (found[0]["rays"], embree_rays(driver, folder, size))]
                row = [name, f"{count:,}"]
                for k, time in enumerate(times):
                    row += [f"{time:.1f}", grown(before[0], before[k + 1], count, time) if before else ""]
                before = [count, *times]
                row += [f"{more['rays'] / found[0]['rays']:.2f}" for more in found[1:]]
                last = found[-1]
                row += [f"{last['build']:.2f}", f"{last['held']:.1f}", f"{last['peak']:.1f}"]
                rows.append(row)
                print(row, flush=True)
    one, *more = options.threads
    head = ["scene", "triangles", "ns per primary ray", "for 4x", "Embree, ns per ray", "for 4x"]
    head += [f"{n} threads to {one}" for n in more]
    head += [f"build, Mtri/s, {options.threads[-1]} threads", "held, B/tri", "peak, B/tri"]
    notes = [
        f"{size[0]} x {size[1]} rays. raycam's times on {one} thread, Embree's on one; best of "
        f"{options.repeat} (Embree: 7). "
        "Builds: best of 3. "
        "`for 4x`: the factor for four times as many triangles, computed from this row and the row above.",
    ]
    report.write("scaling", "Time of primary rays by the number of triangles", notes, head, rows)


if __name__ == "__main__":
    main()
