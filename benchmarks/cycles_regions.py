"""Compares regions of images with Cycles, in six scenes, one of them with plastic.

    python benchmarks/cycles_regions.py --python PYTHON     PYTHON has bpy (Blender as a module)

Both renderers compute 16 independent images of each scene. Every image is divided into 24 regions. The report
contains the largest difference of a region's mean, in per cent of Cycles' mean of this region, and the
standard error of that region.
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
from radiance_agreement import PICTURES, SEED_STEP

NAMES = ("rock", "gold", "glass", "pane", "box", "plastic")
SIZE = (48, 36)
COLUMNS, ROWS = 6, 4


def region_means(picture: Any, samples: int) -> Any:
    """Returns the means of all regions over the colours, [images, rows, columns]."""
    images = np.array(
        [picture(samples, seed)[0] for seed in range(1, SEED_STEP * PICTURES, SEED_STEP)], np.float64
    )
    width, height = SIZE[0] // COLUMNS, SIZE[1] // ROWS
    return images.reshape(PICTURES, ROWS, height, COLUMNS, width, 3).mean(axis=(2, 4, 5))


def main() -> None:
    """Prints a table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--python", default=sys.executable, help="Python interpreter with bpy")
    parser.add_argument(
        "--samples", type=int, default=128, help=f"samples per pixel of each of the {PICTURES} images"
    )
    parser.add_argument("--scenes", nargs="+", default=NAMES, metavar="NAME")
    parser.add_argument("--save", type=Path, help="folder that keeps the regions' means")
    given = parser.parse_args()
    print(
        "| scene | whole image | largest difference of a region | its standard error | in standard errors |"
    )
    print("| --- | --: | --: | --: | --: |")
    with tempfile.TemporaryDirectory() as folder:
        all_scenes = path_scenes.further(Path(folder), Path("none.hdr")) | path_scenes.scenes(Path(folder))
        for name in given.scenes:
            mine = region_means(path_raycam.picture(all_scenes[name], SIZE), given.samples)
            with path_worker.picture("cycles", given.python, all_scenes[name], SIZE) as picture:
                its = region_means(picture, given.samples)
            off = mine.mean(axis=0) / its.mean(axis=0) - 1
            noise = (
                np.hypot(mine.std(axis=0, ddof=1), its.std(axis=0, ddof=1))
                / np.sqrt(PICTURES)
                / its.mean(axis=0)
            )
            worst = np.unravel_index(np.abs(off).argmax(), off.shape)
            print(
                f"| {name} | {100 * (mine.mean() / its.mean() - 1):+.2f} % | {100 * off[worst]:+.2f} % "
                f"| {100 * noise[worst]:.2f} % | {off[worst] / noise[worst]:+.1f} |",
                flush=True,
            )
            if given.save:
                given.save.mkdir(parents=True, exist_ok=True)
                np.savez(given.save / f"{name}.npz", mine=mine, its=its)


if __name__ == "__main__":
    main()
