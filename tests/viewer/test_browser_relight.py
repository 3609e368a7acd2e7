"""Sliders that change the brightness of lights in a saved page.

Requires Chromium: `make proof`.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import raycam
from support.chromium import Tab
from support.viewer_page import place_of, readout

pytestmark = pytest.mark.proof


@pytest.fixture(scope="module")
def frame() -> raycam.Frame:
    """A box that a sun and a sky illuminate, with the parts of both."""
    world = raycam.World()
    world.add_object(box={"size": 1}, color="#c83c28", name="box")
    world.add_light("sun", name="sun", direction=[-1, 1, -2], irradiance=[3, 2, 1])
    world.add_light("sky", name="fill", radiance=[0.1, 0.2, 0.4])
    camera = raycam.Camera.look_at([4, -3, 2], [0, 0, 0], size=(48, 32), fov=30)
    channels = ["color", "light:sun", "light:fill", "depth"]
    return raycam.render(world, camera, integrator="path", samples=8, channels=channels)


def set_slider(tab: Tab, name: str, factor: float) -> None:
    """Moves the slider of a light."""
    tab.evaluate(
        "(() => { const label = [...document.querySelectorAll('#relight-lights label')]"
        f".find((each) => each.textContent.startsWith('{name} '));"
        "const slider = label.querySelector('input');"
        f"slider.value = '{factor}'; slider.dispatchEvent(new Event('input', {{ bubbles: true }})); }})()"
    )


def shown_color(tab: Tab, frame: raycam.Frame, expected: np.ndarray) -> np.ndarray:
    """The middle pixel's colour in the readout.

    Waits for the expected colour; returns the last colour if it does not appear.
    """
    tab.mouse("mouseMoved", *place_of(tab, 24, 16, frame.size))
    for _ in range(50):
        found = np.array(readout(tab).get("color", [np.nan] * 3), np.float32)
        if np.allclose(found, expected, rtol=1e-5):
            break
        tab.evaluate("new Promise((done) => setTimeout(done, 20))")
    return found


def test_sliders_scale_the_parts_of_the_color_and_reset_restores_it(
    tab: Tab, frame: raycam.Frame, tmp_path: Path
) -> None:
    frame.save(tmp_path / "x.html", channel="depth")
    tab.said.clear()
    tab.open((tmp_path / "x.html").as_uri())
    tab.wait("!document.getElementById('relight').hidden")
    color, sun, fill = (frame[name][16, 24] for name in ("color", "light:sun", "light:fill"))
    assert np.allclose(sun + fill, color, rtol=1e-5)
    for factors, expected in (((2, 1), 2 * sun + fill), ((0, 0.5), 0.5 * fill), ((0, 4), 4 * fill)):
        set_slider(tab, "sun", factors[0])
        set_slider(tab, "fill", factors[1])
        np.testing.assert_allclose(shown_color(tab, frame, expected), expected, rtol=1e-4)
        assert tab.evaluate("document.getElementById('channel').value") == "color"
    tab.evaluate("document.getElementById('relight-reset').click()")
    assert (shown_color(tab, frame, color) == color).all()
    assert tab.said == []


def test_frames_without_parts_of_lights_have_no_sliders(
    tab: Tab, frame: raycam.Frame, tmp_path: Path
) -> None:
    for channels in (["color", "depth"], ["light:sun"]):
        part = raycam.Frame({name: frame[name] for name in channels}, camera=frame.camera, size=frame.size)
        part.save(tmp_path / "x.html")
        tab.open((tmp_path / "x.html").as_uri())
        tab.wait(f"document.querySelectorAll('#channel option').length === {len(channels)}")
        assert tab.evaluate("document.getElementById('relight').hidden")
