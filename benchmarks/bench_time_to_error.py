"""Compares the time to equal error with Mitsuba 3 and Cycles, on `path_scenes.py`.

The error is the mean of (x - r)^2 / (r^2 + 0.01) over pixels and channels (relMSE). The reference r is an
image by the same renderer with 16,384 samples per pixel, so that differences in how renderers interpret a
scene do not count as errors.

Every renderer renders the scene with increasing numbers of samples per pixel, in alternation with the others.
Power laws interpolate the time between these measurements. Mitsuba and Cycles are measured in several
settings, and the fastest setting counts. The target is the smallest error that one of them has with 256 samples.

Mitsuba and Cycles run in other interpreters (`--mitsuba PYTHON`, `--cycles PYTHON`). The time of Cycles
includes its samples only. `--keep FOLDER` stores references and measurements and measures only missing ones,
so that a long run can be divided into parts.
"""

from __future__ import annotations

import argparse
import contextlib
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import path_raycam
import path_worker
import report
from hard_scenes import DEPTH as HARD_DEPTH
from hard_scenes import hard_scenes
from path_scenes import DEPTH, Array, Scene, further, scenes

SIZE = (64, 48)
REFERENCE = 16384
LADDER = (16, 64, 256, 1024)
TARGET = 256
PAUSE = 0.1  # seconds between two measurements
MITSUBA = [
    {"variant": variant, "sampler": sampler}
    for variant in ("scalar_rgb", "llvm_ad_rgb")
    for sampler in ("independent", "multijitter")
]
CYCLES: list[dict[str, Any]] = [{}, {"use_light_tree": False}, {"use_guiding": True}]


@contextlib.contextmanager
def renderer(name: str, python: str, scene: Scene, settings: dict[str, Any]) -> Iterator[Any]:
    """Yields a function that renders an image: (samples, seed) to (image, seconds)."""
    if name == "raycam":
        yield path_raycam.picture(scene, SIZE)
    else:
        with path_worker.picture(name, python, scene, SIZE, **settings) as picture:
            yield picture


