"""Tests the live view in JupyterLab and marimo.

The script runs a cell, turns the camera with the mouse, and clicks a pixel. `--python PYTHON` names an
interpreter with `jupyterlab`, `marimo`, `anywidget` and raycam's dependencies. An image of each step is
written to the folder `--out` for visual inspection. If a step does not change the view, the script ends with
an error.
"""

from __future__ import annotations

import argparse
import base64
import io
import json
import os
import subprocess
import sys
import tempfile
import time
import urllib.error
import urllib.request
from collections.abc import Callable
from pathlib import Path

import numpy as np
import raycam
from PIL import Image

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from support.chromium import Tab, chromium

FRAME = """import raycam
world = raycam.data.spot()
frame = raycam.render(world, world.default_camera((320, 200)), samples=4)
frame"""
VIEW = """view = raycam.view(world)
view"""
FIND = """(() => { const roots = [document];
  for (const root of roots) {
    const found = root.querySelector("iframe[title=raycam]");
    if (found) return found;
    for (const each of root.querySelectorAll("*")) if (each.shadowRoot) roots.push(each.shadowRoot);
  }
  return null; })()"""
PATIENCE = 60.0  # seconds
SHIFT = 8  # bit of the Shift key among the modifiers of a browser event


def jupyterlab(folder: Path, port: int) -> tuple[list[str], str]:
    """Returns the command and the address of a notebook in JupyterLab."""
    cells = [
        {
            "cell_type": "code",
            "metadata": {},
            "source": text,
            "outputs": [],
            "execution_count": None,
            "id": id,
        }
        for id, text in (("frame", FRAME), ("view", VIEW))
    ]
    kernel = {"name": "python3", "display_name": "Python 3", "language": "python"}
    notebook = {"nbformat": 4, "nbformat_minor": 5, "metadata": {"kernelspec": kernel}, "cells": cells}
    (folder / "look.ipynb").write_text(json.dumps(notebook))
    options = ["--no-browser", "--allow-root", f"--port={port}", "--IdentityProvider.token=look"]
    return [
        *("-m", "jupyterlab", *options, f"--ServerApp.root_dir={folder}")
    ], f"http://127.0.0.1:{port}/lab/tree/look.ipynb?token=look"


def marimo(folder: Path, port: int) -> tuple[list[str], str]:
    """Returns the command and the address of an app in marimo."""
    cell = "@app.cell\ndef _({}):\n    {}\n    return {}\n\n"
    (folder / "look.py").write_text(
        "import marimo\n\napp = marimo.App()\n\n"
        + cell.format("", FRAME.replace("\n", "\n    "), "raycam, world")
        + cell.format("raycam, world", VIEW.replace("\n", "\n    "), "(view,)")
    )
    options = ["--headless", "--no-token", "-p", str(port)]
    return ["-m", "marimo", "run", str(folder / "look.py"), *options], f"http://127.0.0.1:{port}/"


def picture(tab: Tab, path: Path) -> np.ndarray:
    """Returns the view's image, uint8 [h, w, 3]; writes the whole window to `path`."""
    data = base64.b64decode(tab.call("Page.captureScreenshot")["data"])
    path.write_bytes(data)
    x, y, width, height = (round(each) for each in place(tab))
    return np.asarray(Image.open(io.BytesIO(data)).convert("RGB"))[max(0, y) : y + height, x : x + width]


def place(tab: Tab) -> list[float]:
    """Returns the view's rectangle in the window."""
    found: list[float] = tab.evaluate(
        f"(({{x, y, width, height}}) => [x, y, width, height])({FIND}.getBoundingClientRect())"
    )
    return found


def until(tab: Tab, path: Path, is_true: Callable[[np.ndarray], bool], what: str) -> np.ndarray:
    """Waits until the view's image meets a condition, and returns the image.

    Raises `RuntimeError` after `PATIENCE` seconds.
    """
    deadline = time.monotonic() + PATIENCE
    while not is_true(shown := picture(tab, path)):
        if time.monotonic() > deadline:
            raise RuntimeError(f"{what} did not appear; the screenshot is {path}")
        time.sleep(0.5)
    return shown


