"""Makes the images of the gallery: all, or those that are named.

    python examples/gallery/make.py ASSETS                        all images, in gallery/
    python examples/gallery/make.py ASSETS toy_car --scale 0.25   a small preview

ASSETS is a folder with the models, which docs/gallery.md lists. Needs `raycam[denoise]` and Pillow.
"""

from __future__ import annotations

import argparse
import importlib
import time
from pathlib import Path

from common import Quality
from PIL import Image

FOLDER = Path(__file__).resolve().parent
TOOLS = {"common", "make"}
NAMES = sorted(path.stem for path in FOLDER.glob("*.py") if path.stem not in TOOLS)


def main() -> None:
    """Renders the images and prints the processor time of each."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("assets", type=Path, help="folder with the models")
    parser.add_argument("names", nargs="*", default=NAMES, help="images (default: all)")
    parser.add_argument("-o", "--output", type=Path, default=Path("gallery"), help="folder for the images")
    parser.add_argument("--scale", type=float, default=1, help="factor of the image's sides")
    parser.add_argument("--effort", type=float, default=1, help="factor of the samples per pixel")
    parser.add_argument("--noisy", action="store_true", help="do not denoise")
    given = parser.parse_args()
    quality = Quality(given.scale, given.effort, denoise=not given.noisy)
    given.output.mkdir(parents=True, exist_ok=True)
    for name in given.names:
        start = time.process_time()
        picture = importlib.import_module(name).picture(given.assets.resolve(), quality)
        Image.fromarray(picture).save(given.output / f"{name}.png")
        print(f"{name}: {time.process_time() - start:.0f} s of processor time", flush=True)


if __name__ == "__main__":
    main()
