"""Compares processor time times variance with another raycam build and other renderers.

    python benchmarks/light_in_turn.py [--before FOLDER] [--mitsuba PYTHON] [--cycles PYTHON] [--pbrt EXECUTABLE]
        [--hard | --random] [--scenes NAME ...] [--size WIDTH HEIGHT]

FOLDER contains the package `raycam` of the other build; PYTHON is an interpreter with Mitsuba or `bpy`. The
renderers run in alternation. Times are processor times of all threads, so that they do not depend on the load
of the machine. The error is the variance over seeds, relative to the squared mean plus 0.01. It needs no
reference, because all these renderers are unbiased. The gain is the ratio of the products of time and error,
which equals the ratio of the times to equal error.

For Mitsuba and pbrt, the better of two samplers counts; for Cycles, the better result of rendering with and
without path guiding. The times of Cycles and pbrt include their samples only.
"""

from __future__ import annotations

import argparse
import importlib
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
import report
from hard_scenes import DEPTH as HARD_DEPTH
from hard_scenes import hard_scenes
from path_scenes import DEPTH, Scene, scenes

RANDOM_SCENES = 30
# Renderers that are installed for other Python interpreters, with each renderer's module and settings.
OTHERS: dict[str, tuple[str, dict[str, Any]]] = {
    f"mitsuba {sampler}": ("path_mitsuba", {"variant": "llvm_ad_rgb", "sampler": sampler})
    for sampler in ("independent", "multijitter")
}
OTHERS["mitsuba scalar"] = ("path_mitsuba", {"variant": "scalar_rgb", "sampler": "independent"})
OTHERS |= {"cycles": ("path_cycles", {}), "cycles guided": ("path_cycles", {"use_guiding": True})}
OTHERS |= {f"pbrt {sampler}": ("path_pbrt", {"sampler": sampler}) for sampler in ("independent", "zsobol")}
FAMILIES = ("before", "mitsuba", "cycles", "pbrt")

Found = dict[str, float]


