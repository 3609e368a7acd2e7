"""The held pixel in Chromium while the image gets another size."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import raycam
from raycam.viewer.session import Session
from raycam.viewer.viewer import Viewer
from support.chromium import Tab
from support.patience import until
from support.two_materials import two_materials
from support.viewer_page import drag, held, opened, place_of, readout

SAMPLES = 2


@pytest.fixture
def viewer(tmp_path: Path) -> Iterator[Viewer]:
    with Viewer(two_materials(tmp_path), port=0, integrator="direct", samples=SAMPLES) as made:
        yield made


@pytest.fixture
def session(viewer: Viewer, tab: Tab) -> Iterator[Session]:
    assert viewer._server is not None
    tab.show(1280, 800)
    yield opened(tab, viewer._server, SAMPLES)
    tab.show(1280, 800)


def middle_of_blue(session: Session) -> tuple[int, int]:
    """Column and row of the middle of the blue triangle."""
    view = session.view
    seen = raycam.render(view.world, view.still_camera, channels=["triangle"], samples=1)["triangle"]
    row, column = np.argwhere(seen == 1).mean(axis=0).round().astype(int)
    return int(column), int(row)


def test_click_on_an_outdated_image_selects_the_material_in_this_image(
    tab: Tab, viewer: Viewer, session: Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert viewer._server is not None
    size = session.view.size
    column, row = middle_of_blue(session)
    with monkeypatch.context() as busy:  # no image is rendered
        busy.setattr(viewer._server.scheduler, "_next", lambda: None)
        tab.show(1000, 800)
        until(lambda: session.view.size != size)
        tab.click(*place_of(tab, column, row, size))
        tab.wait("document.querySelector('#slots [aria-current]').textContent === 'blue'")
        assert (
            tab.evaluate("document.getElementById('status-picture').textContent") == f"{size[0]} x {size[1]}"
        )
    assert session.selection.slot == 1
    viewer._server.scheduler.wake()
    tab.wait(f"document.getElementById('status-picture').textContent !== '{size[0]} x {size[1]}'")
    tab.wait("document.getElementById('pixel-place').textContent.endsWith('(held)')")
    assert session.selection.slot == 1


def test_click_before_the_image_of_a_moved_camera_is_evaluated_in_the_shown_image(
    tab: Tab, viewer: Viewer, session: Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert viewer._server is not None
    picked: list[dict[str, object]] = []
    viewer.on_pick(picked.append)
    view, (column, row) = session.view, middle_of_blue(session)
    size, place = view.size, place_of(tab, column, row, view.size)
    shown = raycam.render(view.world, view.still_camera, channels=["position"], samples=1)["position"]
    expected = [float(each) for each in shown[row, column]]
    with monkeypatch.context() as busy:  # no image is rendered
        busy.setattr(viewer._server.scheduler, "_next", lambda: None)
        drag(tab, place, (place[0] + 300, place[1]))
        until(lambda: session.view.camera != view.camera)
        tab.click(*place_of(tab, column, row, size))
        tab.wait("document.getElementById('pixel-place').textContent.endsWith('(held)')")
        until(lambda: [float(each) for each in readout(tab)["position"]] == expected)
        tab.wait("document.querySelector('#slots [aria-current]').textContent === 'blue'")
        until(lambda: len(picked) == 1)
        assert [float(each) for each in picked[0]["position"]] == expected  # type: ignore[attr-defined]
        assert picked[0]["camera"] == view.still_camera
    viewer._server.scheduler.wake()
    # The new image shows another point at this pixel.
    tab.wait("document.getElementById('leave').disabled")
    assert session.selection.slot == 1
    tab.wait(f"document.getElementById('status').textContent.includes('{SAMPLES} samples')")
    tab.click(*place_of(tab, column, row, size))
    tab.wait("document.getElementById('pixel-place').textContent.endsWith('(held)')")
    K, version = session.view.camera.K, session.images.version
    session.show(session.view.with_lens(1.1 * K[0, 0], 1.1 * K[1, 1], K[0, 2], K[1, 2], []))
    until(lambda: session.images.version > version and session.images.is_shown())
    assert not tab.evaluate("document.getElementById('leave').disabled")  # only outdated clicks are released


def test_held_pixel_stays_at_its_point_if_the_window_gets_another_size(tab: Tab, session: Session) -> None:
    size = session.view.size
    column, row = middle_of_blue(session)
    tab.click(*place_of(tab, column, row, size))
    tab.wait("document.getElementById('pixel-place').textContent.endsWith('(held)')")
    before = [float(each) for each in readout(tab)["position"]]
    view = session.view
    session.show(view.with_camera(view.camera))  # a free camera, which does not move to frame the world
    for window in ((1280, 620), (1100, 800)):
        tab.show(*window)
        until(lambda size=size: session.view.size != size)
        size = session.view.size
        tab.wait(f"document.getElementById('status-picture').textContent === '{size[0]} x {size[1]}'")
        camera = session.view.still_camera
        pixel, _ = camera.project(before)
        until(lambda pixel=pixel: np.abs(np.subtract(held(tab), pixel)).max() < 1.5)


def test_held_pixel_that_leaves_the_image_is_released(tab: Tab, session: Session) -> None:
    size = session.view.size
    tab.click(*place_of(tab, size[0] - 30, size[1] - 100, size))
    tab.wait("document.getElementById('pixel-place').textContent.endsWith('(held)')")
    tab.show(800, 800)
    tab.wait("document.getElementById('leave').disabled")
    assert not tab.evaluate("document.getElementById('pixel-place').textContent.endsWith('(held)')")
