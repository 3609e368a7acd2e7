"""The client in a browser: positions in its image, and its readout."""

from __future__ import annotations

from typing import Any

from raycam.viewer.server import Server
from raycam.viewer.session import Session

from .chromium import Tab

Place = tuple[float, float]


def place_of(tab: Tab, column: float, row: float, size: tuple[int, int]) -> Place:
    """The window position of a pixel's centre in the fitted image."""
    box = tab.evaluate(
        "(({x, y, width, height}) => [x, y, width, height])(document.getElementById('picture').getBoundingClientRect())"
    )
    zoom = min(box[2] / size[0], box[3] / size[1])
    left, top = box[0] + (box[2] - zoom * size[0]) / 2, box[1] + (box[3] - zoom * size[1]) / 2
    return left + (column + 0.5) * zoom, top + (row + 0.5) * zoom


def drag(tab: Tab, begin: Place, end: Place, steps: int = 5) -> None:
    """Drags with the left button in the given number of steps."""
    tab.mouse("mousePressed", *begin, button="left", clickCount=1)
    for step in range(1, steps + 1):
        share = step / steps
        x, y = (a + share * (b - a) for a, b in zip(begin, end, strict=True))
        tab.mouse("mouseMoved", x, y, button="left", buttons=1)
    tab.mouse("mouseReleased", *end, button="left", clickCount=1)


def readout(tab: Tab) -> dict[str, list[str]]:
    """The values in the table, with all digits."""
    found: dict[str, list[str]] = tab.evaluate(
        "Object.fromEntries([...document.querySelectorAll('#values tr:not(.other)')].map((row) => "
        "[row.querySelector('th').textContent, [...row.querySelectorAll('.number')].map((each) => each.title)]))"
    )
    return found


def held(tab: Tab) -> tuple[int, int]:
    """Column and row of the selected pixel."""
    words = tab.evaluate("document.getElementById('pixel-place').textContent").split()
    return int(words[1].strip(",")), int(words[3])


def text_of(tab: Tab, element: str) -> Any:
    """The text of an element, by its id."""
    return tab.evaluate(f"document.getElementById('{element}').textContent")


def opened(tab: Tab, server: Server, samples: int) -> Session:
    """Opens the page of a server, waits for its last sample, and returns its session."""
    tab.said.clear()
    tab.open(server.url)
    tab.wait(f"document.getElementById('status').textContent.includes('{samples} samples')")
    (session,) = server.sessions.values()
    return session