def colorful(shown: np.ndarray) -> float:
    """Returns the fraction of pixels with a colour that only the world has."""
    values = shown.astype(int)
    return float((np.ptp(values, axis=2) > 90).mean())


def walk(tab: Tab, url: str, out: Path, name: str) -> None:
    """Opens a notebook, runs its cells, turns the camera, and probes a pixel."""
    tab.show(1300, 1000)
    tab.call("Page.navigate", url=url)
    if name == "jupyterlab":
        tab.wait("document.querySelectorAll('.jp-Notebook .jp-Cell').length >= 2")
        time.sleep(5)  # time for the kernel to start
        tab.click(700, 160)
        for _ in range(2):
            for kind in ("keyDown", "keyUp"):
                key = {"key": "Enter", "code": "Enter", "windowsVirtualKeyCode": 13}
                tab.call("Input.dispatchKeyEvent", type=kind, modifiers=SHIFT, **key)
            time.sleep(2)
    tab.wait(f"{FIND} !== null")
    tab.evaluate(f"{FIND}.scrollIntoView({{ block: 'center' }})")
    first = until(tab, out / f"{name}-1-view.png", lambda seen: colorful(seen) > 0.02, "a picture")
    x, y = (round(each) for each in place(tab)[:2])
    tab.mouse("mousePressed", x + 160, y + 200, button="left", clickCount=1)
    for step in range(1, 20):
        tab.mouse("mouseMoved", x + 160 + 6 * step, y + 200, button="left", buttons=1)
        time.sleep(0.03)
    tab.mouse("mouseReleased", x + 274, y + 200, button="left", clickCount=1)

    def differs(seen: np.ndarray, other: np.ndarray) -> bool:
        return seen.shape == other.shape and bool((seen != other).any(axis=2).mean() > 0.02)

    until(tab, out / f"{name}-2-turned.png", lambda seen: differs(seen, first), "a turned picture")
    time.sleep(3)
    turned = picture(tab, out / f"{name}-2-turned.png")
    tab.click(x + 220, y + 200)
    until(tab, out / f"{name}-3-pixel.png", lambda seen: differs(seen, turned), "the numbers of a pixel")
    print(f"{name}: the image, its rotation by the mouse, and the numbers of a pixel are correct")


def wait_for(url: str) -> None:
    """Waits until a server responds."""
    deadline = time.monotonic() + PATIENCE
    while True:
        try:
            urllib.request.urlopen(url, timeout=5).close()
            return
        except urllib.error.HTTPError:
            return
        except OSError:
            if time.monotonic() > deadline:
                raise
            time.sleep(0.5)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--python", required=True, help="Python interpreter with the notebook programs")
    parser.add_argument("--out", type=Path, default=Path("notebooks"), help="output folder for screenshots")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    for name, made, port in (("jupyterlab", jupyterlab, 8921), ("marimo", marimo, 8931)):
        with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as text:
            folder = Path(text)
            command, url = made(folder, port)
            private = {each: str(folder / each.lower()) for each in ("JUPYTER_CONFIG_DIR", "XDG_CONFIG_HOME")}
            package = str(Path(raycam.__file__).parents[1])
            with (
                open(options.out / f"{name}.log", "w") as log,
                subprocess.Popen(
                    [options.python, *command],
                    env={**os.environ, **private, "PYTHONPATH": package},
                    stdout=log,
                    stderr=subprocess.STDOUT,
                ) as server,
            ):
                try:
                    wait_for(url)
                    with chromium(folder / "browser") as tab:
                        walk(tab, url, options.out, name)
                finally:
                    server.terminate()


if __name__ == "__main__":
    main()