def measure(options: argparse.Namespace) -> Found:
    """Returns figures of one renderer and scene: time, variance, worst share and mean.

    The time is the processor time of an image, and the variance the mean over its pixels. The worst share is
    the 1 % noisiest pixels' share of the total variance.
    """
    scene = json.loads(options.one.read_text(encoding="utf-8"))
    name, settings = OTHERS.get(options.other, ("path_raycam", {}))
    module: Any = importlib.import_module(name)
    clocks = {"path_cycles": {"clock": time.process_time}, "path_pbrt": {"executable": options.pbrt}}
    own = clocks.get(name, {})
    picture = module.picture(scene, options.size, **settings, **own)
    picture(options.samples, 999)  # not measured: Mitsuba compiles kernels for each number of samples
    pictures, times = [], []
    for seed in range(options.seeds):
        start = time.process_time()
        image, seconds = picture(options.samples, seed + 1)
        times.append(seconds if own else time.process_time() - start)
        pictures.append(np.asarray(image, np.float64))
    mean = np.mean(pictures, axis=0)
    variance = (np.var(pictures, axis=0, ddof=1) / (mean**2 + 0.01)).mean(axis=2).ravel()
    worst = np.sort(variance)[-max(1, variance.size // 100) :].sum() / variance.sum()
    return {
        "seconds": min(times),
        "variance": float(variance.mean()),
        "worst": float(worst),
        "mean": float(mean.mean()),
    }


def rivals_of(options: argparse.Namespace) -> dict[str, tuple[list[str], str | None]]:
    """Returns each renderer's command for a measurement, and the folder of its package."""
    import raycam

    this = [sys.executable, __file__]
    now = {"raycam": (this, str(Path(raycam.__file__).parents[1]))}
    if options.before:
        now["before"] = (this, str(options.before.resolve()))
    commands = {"path_mitsuba": [options.mitsuba, __file__], "path_cycles": [options.cycles, __file__]}
    commands["path_pbrt"] = [options.pbrt and sys.executable, __file__, "--pbrt", options.pbrt]
    for other, (module, _) in OTHERS.items():
        if commands[module][0]:
            now[other] = ([*commands[module], "--other", other], None)
    return now


def in_turn(scene: Path, options: argparse.Namespace) -> dict[str, Found]:
    """Returns the figures of each renderer on a scene.

    The renderers run in alternation, and the best time of several rounds counts.
    """
    best: dict[str, Found] = {}
    for _ in range(options.turns):
        for rival, (command, package) in rivals_of(options).items():
            asked = [*command, "--one", str(scene), "--seeds", str(options.seeds)]
            asked += ["--samples", str(options.samples), "--size", *map(str, options.size)]
            environment = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
            if package:
                environment["PYTHONPATH"] = package
            done = subprocess.run(asked, check=True, capture_output=True, text=True, env=environment)
            # Renderers also print to this stream, sometimes on the same line.
            one, _ = json.JSONDecoder().raw_decode(done.stdout[done.stdout.index('{"seconds"') :])
            best[rival] = {**one, "seconds": min(one["seconds"], best.get(rival, one)["seconds"])}
    return best


def row_of(name: str, found: dict[str, Found]) -> tuple[list[str], float]:
    """Returns a scene's row of the table, and the gain over the best of the other renderers."""
    mine = found.pop("raycam")
    cost = mine["seconds"] * mine["variance"]
    gains = {rival: one["seconds"] * one["variance"] / cost for rival, one in found.items()}
    rival = min(gains, key=lambda one: gains[one])
    pair = (mine, found[rival])
    row = [name, rival, *(f"{1e3 * one['seconds']:.0f}" for one in pair)]
    row += [f"{one['variance']:.2e}" for one in pair] + [f"{100 * one['worst']:.0f}" for one in pair]
    row.append(f"{mine['mean'] / found[rival]['mean']:.4f}")
    for family in FAMILIES:
        own = [gain for other, gain in gains.items() if other.startswith(family)]
        row.append(f"{min(own):.2f}" if own else "")
    return row, gains[rival]


def worlds(options: argparse.Namespace, folder: Path) -> dict[str, Scene]:
    """Returns the scenes by name, and writes their triangles to the folder."""
    if options.random:
        from random_scenes import scene  # requires raycam, which other interpreters do not have

        return {str(seed): scene(seed, folder, None) for seed in range(RANDOM_SCENES)}
    return hard_scenes(folder) if options.hard else scenes(folder)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--before", type=Path, help="package folder of another raycam build")
    parser.add_argument("--mitsuba", metavar="PYTHON", help="Python interpreter with Mitsuba")
    parser.add_argument("--cycles", metavar="PYTHON", help="Python interpreter with bpy")
    parser.add_argument("--pbrt", metavar="EXECUTABLE", help="path of the pbrt-v4 program")
    parser.add_argument("--hard", action="store_true", help="render the scenes with difficult light")
    parser.add_argument("--random", action="store_true", help="render the worlds of random_scenes.py")
    parser.add_argument("--turns", type=int, default=2)
    parser.add_argument("--unlimited", action="store_true", help="do not limit the number of path segments")
    parser.add_argument("--scenes", nargs="+", metavar="NAME")
    parser.add_argument("--seeds", type=int, default=8)
    parser.add_argument("--samples", type=int, default=256)
    parser.add_argument("--size", nargs=2, type=int, default=(48, 36), metavar=("WIDTH", "HEIGHT"))
    parser.add_argument("--one", type=Path, help=argparse.SUPPRESS)
    parser.add_argument("--other", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.one:
        print(json.dumps(measure(options)))
        return
    if not (options.before or options.mitsuba or options.cycles or options.pbrt):
        parser.error("no renderer to compare with; use --before, --mitsuba, --cycles or --pbrt")
    rows, gains = [], []
    depth = HARD_DEPTH if options.hard else DEPTH
    depth = None if options.unlimited else depth
    with tempfile.TemporaryDirectory() as folder:
        known = worlds(options, Path(folder))
        for name in options.scenes or known:
            scene = Path(folder) / "scene.json"
            scene.write_text(json.dumps({**known[name], "depth": depth}), encoding="utf-8")
            row, gain = row_of(name, in_turn(scene, options))
            print(*row, file=sys.stderr, flush=True)
            rows.append(row)
            gains.append(gain)
    mean = math.exp(sum(map(math.log, gains)) / len(gains))
    head = [
        "scene",
        "best other",
        "raycam ms",
        "its ms",
        "raycam's variance",
        "its",
        "in the worst 1 %",
        "its",
    ]
    notes = [
        f"{options.size[0]} x {options.size[1]} pixels, {options.samples} samples, "
        f"paths of {f'at most {depth}' if depth else 'any number of'} segments; "
        f"best of {options.turns} turns of {options.seeds} seeds. Geometric mean of the gains: {mean:.2f}."
    ]
    kinds = {
        "hard": options.hard,
        "random": options.random,
        "unlimited": options.unlimited,
        "others": options.mitsuba or options.cycles,
        "pbrt": options.pbrt,
    }
    name = "_".join(["light_in_turn", *(kind for kind, asked in kinds.items() if asked)])
    head += ["mean", *(f"gain over {family}" for family in FAMILIES)]
    shown = [at for at in range(len(head)) if any(row[at] for row in rows)]
    table = [[row[at] for at in shown] for row in [head, *rows]]
    report.write(name, "Light, in turn", notes, table[0], table[1:])


if __name__ == "__main__":
    main()
