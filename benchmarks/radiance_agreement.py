"""Compares raycam's images with those of another renderer: mean radiance, and every pixel.

Each renderer computes several independent images of each scene. Their spread gives the standard error of each
pixel. The spread of the images' means gives the standard error of the whole mean, because pixels and channels
of one image are not independent of each other.

For each pixel and colour, the difference divided by its standard error follows Student's t distribution if
both renderers are right (Welch). Then 0.25 % of the values are expected to be beyond the 99.75 % quantile. In
addition, 99.75 % of the pixels must pass at the level 0.01 with Sidak's correction; this is the test that
Mitsuba uses.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import path_raycam
import path_scenes
import path_worker
import report

PICTURES = 16
# Seeds that are far apart, because Mitsuba seeds its pixels with the numbers after the image's seed.
SEED_STEP = 100_003


def spread(picture: Any, samples: int) -> tuple[Any, Any, float]:
    """Returns the mean of independent images, its standard error, and that of the total mean.

    The total mean is the mean over all pixels and colours.
    """
    seeds = range(1, SEED_STEP * PICTURES, SEED_STEP)
    pictures = np.array([picture(samples, seed)[0] for seed in seeds], np.float64)
    means = pictures.mean(axis=(1, 2, 3))
    of_pixels = pictures.std(axis=0, ddof=1) / np.sqrt(PICTURES)
    return pictures.mean(axis=0), of_pixels, float(means.std(ddof=1) / np.sqrt(PICTURES))


def judge(a: Any, b: Any) -> tuple[float, float, float]:
    """Returns the relative difference of the means, and two fractions of pixels.

    The first is the fraction of pixels within the 99.75 % quantile, the second the fraction that passes
    Mitsuba's test.
    """
    from scipy import stats

    (mine, my_error, _), (its, its_error, _) = a, b
    v = my_error**2 + its_error**2
    freedom = v**2 / np.maximum((my_error**4 + its_error**4) / (PICTURES - 1), 1e-300)
    # Neither image has noise, so only rounding errors remain.
    floor = 1e-5 * np.maximum(np.abs(its), 1e-3)
    t = (mine - its) / np.sqrt(v + floor**2)
    p = 2 * stats.t.sf(np.abs(t), np.maximum(freedom, PICTURES - 1))
    level = 1 - 0.99 ** (1 / p.size)
    off = float(mine.mean() / its.mean() - 1)
    return off, float((p > 0.0025).mean()), float((p > level).mean())


def save(path: Path, image: Any) -> None:
    """Saves an sRGB image for visual inspection."""
    from PIL import Image

    x = np.clip(image, 0, 1)
    srgb = np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055)
    size = (image.shape[1] * 5, image.shape[0] * 5)
    Image.fromarray((srgb * 255 + 0.5).astype(np.uint8)).resize(size, Image.Resampling.NEAREST).save(path)


def compare(renderer: str, name: str, doc: str | None, settings: dict[str, str]) -> None:
    """Runs a comparison from the command line.

    Each key of `settings` becomes an option, whose value is passed to the renderer.
    """
    parser = argparse.ArgumentParser(description=doc)
    parser.add_argument("--python", default=sys.executable, help=f"Python interpreter with {name}")
    parser.add_argument(
        "--samples", type=int, default=128, help=f"samples per pixel of each of the {PICTURES} images"
    )
    parser.add_argument("--size", type=int, nargs=2, default=[96, 72])
    parser.add_argument("--scenes", nargs="+", metavar="NAME")
    parser.add_argument(
        "--pictures", metavar="FOLDER", type=Path, help="folder that keeps the images of both renderers"
    )
    for key, default in settings.items():
        parser.add_argument(f"--{key}", default=default)
    options = parser.parse_args()
    chosen = {key: getattr(options, key) for key in settings}
    size = tuple(options.size)
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for scene, parts in path_scenes.scenes(Path(folder)).items():
            if options.scenes and scene not in options.scenes:
                continue
            mine = spread(path_raycam.picture(parts, size), options.samples)
            with path_worker.picture(renderer, options.python, parts, size, **chosen) as picture:
                its = spread(picture, options.samples)
            off, within, passed = judge(mine, its)
            noise = np.hypot(mine[2], its[2]) / mine[0].mean()
            rows.append(
                [
                    scene,
                    f"{mine[0].mean():.5f}",
                    f"{its[0].mean():.5f}",
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
                save(options.pictures / f"{renderer}-{scene}.png", np.hstack([mine[0], its[0]]))
    notes = [f"{name}: {', '.join(chosen.values())}."] if chosen else []
    notes += [
        f"{size[0]} x {size[1]}, {PICTURES * options.samples} samples per pixel in {PICTURES} independent images, "
        f"paths of at most {path_scenes.DEPTH} segments, box filter.",
    ]
    head = ["scene", "raycam", name, "difference", "standard error", "standard errors"]
    head += ["t within 99.75 %", "Sidak test passed"]
    report.write(renderer, f"Radiance compared with {name}", notes, head, rows)
