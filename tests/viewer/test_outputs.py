"""Snapshots of a live view."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import pytest
import raycam
from raycam.viewer.files import outputs
from raycam.viewer.files.outputs import _stem, snapshot
from raycam.viewer.session import Session
from support.patience import PATIENCE
from support.raises import raises
from support.session_messages import receive


def test_snapshot_without_a_still_image_raises(
    small_world: raycam.World, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(outputs, "SAMPLES_TIMEOUT_S", 0.0)
    session = Session(small_world, small_world.camera("front"))
    with raises(raycam.SettingsError, code="no_samples"):
        snapshot(session, "png")


def test_snapshot_waits_for_the_first_still_image(small_world: raycam.World) -> None:
    session = Session(small_world, small_world.camera("front"), samples=1)
    receive(session, {"type": "size", "width": 48, "height": 32, "ratio": 1})
    with ThreadPoolExecutor() as pool:
        saved = pool.submit(snapshot, session, "png")
        frame = session.images.refinement_of(session.view).refine(raycam.Cancel())
        assert frame is not None
        assert not saved.done()
        session.images.keep_still(session.images.version, frame)
        assert saved.result(PATIENCE)[2].startswith(b"\x89PNG")


def test_png_snapshot_equals_the_frame(small_world: raycam.World) -> None:
    session = Session(small_world, small_world.camera("front"), title="a room.toml", samples=4)
    receive(session, {"type": "size", "width": 48, "height": 32, "ratio": 1})
    receive(session, {"type": "display", "exposure": 1.0, "view": "agx"})
    refinement = session.images.refinement_of(session.view)
    while refinement.samples < 4:  # a slow machine renders fewer samples at a time
        frame = refinement.refine(raycam.Cancel())
    assert frame is not None
    session.images.keep_still(session.images.version, frame)
    name, media, data = snapshot(session, "png")
    assert (name, media) == ("a_room.png", "image/png")
    expected = raycam.render(small_world, small_world.camera("front"), samples=4, exposure=1.0, view="agx")
    assert data == expected.to_png()


@pytest.mark.parametrize(
    ("title", "stem"),
    [
        ("../../etc/passwd", "etc_passwd"),
        ("", "raycam"),
        ("..", "raycam"),
        ("x" * 99, "x" * 60),
        ("a/b.toml", "a_b"),
    ],
)
def test_titles_become_file_names(title: str, stem: str) -> None:
    assert _stem(title) == stem
