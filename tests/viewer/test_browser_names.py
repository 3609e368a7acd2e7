"""Names with control characters and markup in Chromium: figures stay valid XML, and names stay text."""

from __future__ import annotations

from pathlib import Path

import pytest
import raycam
from raycam.viewer.viewer import Viewer
from support.chromium import Tab

NAME = 'ball\x02 <img src=x onerror=alert(1)> & \x1b[31m"red"\x7f\ufffe'


@pytest.fixture(scope="module")
def world() -> raycam.World:
    made = raycam.World()
    made.add_object(sphere={"radius": 1}, name=NAME, category="c\x01\x0b")
    made.add_light(type="point", position=[2, -3, 4], power=300)
    made.add_camera(raycam.Camera.look_at([0, -4, 0], [0, 0, 0], size=(48, 32), fov=40), "front\x1f</svg>")
    return made


def test_figures_of_names_with_control_characters_are_valid_xml(
    tab: Tab, world: raycam.World, tmp_path: Path
) -> None:
    explanation = raycam.explain(world, world.camera("front\x1f</svg>"), (24, 16))
    (tmp_path / "pixel.svg").write_text(explanation._repr_svg_(), encoding="utf-8")
    tab.call("Page.navigate", url=(tmp_path / "pixel.svg").as_uri())
    tab.wait("document.readyState === 'complete' && location.protocol === 'file:'")
    assert tab.evaluate("document.documentElement.nodeName") == "svg"
    assert tab.evaluate("document.querySelector('parsererror')") is None
    assert tab.evaluate("document.querySelector('img, script')") is None


def test_view_shows_names_with_control_characters_as_text(tab: Tab, world: raycam.World) -> None:
    with Viewer(world, port=0, integrator="direct", samples=2) as viewer:
        tab.show(1280, 800)
        tab.open(viewer.url)
        tab.wait("document.querySelectorAll('#tree-list li').length >= 2")
        shown = tab.evaluate("document.querySelector('#tree-list .row-name').textContent")
        assert "<img src=x onerror=alert(1)>" in shown
        assert tab.evaluate("document.querySelector('#tree-list img')") is None
        box = tab.evaluate(
            "(({ left, top, width, height }) => [left + width / 2, top + height / 2])"
            "(document.getElementById('picture').getBoundingClientRect())"
        )
        tab.click(*box)
        tab.wait("document.querySelectorAll('#values tr').length > 5")
        tab.press("Enter")
        tab.wait("document.getElementById('explained').open")
        tab.wait("document.querySelectorAll('#explained-drawing canvas').length >= 1")
        text = tab.evaluate("document.getElementById('explained-text').textContent")
        assert "<img src=x onerror=alert(1)>" in text
        assert not [line for line in tab.said if "alert" in line or "exception" in line.lower()]
