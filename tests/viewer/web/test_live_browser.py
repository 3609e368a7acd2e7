"""A live page in a browser: it renders, answers and loads nothing.

Requires Chromium: `make proof`.
"""

from __future__ import annotations

import re
from pathlib import Path

import pytest
import raycam
from support.chromium import chromium
from support.node_core import needs_core
from support.viewer_page import place_of, text_of

pytestmark = [pytest.mark.proof, needs_core]

SPY = """
window.drawn = [];
const draw = CanvasRenderingContext2D.prototype.drawImage;
CanvasRenderingContext2D.prototype.drawImage = function (image, ...places) {
  if (this.canvas.closest("#explained-drawing")) window.drawn.push(`${image.width} ${image.height}`);
  draw.call(this, image, ...places);
};
null"""
"""Remembers the sizes of the images that figures draw."""


def test_live_page_renders_and_its_numbers_equal_raycam(tmp_path: Path) -> None:
    world = raycam.World()
    world.add_object(sphere={"radius": 1}, location=[0, 0, 1], color="red", name="ball")
    world.add_object(plane={"size": [8, 8]}, name="floor")
    world.add_light("sun", direction=[-1, 1, -2], irradiance=3)
    camera = raycam.Camera.look_at([4, -4, 3], [0, 0, 1], [0, 0, 1], size=(160, 120), fov=45)
    frame = raycam.render(world, camera, channels="all", samples=4)
    frame.save(tmp_path / "live.html", world=world, live=True)
    with chromium(tmp_path / "browser") as tab:
        tab.show(1280, 800)
        tab.open((tmp_path / "live.html").as_uri())
        tab.wait("document.body.innerText.includes('samples')")
        tab.click(460, 406)  # the image centre
        tab.wait("document.body.innerText.includes('ball')")
        text = tab.evaluate("document.body.innerText")
        # The image is four times as large; its centre differs by less than one pixel of the frame.
        depth = float(text.split("(held)")[1].split("depth")[1].split()[0])
        assert abs(depth - frame["depth"][59:61, 79:81].mean()) < 0.01
        # The explanation's figure is drawn, according to its numbers.
        column, row = map(int, re.findall(r"column (\d+), row (\d+)", text)[0])
        tab.evaluate(SPY)
        tab.press("Enter")
        tab.wait("document.getElementById('explained').open")
        explained = raycam.explain(world, camera.resized((640, 480)), (column, row))
        assert tab.evaluate("document.getElementById('explained-text').textContent") == str(explained)
        canvases = "[...document.querySelectorAll('#explained-drawing canvas')]"
        tab.wait(f"{canvases}.length === 2 && {canvases}.every((each) => each.dataset.labels)")
        inside = "inside" if explained.winner.inside else "outside"
        title = tab.evaluate("document.querySelectorAll('#explained-drawing .figure-title')[1].textContent")
        count = explained.winner.crossings
        assert title.endswith(f"{count} {'crossing' if count == 1 else 'crossings'}, {inside}")
        labels = tab.evaluate(
            f"{canvases}.map((each) => JSON.parse(each.dataset.labels).map((label) => label.text))"
        )
        assert {"C", "x", "a", "b", "c", "f(t)", "r", "v"} <= set(labels[0])
        assert {"u", "g = a + v₃", f"f(t): {inside}"} <= set(labels[1])
        # The figure's image plane shows only the image, without the window's background and overlays.
        assert tab.evaluate("[...new Set(window.drawn)]") == ["640 480"]
        assert tab.said == []
        assert all(request.startswith(("file:", "blob:", "data:")) for request in tab.requests), tab.requests


def test_live_page_explanation_of_a_rolling_shutter_equals_raycams(tmp_path: Path) -> None:
    world = raycam.World()
    world.add_object(box={"size": 1}, name="box")
    world.add_object(plane={"size": [8, 8]}, location=[0, 0, -0.5], name="floor")
    world.add_light("sun", direction=[-1, 1, -2], irradiance=3)
    keys = [
        {"time": t, "object": "box", "location": [x, 0, 0], "yaw": a} for t, x, a in ((0, -1, 0), (1, 2, 120))
    ]
    world.set_video(seconds=1, interpolation="linear", keyframe=keys)
    moment = world.at(0.5)
    eye = raycam.Camera.look_at([4, -3, 2], [0, 0, 0], size=(96, 72), fov=50)
    camera = eye.moving(eye.at_pose(eye.R, [3.8, -3.1, 2.1]), exposure=0.02, readout=0.6)
    raycam.render(moment, camera, samples=1).save(
        tmp_path / "live.html", world=moment, live=True, channel="depth"
    )
    with chromium(tmp_path / "browser") as tab:
        tab.show(1280, 800)
        tab.open((tmp_path / "live.html").as_uri())
        assert tab.evaluate("document.getElementById('channel').value") == "depth"
        size = (640, 480)
        for pixel in ((300, 150), (340, 240), (330, 290)):
            tab.click(*place_of(tab, *pixel, size))
            tab.wait(
                f"document.getElementById('pixel-place').textContent === 'column {pixel[0]}, row {pixel[1]} (held)'"
            )
            tab.press("Enter")
            tab.wait("document.getElementById('explained').open")
            told = text_of(tab, "explained-text")
            assert told == str(raycam.explain(moment, camera.resized(size), pixel))
            assert told != str(raycam.explain(moment, camera.resized(size).still(), pixel))
            tab.evaluate("document.getElementById('explained').close()")
        assert tab.said == []
