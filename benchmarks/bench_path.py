"""Compares path tracing with Mitsuba 3 and Cycles: mean radiance, and samples per second.

All renderers use the same path length and the same triangles. Mitsuba and Cycles run in other interpreters:
`--mitsuba PYTHON` with `mitsuba`, `--cycles PYTHON` with `bpy`. The time of Cycles includes its samples only,
not its preparation.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import path_raycam
import path_worker
import report
from path_scenes import DEPTH, SIZE, Array, scenes


def measure(picture: Any, seconds: float) -> tuple[Array, float]:
    """Returns the mean of three images, and the best number of samples per second.

    The number of samples per pixel is chosen so that the three images take about `seconds`.
    """
    picture(4, 0)
    _, once = picture(16, 1)
    samples = int(np.clip(16 * seconds / 3 / once, 4, 1024))
    pictures, best = [], 0.0
    for seed in range(3):
        image, took = picture(samples, 2 + seed)
        pictures.append(image)
        best = max(best, SIZE[0] * SIZE[1] * samples / took)
    return np.mean(pictures, axis=0), best


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--mitsuba", metavar="PYTHON", help="Python interpreter with Mitsuba")
    parser.add_argument(
        "--variants", nargs="+", default=["scalar_rgb", "llvm_ad_rgb"], help="Mitsuba variants to measure"
    )
    parser.add_argument("--cycles", metavar="PYTHON", help="Python interpreter with bpy")
    parser.add_argument("--seconds", type=float, default=6.0, help="seconds per scene and renderer")
    parser.add_argument("--scenes", nargs="+", metavar="NAME")
    options = parser.parse_args()
    others: list[tuple[str, str, dict[str, str]]] = []
    if options.mitsuba:
        others += [("mitsuba", options.mitsuba, {"variant": variant}) for variant in options.variants]
    if options.cycles:
        others.append(("cycles", options.cycles, {}))
    rows = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for scene, parts in scenes(folder).items():
            if options.scenes and scene not in options.scenes:
                continue
            image, rate = measure(path_raycam.picture(parts, SIZE), options.seconds)
            row = [scene, f"{rate / 1e6:.2f}", f"{image.mean():.5f}"]
            for renderer, python, settings in others:
                with path_worker.picture(renderer, python, parts, SIZE, **settings) as picture:
                    its, rate = measure(picture, options.seconds)
                row += [f"{rate / 1e6:.2f}", f"{100 * (image.mean() / its.mean() - 1):+.3f} %"]
            rows.append(row)
            print(*row, file=sys.stderr)
    head = ["scene", "raycam Msamples/s", "mean radiance"]
    for renderer, _, settings in others:
        head += [f"{' '.join([renderer, *settings.values()])} Msamples/s", "difference of means"]
    notes = [f"{SIZE[0]} x {SIZE[1]}, paths of at most {DEPTH} segments, box filter; best of three pictures."]
    report.write("path", "Path tracing compared with Mitsuba 3 and Cycles", notes, head, rows)


if __name__ == "__main__":
    main()
