"""Light of this build beside another one's, in turn: processor time, variance, and what both make of it.

    python benchmarks/builds_in_turn.py --before FOLDER [--hard] [--scenes NAME ...]

FOLDER holds the package `raycam` of the other build. One thread; the gain is the ratio of time x relative variance,
which is that of the times to the same error.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
import path_raycam
import report
from hard_scenes import DEPTH as HARD_DEPTH
from hard_scenes import hard_scenes
from path_scenes import scenes

SIZE = (48, 36)
TURNS = 3


def scene_of(name: str, folder: Path, hard: bool) -> Any:
    """A scene of the benchmark, with its depth."""
    return {**hard_scenes(folder)[name], "depth": HARD_DEPTH} if hard else scenes(folder)[name]


def measure(name: str, folder: Path, hard: bool, seeds: int, samples: int) -> dict[str, float]:
    """Processor time of a picture, relative variance of its pixels, and mean, with the `raycam` that is imported."""
    import raycam

    whole = raycam.render
    raycam.render = lambda *given, **keys: whole(*given, threads=1, **keys)
    picture = path_raycam.picture(scene_of(name, folder, hard), SIZE)
    picture(1, 999)
    pictures, times = [], []
    for seed in range(seeds):
        start = time.process_time()
        pictures.append(np.asarray(picture(samples, seed + 1)[0], np.float64))
        times.append(time.process_time() - start)
    mean = np.mean(pictures, axis=0)
    variance = np.var(pictures, axis=0, ddof=1) / (mean**2 + 0.01)
    return {"seconds": min(times), "variance": float(variance.mean()), "mean": float(mean.mean())}


def in_turn(builds: dict[str, Path], options: argparse.Namespace) -> list[list[str]]:
    """The rows of the table, one a scene."""
    rows, gains = [], []
    with tempfile.TemporaryDirectory() as folder:
        known = hard_scenes(Path(folder)) if options.hard else scenes(Path(folder))
        for name in options.scenes or known:
            best: dict[str, dict[str, float]] = {}
            for _ in range(TURNS):
                for build, package in builds.items():
                    command = [sys.executable, __file__, "--one", name, "--folder", folder, "--before", "."]
                    command += ["--seeds", str(options.seeds), "--samples", str(options.samples)]
                    command += ["--hard"] if options.hard else []
                    environment = {**os.environ, "PYTHONPATH": str(package)}
                    done = subprocess.run(
                        command, check=True, capture_output=True, text=True, env=environment
                    )
                    one = json.loads(done.stdout)
                    known_seconds = best.get(build, one)["seconds"]
                    best[build] = {**one, "seconds": min(one["seconds"], known_seconds)}
            before, now = best["before"], best["now"]
            faster, steadier = before["seconds"] / now["seconds"], before["variance"] / now["variance"]
            gains.append(faster * steadier)
            rows.append(
                [
                    name,
                    *(f"{one['seconds']:.3f}" for one in (before, now)),
                    *(f"{one['variance']:.2e}" for one in (before, now)),
                    f"{now['mean'] / before['mean']:.4f}",
                    f"{faster:.2f}",
                    f"{faster * steadier:.2f}",
                ]
            )
            print(*rows[-1], flush=True)
    rows.append(
        ["geometric mean", *[""] * 6, f"{math.exp(sum(math.log(gain) for gain in gains) / len(gains)):.2f}"]
    )
    return rows


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--before", type=Path, required=True, help="the folder of the other build's package")
    parser.add_argument("--hard", action="store_true", help="the hard scenes instead")
    parser.add_argument("--scenes", nargs="+")
    parser.add_argument("--seeds", type=int, default=6)
    parser.add_argument("--samples", type=int, default=256)
    parser.add_argument("--one", help=argparse.SUPPRESS)
    parser.add_argument("--folder", type=Path, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.one:
        print(json.dumps(measure(options.one, options.folder, options.hard, options.seeds, options.samples)))
        return
    import raycam

    builds = {"before": options.before.resolve(), "now": Path(raycam.__file__).parents[1]}
    head = ["scene", "before, s", "now, s", "variance", "now", "mean", "time", "gain"]
    notes = [
        f"{SIZE[0]} x {SIZE[1]} pixels, {options.samples} samples, one thread; "
        f"best of {TURNS} turns of {options.seeds} seeds."
    ]
    kind = "hard light" if options.hard else "light"
    name = f"{kind.replace(' ', '_')}_in_turn"
    report.write(name, f"{kind.capitalize()}, beside another build", notes, head, in_turn(builds, options))


if __name__ == "__main__":
    main()
