"""Are pictures the same as Mitsuba's? Mean radiance, and a test of every pixel, on the scenes of `bench_path.py`.

Each renderer makes a number of independent pictures of each scene: their mean, and from their spread the standard error
of each pixel; from the spread of the pictures' means that of the whole, because the pixels of one picture, and its
channels, are not independent of each other. Per pixel and colour, the difference over its standard error is Student's t
where both are right (Welch). 0.25 % of them should lie beyond the quantile of 99.75 %, and 99.75 % of the pixels must
pass at the level 0.01 with Sidak's correction, which is how Mitsuba tests itself. Mitsuba is another Python's
(`--mitsuba PYTHON`).
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

PICTURES = 16


# Far apart: Mitsuba's pixels take the seeds that follow a picture's.
SEED_STEP = 100_003


def spread(picture: Any, samples: int) -> tuple[Any, Any, float]:
    """The mean of independent pictures, its standard error, and that of the mean of all pixels."""
    seeds = range(1, SEED_STEP * PICTURES, SEED_STEP)
    pictures = np.array([picture(samples, seed)[0] for seed in seeds], np.float64)
    means = pictures.mean(axis=(1, 2, 3))
    of_pixels = pictures.std(axis=0, ddof=1) / np.sqrt(PICTURES)
    return pictures.mean(axis=0), of_pixels, float(means.std(ddof=1) / np.sqrt(PICTURES))


def judge(a: Any, b: Any) -> tuple[float, float, float]:
    """The difference of the means, the share of pixels within 99.75 %, and the share that passes Mitsuba's own test."""
    from scipy import stats

    (mine, my_error, _), (its, its_error, _) = a, b
    v = my_error**2 + its_error**2
    freedom = v**2 / np.maximum((my_error**4 + its_error**4) / (PICTURES - 1), 1e-300)
    # Where both have no noise there is rounding alone.
    floor = 1e-5 * np.maximum(np.abs(its), 1e-3)
    t = (mine - its) / np.sqrt(v + floor**2)
    p = 2 * stats.t.sf(np.abs(t), np.maximum(freedom, PICTURES - 1))
    level = 1 - 0.99 ** (1 / p.size)
    off = float(mine.mean() / its.mean() - 1)
    return off, float((p > 0.0025).mean()), float((p > level).mean())


def save(path: Path, image: Any) -> None:
    """A picture to look at, in sRGB."""
    from PIL import Image

    x = np.clip(image, 0, 1)
    srgb = np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055)
    Image.fromarray((srgb * 255 + 0.5).astype(np.uint8)).resize((480, 360), Image.Resampling.NEAREST).save(
        path
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--mitsuba", metavar="PYTHON", default=sys.executable, help="a Python that has Mitsuba"
    )
    parser.add_argument("--variant", default="scalar_rgb")
    parser.add_argument("--samples", type=int, default=128, help=f"of each of {PICTURES} pictures")
    parser.add_argument("--size", type=int, nargs=2, default=[96, 72])
    parser.add_argument("--scenes", nargs="+", metavar="NAME")
    parser.add_argument("--pictures", metavar="FOLDER", type=Path, help="where to keep what both see")
    parser.add_argument("--worker", metavar="FILE", help=argparse.SUPPRESS)
    options = parser.parse_args()
    bench_path.SIZE = tuple(options.size)
    if options.worker:
        task = json.loads(Path(options.worker).read_text())
        mean, error, whole = spread(bench_path.theirs(task["scene"], options.variant), options.samples)
        np.savez(task["out"], mean=mean, error=error, whole=whole)
        return
    import report

    rows = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for scene, parts in bench_path.scenes(folder).items():
            if options.scenes and scene not in options.scenes:
                continue
            mine = spread(bench_path.ours(parts), options.samples)
            task, out = folder / "task.json", folder / "out.npz"
            task.write_text(json.dumps({"scene": parts, "out": str(out)}))
            command = [options.mitsuba, __file__, "--worker", str(task), "--variant", options.variant]
            command += ["--samples", str(options.samples), "--size", *map(str, options.size)]
            subprocess.run(command, check=True)
            found = np.load(out)
            theirs = (found["mean"], found["error"], float(found["whole"]))
            off, within, passed = judge(mine, theirs)
            noise = np.hypot(mine[2], theirs[2]) / mine[0].mean()
            rows.append(
                [
                    scene,
                    f"{mine[0].mean():.5f}",
                    f"{found['mean'].mean():.5f}",
                    f"{100 * off:+.3f} %",
                    f"{100 * noise:.3f} %",
                    f"{off / noise:+.1f}",
                    f"{100 * within:.2f} %",
                    f"{100 * passed:.2f} %",
                ]
            )
            print(*rows[-1], file=sys.stderr)
            if options.pictures:
                options.pictures.mkdir(parents=True, exist_ok=True)
                save(options.pictures / f"{scene}.png", np.hstack([mine[0], found["mean"]]))
    total = PICTURES * options.samples
    notes = [
        f"{options.size[0]} x {options.size[1]}, {total} samples per pixel in {PICTURES} independent pictures, paths "
        f"of at most {bench_path.DEPTH} segments, box filter, {options.variant}.",
    ]
    head = [
        "scene",
        "raycam",
        "Mitsuba",
        "difference",
        "standard error",
        "standard errors",
        "|t| within 99.75 %",
        "Sidak test passed",
    ]
    report.write("mitsuba", "The same pictures as Mitsuba 3", notes, head, rows)


if __name__ == "__main__":
    main()
