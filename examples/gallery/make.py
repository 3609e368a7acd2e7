"""Renders the images of docs/gallery.md: all images, or only the given ones.

    python examples/gallery/make.py ASSETS                          all images, in the folder gallery
    python examples/gallery/make.py ASSETS toy_car --scale 0.3      a small preview
    python examples/gallery/make.py ASSETS -o docs/images/models    the images of the page

ASSETS is the folder of the models; docs/images/CREDITS.md lists their sources. Requires `raycam[denoise]` and
Pillow.
"""

from __future__ import annotations

import argparse
import importlib
import time
from pathlib import Path

from common import Quality
from PIL import Image

TOOLS = {"arm", "common", "make", "ride", "town"}
NAMES = sorted(path.stem for path in Path(__file__).parent.glob("*.py") if path.stem not in TOOLS)


def main() -> None:
    """Renders the images and prints the processor time of each."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("assets", type=Path, help="folder with the models")
    parser.add_argument("names", nargs="*", default=NAMES, metavar="NAME", help="images (default: all)")
    parser.add_argument("-o", "--output", type=Path, default=Path("gallery"), help="folder of the images")
    parser.add_argument("--scale", type=float, default=1, help="factor of the image's width and height")
    parser.add_argument("--effort", type=float, default=1, help="factor of the samples per pixel")
    parser.add_argument("--no-denoise", action="store_true", help="do not denoise")
    given = parser.parse_args()
    quality = Quality(given.scale, given.effort, denoise=not given.no_denoise)
    given.output.mkdir(parents=True, exist_ok=True)
    for name in given.names:
        start = time.process_time()
        picture = importlib.import_module(name).picture(given.assets.resolve(), quality)
        Image.fromarray(picture).save(given.output / f"{name}.jpg", quality=90, optimize=True)
        print(f"{name}: {time.process_time() - start:.0f} s of processor time", flush=True)


if __name__ == "__main__":
    main()