def reference(picture: Any) -> Array:
    """Returns the mean of many samples with seeds that no measurement uses."""
    parts = 16
    total = sum(
        np.asarray(picture(REFERENCE // parts, 1_000_003 * (1 + part))[0], np.float64)
        for part in range(parts)
    )
    return np.asarray(total / parts)


def climb(pictures: dict[str, Any], count: int) -> dict[str, tuple[Array, Array]]:
    """Renders several images for each number of samples; returns images and best seconds.

    The renderers run in alternation, with pauses.
    """

    def rested(picture: Any, samples: int, seed: int) -> Any:
        time.sleep(PAUSE)
        return picture(samples, seed)

    images: dict[str, list[list[Array]]] = {key: [] for key in pictures}
    times: dict[str, list[float]] = {key: [] for key in pictures}
    for samples in LADDER:
        # Some renderers compile kernels for each number of samples.
        for picture in pictures.values():
            picture(samples, 0)
        found = [
            {key: rested(picture, samples, 1 + seed) for key, picture in pictures.items()}
            for seed in range(count)
        ]
        for key in pictures:
            images[key].append([turn[key][0] for turn in found])
            times[key].append(min(turn[key][1] for turn in found))
    return {key: (np.array(images[key], np.float64), np.array(times[key])) for key in pictures}


def rungs(path: Path, truth: Array) -> list[tuple[float, float]]:
    """Returns (seconds, mean error) for each number of samples in a stored file."""
    kept = np.load(path)
    errors = ((kept["images"] - truth) ** 2 / (truth**2 + 0.01)).mean(axis=(1, 2, 3, 4))
    return [(float(took), float(error)) for took, error in zip(kept["times"], errors, strict=True)]


def time_to(error: float, ladder: list[tuple[float, float]]) -> float:
    """Returns the seconds to an error, from measurements of (seconds, error).

    The logarithms are interpolated between the two surrounding measurements, or extrapolated from the nearest
    two.
    """
    times, errors = np.log(np.array(ladder)).T
    at = int(np.clip(np.searchsorted(-errors, -np.log(error)), 1, len(ladder) - 1))
    slope = (times[at] - times[at - 1]) / (errors[at] - errors[at - 1])
    return float(np.exp(times[at] + slope * (np.log(error) - errors[at])))


def label(name: str, settings: dict[str, Any]) -> str:
    return " ".join(
        [name, *(value if isinstance(value, str) else f"{key}={value}" for key, value in settings.items())]
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--mitsuba", metavar="PYTHON", help="Python interpreter with Mitsuba")
    parser.add_argument("--cycles", metavar="PYTHON", help="Python interpreter with bpy")
    parser.add_argument("--pictures", type=int, default=2, help="images per number of samples")
    parser.add_argument(
        "--further", metavar="IMAGE", help="render the additional scenes, lit by this environment image"
    )
    parser.add_argument("--hard", action="store_true", help="render the scenes with difficult light")
    parser.add_argument("--scenes", nargs="+", metavar="NAME")
    parser.add_argument("--renderers", nargs="+", metavar="NAME", help="measure only these renderers")
    parser.add_argument(
        "--keep", metavar="FOLDER", help="folder that keeps references and error curves between runs"
    )
    parser.add_argument(
        "--only",
        choices=["references", "ladders"],
        help="compute and keep only the references, or only the error curves",
    )
    options = parser.parse_args()
    if options.further and options.cycles:
        parser.error("the additional scenes are not available for Cycles: omit --cycles")
    plan: list[tuple[str, str, dict[str, Any]]] = [("raycam", "", {})]
    plan += [("mitsuba", options.mitsuba, settings) for settings in MITSUBA if options.mitsuba]
    plan += [("cycles", options.cycles, settings) for settings in CYCLES if options.cycles]
    rows, ratios = [], []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        kept = Path(options.keep or name)
        kept.mkdir(parents=True, exist_ok=True)
        if options.hard:
            chosen = hard_scenes(folder)
        else:
            chosen = further(folder, Path(options.further)) if options.further else scenes(folder)
        for scene, parts in chosen.items():
            if options.scenes and scene not in options.scenes:
                continue
            asked = [one for one in plan if not options.renderers or one[0] in options.renderers]
            ladders = {
                label(kind, settings): kept / f"{scene}-{label(kind, settings)}.npz"
                for kind, _, settings in asked
            }
            with contextlib.ExitStack() as stack:
                pictures = {}
                for kind, python, settings in asked:
                    truth, key = kept / f"{scene}-{kind}.npy", label(kind, settings)
                    refer = options.only != "ladders" and not truth.exists()
                    climbs = options.only != "references" and not ladders[key].exists()
                    if not refer and not climbs:
                        continue
                    picture = stack.enter_context(renderer(kind, python, parts, settings))
                    if refer:
                        np.save(truth, reference(picture))
                    if climbs:
                        pictures[key] = picture
                for key, (images, times) in climb(pictures, options.pictures).items():
                    np.savez(ladders[key], images=images, times=times)
            if options.only:
                continue
            found = {
                label(kind, settings): rungs(
                    ladders[label(kind, settings)], np.load(kept / f"{scene}-{kind}.npy")
                )
                for kind, _, settings in asked
            }
            mine = found.pop("raycam", None)
            if mine is None:
                continue
            row = [scene, *(f"{error:.2e}" for _, error in mine)]
            if found:
                error = min(rung[LADDER.index(TARGET)][1] for rung in found.values())
                times = {key: time_to(error, rung) for key, rung in found.items()}
                best = min(times, key=lambda key: times[key])
                took = time_to(error, mine)
                ratios.append(times[best] / took)
                row += [f"{error:.2e}", f"{1e3 * took:.0f}"]
                for kind in ("mitsuba", "cycles"):
                    own = [times[key] for key in times if key.startswith(kind)]
                    row.append(f"{1e3 * min(own):.0f}" if own else "")
                row += [best, f"{ratios[-1]:.2f}"]
            rows.append(row)
            print(*row, file=sys.stderr)
    if not rows:
        return
    head = ["scene", *(f"raycam's error at {samples}" for samples in LADDER)]
    depth = HARD_DEPTH if options.hard else DEPTH
    notes = [
        f"{SIZE[0]} x {SIZE[1]}, paths of at most {depth} segments, box filter; relMSE relative to {REFERENCE} samples "
        f"of the same renderer; best time and mean error of {options.pictures} images."
    ]
    if ratios:
        head += ["error to reach", "raycam ms", "Mitsuba ms", "Cycles ms", "best of them", "times faster"]
        mean = float(np.exp(np.mean(np.log(ratios))))
        notes.append(f"Geometric mean of the last column: {mean:.2f}.")
    kind = "_hard" if options.hard else "_further" if options.further else ""
    name = f"time_to_error{kind}"
    report.write(name, "Time to equal error, compared with Mitsuba 3 and Cycles", notes, head, rows)


if __name__ == "__main__":
    main()
