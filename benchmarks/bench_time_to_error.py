"""How long it takes to the same error beside Mitsuba 3: the six scenes of `bench_path.py`.

The error is the mean of (x - r)^2 / (r^2 + 0.01) over pixels and channels (relMSE), where r is a reference of 16384
samples per pixel by the same renderer: neither is charged for how the other one reads the scene. Every renderer takes
a ladder of samples per pixel; the time to the error that Mitsuba's best setting has at 64 samples is read off the
ladder, by power laws between its rungs. Mitsuba is another Python's (`--mitsuba PYTHON`), in every variant given, with
the samplers `independent` and `multijitter`.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import bench_path
import numpy as np
import numpy.typing as npt

SIZE = (64, 48)
REFERENCE = 16384
LADDER = (4, 16, 64, 256)
TARGET = 64
SAMPLERS = ("independent", "multijitter")
Array = npt.NDArray[Any]


def reference(picture: Any, path: Path) -> Array:
    """The mean of many samples, whose seeds no rung of the ladder has; kept in a file."""
    if not path.exists():
        parts = 16
        total = sum(
            np.asarray(picture(REFERENCE // parts, 1000 + part)[0], np.float64) for part in range(parts)
        )
        np.save(path, total / parts)
    found: Array = np.load(path)
    return found


def ladder(picture: Any, truth: Array, pictures: int) -> list[tuple[float, float]]:
    """(seconds, error) of every rung: the best time and the mean error of some pictures."""
    picture(4, 0)
    rungs = []
    for samples in LADDER:
        errors, times = [], []
        for seed in range(pictures):
            image, took = picture(samples, 1 + seed)
            errors.append(np.mean((image - truth) ** 2 / (truth**2 + 0.01)))
            times.append(took)
        rungs.append((min(times), float(np.mean(errors))))
    return rungs


def time_to(error: float, rungs: list[tuple[float, float]]) -> float:
    """Between the rungs around it, or beyond the nearest two."""
    times, errors = np.log(np.array(rungs)).T
    at = int(np.clip(np.searchsorted(-errors, -np.log(error)), 1, len(rungs) - 1))
    slope = (times[at] - times[at - 1]) / (errors[at] - errors[at - 1])
    return float(np.exp(times[at] + slope * (np.log(error) - errors[at])))


def work(task: dict[str, Any], pictures: int) -> dict[str, list[tuple[float, float]]]:
    """Mitsuba's ladders for one scene in one variant."""
    path = Path(task["reference"])
    truth = reference(bench_path.theirs(task["scene"], task["variant"], SIZE), path)
    if task["only_reference"]:
        return {}
    return {
        sampler: ladder(bench_path.theirs(task["scene"], task["variant"], SIZE, sampler), truth, pictures)
        for sampler in SAMPLERS
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--mitsuba", metavar="PYTHON", help="a Python that has Mitsuba")
    parser.add_argument("--variants", nargs="+", default=["scalar_rgb", "llvm_ad_rgb"])
    parser.add_argument("--pictures", type=int, default=2, help="per rung")
    parser.add_argument("--scenes", nargs="+", metavar="NAME")
    parser.add_argument("--references", metavar="FOLDER", help="where references are kept from run to run")
    parser.add_argument("--only-references", action="store_true", help="measure nothing")
    parser.add_argument("--worker", metavar="FILE", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.worker:
        task = json.loads(Path(options.worker).read_text())
        Path(task["out"]).write_text(json.dumps(work(task, options.pictures)))
        return
    import report

    rows, ratios = [], []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        kept = Path(options.references or name)
        kept.mkdir(parents=True, exist_ok=True)
        for scene, parts in bench_path.scenes(folder).items():
            if options.scenes and scene not in options.scenes:
                continue
            settings: dict[str, list[tuple[float, float]]] = {}
            for variant in options.variants if options.mitsuba else []:
                task, out = folder / "task.json", folder / "out.json"
                content = {"scene": parts, "variant": variant, "out": str(out)}
                content |= {"reference": str(kept / f"{scene}-mitsuba.npy")}
                task.write_text(json.dumps(content | {"only_reference": options.only_references}))
                command = [options.mitsuba, __file__, "--worker", str(task)]
                subprocess.run([*command, "--pictures", str(options.pictures)], check=True)
                for sampler, rungs in json.loads(out.read_text()).items():
                    settings[f"{variant}, {sampler}"] = rungs
            picture = bench_path.ours(parts, SIZE)
            truth = reference(picture, kept / f"{scene}-raycam.npy")
            if options.only_references:
                continue
            rungs = ladder(picture, truth, options.pictures)
            row = [scene, *(f"{error:.2e}" for _, error in rungs)]
            if settings:
                target = min(found[LADDER.index(TARGET)][1] for found in settings.values())
                times = {key: time_to(target, found) for key, found in settings.items()}
                best = min(times, key=lambda key: times[key])
                mine = time_to(target, rungs)
                ratios.append(times[best] / mine)
                row += [f"{target:.2e}", f"{1e3 * mine:.0f}", f"{1e3 * times[best]:.0f}", best]
                row += [f"{ratios[-1]:.2f}"]
            rows.append(row)
            print(*row, file=sys.stderr)
    if options.only_references:
        return
    head = ["scene", *(f"raycam's error at {samples}" for samples in LADDER)]
    notes = [
        f"{SIZE[0]} x {SIZE[1]}, paths of at most {bench_path.DEPTH} segments, box filter; relMSE against {REFERENCE} "
        f"samples of the same renderer; best time and mean error of {options.pictures} pictures."
    ]
    if ratios:
        head += ["error to reach", "raycam ms", "Mitsuba ms", "Mitsuba's best", "times faster"]
        mean = float(np.exp(np.mean(np.log(ratios))))
        notes.append(f"Geometric mean of the times faster: {mean:.2f}.")
    report.write("time_to_error", "Time to equal error beside Mitsuba 3", notes, head, rows)


if __name__ == "__main__":
    main()
