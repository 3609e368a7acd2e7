"""Writes the images of `view.md`.

    python docs/view_pictures.py

The images show the live view, a probed pixel, an explained pixel, a comparison of two images, and a frame's
page. The script drives Chromium as the tests do. Requires Pillow.
"""

from __future__ import annotations

import base64
import io
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import raycam
from pictures import write_jpeg
from PIL import Image
from raycam.viewer.server import Server
from raycam.viewer.session import Session

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))
from support.chromium import Tab, chromium
from support.viewer_page import drag, place_of

WINDOW = (1200, 750)
SAMPLES = 24
MOST_BYTES = 58_000
MOST_SIDE = 1000
SHOWN = 0.6  # seconds that a browser needs to paint
REST = f"document.getElementById('status').textContent.includes('{SAMPLES} samples')"


def keep(tab: Tab, name: str) -> None:
    """Writes a screenshot of the tab to `images/view/NAME.jpg`, compressed to a small file."""
    time.sleep(SHOWN)
    data = base64.b64decode(tab.call("Page.captureScreenshot", format="png")["data"])
    with Image.open(io.BytesIO(data)) as image:
        write_jpeg(image.convert("RGB"), f"view/{name}", MOST_BYTES, MOST_SIDE)


def live(tab: Tab, session: Session) -> None:
    """Writes the image of the live view with the handles of an object."""
    tab.evaluate("document.querySelector('#tree-list li .row-name').click()")
    tab.press("g")
    tab.evaluate("document.getElementById('edit').scrollIntoView(), null")
    tab.wait("document.querySelector('.thumbnail img')?.complete")
    tab.wait(REST)
    keep(tab, "live")
    tab.press("g")
    tab.evaluate("document.getElementById('panel').scrollTop = 0, null")


def probe(tab: Tab, session: Session) -> None:
    """Writes the image of a held pixel's numbers over the channel `depth`."""
    width, height = session.view.size
    tab.press("3")
    tab.wait("!document.getElementById('scalar-controls').hidden")
    tab.evaluate("document.getElementById('range-log').click(), null")
    tab.click(*place_of(tab, 0.46 * width, 0.42 * height, session.view.size))
    tab.wait("document.querySelectorAll('#values tr').length >= 17")
    keep(tab, "probe")


def explain(tab: Tab, session: Session) -> None:
    """Writes the image of the held pixel's ray."""
    tab.press("1")
    tab.press("Enter")
    tab.wait("document.getElementById('explained').open")
    tab.wait("document.querySelectorAll('#explained-drawing canvas').length === 2")
    keep(tab, "explain")
    tab.evaluate("document.getElementById('explained').close(), null")
    tab.evaluate("document.getElementById('show-explained').click(), null")
    tab.press("Escape")


def compare(tab: Tab, session: Session) -> None:
    """Writes the image of a comparison of direct light with all light."""
    tab.press("b")
    tab.press("l")
    tab.wait("document.getElementById('status').textContent.startsWith('path')")
    tab.wait(REST)
    tab.press("x")
    width, height = session.view.size
    middle, left = (place_of(tab, share * width, 0.9 * height, session.view.size) for share in (0.5, 0.62))
    drag(tab, middle, left)
    keep(tab, "compare")


def page(tab: Tab, folder: Path) -> None:
    """Writes the image of a frame's page, magnified until every pixel shows its values."""
    world = raycam.data.spot()
    camera = world.default_camera().resized((160, 100))
    path = folder / "spot.html"
    raycam.render(world, camera, channels="all").save(path, world=world, explain=[(80, 50)])
    tab.open(path.as_uri())
    x, y = place_of(tab, 66, 25, camera.size)
    tab.click(x, y)
    for _ in range(11):
        tab.mouse("mouseWheel", x, y, deltaX=0, deltaY=-100)
    keep(tab, "page")


def main() -> None:
    """Writes all images."""
    world = raycam.data.spot()
    camera = world.default_camera()
    server = Server(lambda: Session(world, camera, samples=SAMPLES, title="spot.toml"), port=0)
    steps: list[Callable[[Tab, Session], None]] = [live, probe, explain, compare]
    with tempfile.TemporaryDirectory() as folder, chromium(Path(folder, "browser")) as tab:
        tab.show(*WINDOW)
        tab.open(server.url)
        tab.wait(REST)
        (session,) = server.sessions.values()
        for step in steps:
            step(tab, session)
        server.close()
        page(tab, Path(folder))


if __name__ == "__main__":
    main()
