"""Writes sheets of models in the live view and other viewers, to judge defaults by eye.

    python benchmarks/view_sheet.py FOLDER MODEL... [--model-viewer FILE] [--rivals PYTHON] [--widths 1280 390]

Writes FOLDER/SCHEME-WIDTH.png for the light and the dark theme: a row for each model, a column for each
viewer (raycam, model-viewer, viser and F3D). All images come from Chromium without a graphics card, except
those of F3D, which has no page and is rendered by its library. `--rivals` names an interpreter with viser and
f3d, `--model-viewer` the script `model-viewer.min.js`. The sheets may be shared only if the models' licences
allow it.
"""

from __future__ import annotations

import argparse
import base64
import functools
import http.server
import io
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from pathlib import Path

import raycam
from PIL import Image, ImageDraw
from raycam.viewer.viewer import Viewer
from raycam.world.sources import assumed_up_axis

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from bench_viewer import SOFTWARE
from support.chromium import Tab, chromium
from viewer_in_turn import LONGEST_S, MODEL_VIEWER, VISER, free_port, is_open, shows_model

HEIGHTS = {1280: 800, 390: 844}
THUMBNAIL = 480
"""The width of an image in the sheet."""
SAMPLES = 16
F3D = """
import sys, f3d
f3d.Engine.autoload_plugins()
engine = f3d.Engine.create_egl()
engine.options.update({"render.grid.enable": True})
engine.scene.add(sys.argv[1])
engine.window.size = int(sys.argv[3]), int(sys.argv[4])
engine.window.camera.reset_to_bounds()
engine.window.render_to_image().save(sys.argv[2])
"""


def screenshot(tab: Tab) -> Image.Image:
    data = tab.call("Page.captureScreenshot", format="png")["data"]
    return Image.open(io.BytesIO(base64.b64decode(data))).convert("RGB")


def in_raycam(tab: Tab, model: Path, options: argparse.Namespace) -> Image.Image:
    world = raycam.load(model, up=assumed_up_axis(model))
    with Viewer(world, port=0, samples=SAMPLES, title=model.name, is_model=True) as viewer:
        tab.open(viewer.url)
        end = time.monotonic() + options.seconds
        done = f"document.getElementById('status').textContent.includes('{SAMPLES} samples')"
        while not tab.evaluate(done) and time.monotonic() < end:
            time.sleep(0.3)
        return screenshot(tab)


def in_model_viewer(tab: Tab, model: Path, options: argparse.Namespace) -> Image.Image:
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        (folder / "model-viewer.min.js").symlink_to(Path(options.model_viewer).absolute())
        (folder / "model").symlink_to(model.parent.absolute())
        page = MODEL_VIEWER.replace("spot.glb", f"model/{model.name}")
        (folder / "index.html").write_text(page)
        handler = functools.partial(http.server.SimpleHTTPRequestHandler, directory=place)
        server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler)
        handler.log_message = lambda *words: None  # type: ignore[attr-defined]
        threading.Thread(target=server.serve_forever, daemon=True).start()
        tab.call("Page.navigate", url=f"http://127.0.0.1:{server.server_port}/")
        end = time.monotonic() + LONGEST_S
        while time.monotonic() < end and not shows_model(tab):
            time.sleep(1)
        time.sleep(2)
        found = screenshot(tab)
        server.shutdown()
        return found


def in_viser(tab: Tab, model: Path, options: argparse.Namespace) -> Image.Image:
    port = free_port()
    with subprocess.Popen([options.rivals, "-c", VISER, str(port), str(model)]) as process:
        try:
            end = time.monotonic() + 60
            while not is_open(port) and time.monotonic() < end:
                time.sleep(0.1)
            tab.call("Page.navigate", url=f"http://127.0.0.1:{port}/")
            time.sleep(12)
            return screenshot(tab)
        finally:
            process.kill()


def in_f3d(tab: Tab, model: Path, options: argparse.Namespace) -> Image.Image:
    width, height = options.size
    with tempfile.TemporaryDirectory() as place:
        path = Path(place, "f3d.png")
        command = [options.rivals, "-c", F3D, str(model), str(path), str(width), str(height)]
        subprocess.run(command, check=True, timeout=120, capture_output=True)
        return Image.open(path).convert("RGB")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("models", nargs="+", type=Path)
    parser.add_argument("--model-viewer", metavar="FILE", help="the script model-viewer.min.js")
    parser.add_argument("--rivals", metavar="PYTHON", help="Python interpreter with viser and f3d")
    parser.add_argument("--seconds", type=float, default=60, help="maximum time for an image of raycam")
    parser.add_argument("--viewers", nargs="+", help="names of the viewers to show, in this order")
    parser.add_argument("--widths", type=int, nargs="+", default=[1280, 390], choices=HEIGHTS)
    parser.add_argument("--schemes", nargs="+", default=["light", "dark"], choices=["light", "dark"])
    options = parser.parse_args()
    viewers: dict[str, Callable[[Tab, Path, argparse.Namespace], Image.Image]] = {"raycam": in_raycam}
    if options.model_viewer:
        viewers["model-viewer"] = in_model_viewer
    if options.rivals:
        viewers |= {"viser": in_viser, "f3d": in_f3d}
    viewers = {name: viewers[name] for name in options.viewers or viewers}
    options.folder.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as place, chromium(Path(place), *SOFTWARE) as tab:
        for width in options.widths:
            for scheme in options.schemes:
                options.size = (width, HEIGHTS[width])
                tab.show(*options.size, scheme)
                rows: list[list[Image.Image]] = []
                for model in options.models:
                    rows.append(shots(tab, model, viewers, options))
                    sheet(rows, list(viewers)).save(options.folder / f"{scheme}-{width}.png")


def shots(
    tab: Tab, model: Path, viewers: dict[str, Callable[..., Image.Image]], options: argparse.Namespace
) -> list[Image.Image]:
    """Returns the images of one row; the image of a viewer that fails is grey."""
    row = []
    for name, shoot in viewers.items():
        try:
            row.append(shoot(tab, model, options))
        except Exception as error:
            print(f"{model.name}, {name}: {error}", file=sys.stderr)
            row.append(Image.new("RGB", options.size, "#808080"))
    return row


def sheet(rows: list[list[Image.Image]], names: list[str]) -> Image.Image:
    width = THUMBNAIL
    height = round(width * rows[0][0].height / rows[0][0].width)
    made = Image.new("RGB", (width * len(names), 20 + height * len(rows)), "white")
    draw = ImageDraw.Draw(made)
    for column, name in enumerate(names):
        draw.text((column * width + 4, 4), name, "black")
        for row, images in enumerate(rows):
            made.paste(
                images[column].resize((width, height), Image.Resampling.LANCZOS),
                (column * width, 20 + row * height),
            )
    return made


if __name__ == "__main__":
    main()
