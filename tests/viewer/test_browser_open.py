"""Opening in Chromium: several models, a folder, a changed file, and photographs.

Requires Chromium: `make proof`.
"""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
import raycam
from raycam.viewer.session import Session
from support.chromium import Tab
from support.patience import until
from support.viewer_page import drag, place_of

pytestmark = pytest.mark.proof
SAMPLES = 4
TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 0 2\nf 1 2 3\n"
PIXEL = """(() => {
  const canvas = document.getElementById("picture");
  const place = canvas.getBoundingClientRect();
  const [x, y] = [(%s - place.x) * devicePixelRatio, (%s - place.y) * devicePixelRatio];
  return [...canvas.getContext("2d").getImageData(Math.round(x), Math.round(y), 1, 1).data].slice(0, 3);
})()"""


def open_page(tab: Tab, viewer: raycam.Viewer) -> Session:
    """Opens the page without a session of another test, and waits for the last sample."""
    if tab.evaluate("location.protocol") == "http:":
        tab.evaluate("sessionStorage.clear()")
    tab.open(viewer.url)
    tab.wait(f"document.getElementById('status').textContent.includes('{SAMPLES} samples')")
    assert viewer._server is not None
    (session,) = viewer._server.sessions.values()
    return session


def wait_for_size(tab: Tab, session: Session) -> tuple[int, int]:
    """Waits until the page shows an image of the session's size."""
    tab.wait(
        f"document.getElementById('status-picture').textContent === '{session.view.size[0]} x {session.view.size[1]}'"
    )
    return session.view.size


def test_models_that_are_dropped_together_are_shown_together(
    tab: Tab, small_world: raycam.World, tmp_path: Path
) -> None:
    for name in ("wheel.obj", "hub.obj"):
        (tmp_path / name).write_text(TRIANGLE)
    with raycam.view(
        small_world, allow_open=True, samples=SAMPLES, browser=False, block=False, port=0
    ) as viewer:
        session = open_page(tab, viewer)
        before = session.view.base
        tab.drop(640, 400, [tmp_path / "wheel.obj", tmp_path / "hub.obj"])
        until(lambda: session.view.base is not before)
        assert sorted(each.name for each in session.view.base.objects) == ["hub", "wheel"]
        tab.wait("document.querySelectorAll('#tree-list li').length === 2")


def test_dropped_folder_shows_its_first_world_and_lists_other_worlds(
    tab: Tab, small_world: raycam.World, tmp_path: Path
) -> None:
    folder = tmp_path / "set of models"
    folder.mkdir()
    for name in ("a.obj", "b.obj", "README"):
        (folder / name).write_text(TRIANGLE)
    with raycam.view(
        small_world, allow_open=True, samples=SAMPLES, browser=False, block=False, port=0
    ) as viewer:
        session = open_page(tab, viewer)
        before = session.view.base
        tab.drop(640, 400, [folder])
        until(lambda: session.view.base is not before)
        assert [each.name for each in session.view.base.objects] == ["a"]
        tab.wait("document.getElementById('message').textContent.includes('b.obj')")


def test_changed_file_is_shown_and_the_camera_stays(tab: Tab, tmp_path: Path) -> None:
    path = tmp_path / "w.toml"
    path.write_text('[[object]]\nname = "box"\nbox = { size = 1 }\n')
    with raycam.view(path, watch=True, samples=SAMPLES, browser=False, block=False, port=0) as viewer:
        session = open_page(tab, viewer)
        before = session.view.camera
        drag(tab, (600, 400), (680, 430))
        until(lambda: session.view.camera != before)
        camera = session.view.camera
        new = tmp_path / "new"
        new.write_text('[[object]]\nname = "ball"\nsphere = { radius = 2 }\n')
        os.replace(new, path)
        tab.wait("document.querySelector('#tree-list li button').textContent === 'ball'")
        tab.wait("document.getElementById('message').textContent.includes('loaded again')")
        assert session.view.camera == camera
        path.write_text("[[object]\n")
        tab.wait("document.getElementById('message').classList.contains('error')")
        assert [each.name for each in session.view.base.objects] == ["ball"]


def test_photograph_slider_blends_over_the_model_and_photograph_is_compared(
    tab: Tab, small_world: raycam.World
) -> None:
    camera = small_world.camera("front")
    green = np.zeros((32, 48, 3), np.uint8)
    green[..., 1] = 200
    cameras = {"IMG_1.jpg": camera, "IMG_2.jpg": small_world.camera("side")}
    bare_world = small_world.copy()
    for name in small_world.cameras:
        bare_world.remove_camera(name)
    with raycam.view(
        bare_world,
        cameras=cameras,
        photos={"IMG_1.jpg": green, "IMG_2.jpg": green},
        samples=SAMPLES,
        browser=False,
        block=False,
        port=0,
    ) as viewer:
        session = open_page(tab, viewer)
        assert session.view.camera == camera
        tab.wait("!document.getElementById('photograph').hidden")
        size = wait_for_size(tab, session)
        x, y = place_of(tab, size[0] // 2, size[1] // 2, size)
        tab.wait("document.getElementById('photograph-text').textContent === '50 %'")

        def slide(share: float) -> list[int]:
            tab.evaluate(
                "(() => { const field = document.getElementById('photograph-opacity');"
                f" field.value = '{share}'; field.dispatchEvent(new Event('input')); }})()"
            )
            tab.evaluate("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
            return tab.evaluate(PIXEL % (x, y))

        bare, mixed, whole = slide(0), slide(0.5), slide(1)
        assert np.abs(np.array(whole) - [0, 200, 0]).max() <= 4
        assert np.abs(np.array(mixed) - np.mean([bare, [0, 200, 0]], axis=0)).max() <= 4
        tab.evaluate("document.getElementById('photograph-b').click()")
        tab.wait("document.getElementById('compare-mode').value === 'slider'")
        tab.wait("!document.getElementById('compare-mode').disabled")
        left, right = (place_of(tab, share * size[0], size[1] / 2, size) for share in (0.25, 0.75))
        tab.wait(f"Math.abs({PIXEL % right}[1] - 200) <= 4")
        assert np.abs(np.array(tab.evaluate(PIXEL % left)) - [0, 200, 0]).max() > 4
        drag(tab, left, (left[0] + 60, left[1]))
        tab.wait("document.getElementById('photograph').hidden")
        tab.press("c")
        tab.wait("!document.getElementById('photograph').hidden")
