"""Links to a view: the text in the address, and a second browser that opens it."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
import raycam
from raycam.viewer.server import Server
from raycam.viewer.session import Session
from support.chromium import Tab
from support.node_core import needs_node, run_module
from support.patience import until
from support.viewer_page import drag, held, place_of

SEEN = """{ camera: "Fuß", free: true, R: [1, 0, 0, 0, 1, 0, 0, 0, 1], C: [1, 2, 3], focal: 50, pivot: [0, 0, 1e-9],
  lens: [50, 51, 20, 10, 0.1], size: [40, 20], channel: "depth", exposure: 1 / 3, view: "agx", time: 0.1, animation: "",
  variant: "", integrator: "path", pixel: [0.5, 0.25] }"""


@needs_node
def test_link_text_returns_every_number_exactly() -> None:
    text, before, after = run_module(
        "link.js", f"const seen = {SEEN}; const text = linkText(seen); return [text, seen, seenOf(text)];"
    )
    assert after == before
    assert set(text) <= set("ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_")


@needs_node
@pytest.mark.parametrize(
    "damage",
    [
        "seen.R.pop()",
        "seen.C[0] = null",
        "seen.lens = Array(1000).fill(1)",
        "seen.free = 1",
        "delete seen.pixel",
        "seen.pixel = [NaN, 0]",
        "seen.channel = 3",
        "seen.camera = 'a'.repeat(9000)",
    ],
)
def test_damaged_links_are_refused(damage: str) -> None:
    assert run_module("link.js", f"const seen = {SEEN}; {damage}; return seenOf(linkText(seen));") is None
    assert run_module("link.js", "return [seenOf(''), seenOf('%'), seenOf('AAAA')];") == [None] * 3


@needs_node
def test_lens_for_a_wider_window_keeps_the_vertical_field_of_view() -> None:
    assert run_module("link.js", f"return lensFor({SEEN}, [80, 40], 0);") == [100, 102, 40, 20, 0.1]
    assert run_module("link.js", f"return lensFor({SEEN}, [80, 20], 0);") == [50, 51, 40, 10, 0.1]
    assert run_module("link.js", f"return lensFor({SEEN}, [80, 40], -0.5);") == [100, 102, 40.5, 20.5, 0.1]


@pytest.fixture(params=["named", "framed"])
def linked(small_world: raycam.World, request: pytest.FixtureRequest) -> Iterator[Server]:
    """A server that shows the world's camera, or a camera that fills the window."""
    world = small_world if request.param == "named" else small_world.copy()
    if request.param == "framed":
        for name in list(world.cameras):
            world.remove_camera(name)
    made = Server(lambda: Session(world, samples=4), port=0)
    yield made
    made.close()


def test_link_restores_camera_channel_and_held_pixel(tab: Tab, linked: Server) -> None:
    tab.open(linked.url)
    tab.wait("document.getElementById('status').textContent.includes('4 samples')")
    (first,) = linked.sessions.values()
    size = first.view.size
    middle = (size[0] // 2, size[1] // 2)
    drag(tab, place_of(tab, *middle, size), place_of(tab, middle[0] + 10, middle[1] + 5, size))
    until(lambda: first.view.camera_name == "")
    tab.evaluate(
        "((list) => { list.value = 'depth'; list.dispatchEvent(new Event('change')); })"
        "(document.getElementById('channel'))"
    )
    until(lambda: first.view.channel == "depth")
    tab.wait("document.getElementById('legend').textContent.length > 0")
    tab.click(*place_of(tab, 3 * size[0] // 4, size[1] // 2, size))
    tab.wait("document.getElementById('pixel-place').textContent.includes('held')")
    pixel = held(tab)
    tab.evaluate(
        "globalThis.copied = '', navigator.clipboard.writeText = async (text) => { copied = text; }, "
        "document.getElementById('copy-link').click()"
    )
    tab.wait("copied")
    link = tab.evaluate("copied")
    tab.evaluate("sessionStorage.clear()")
    tab.call("Page.navigate", url="about:blank")
    tab.open(link)
    tab.wait("document.getElementById('pixel-place')?.textContent.includes('held')")
    until(lambda: len(linked.sessions) == 2)
    second = next(each for each in linked.sessions.values() if each is not first)
    until(lambda: second.view.channel == "depth")
    assert np.allclose(second.view.camera.P, first.view.camera.P, rtol=1e-12, atol=1e-9)
    assert held(tab) == pixel
    assert "v=" not in tab.evaluate("location.href")


def test_damaged_link_shows_the_first_view_and_an_error(tab: Tab, linked: Server) -> None:
    tab.call("Page.navigate", url="about:blank")
    tab.open(f"{linked.url}&v=AAAA")
    tab.wait("document.getElementById('message').textContent.includes('link is damaged')")
