"""Recordings: the changes of a view, saved as a page that plays without a server."""

from __future__ import annotations

import base64
import io
import json
import re
from pathlib import Path

import numpy as np
import pytest
import raycam
from PIL import Image
from raycam import progress as progress_module
from raycam.viewer import recording as recording_module
from raycam.viewer.recording import Recording
from raycam.viewer.viewer import Viewer
from support.chromium import Tab
from support.patience import until
from support.raises import raises

SAMPLES = 4


def recorded(viewer: Viewer, world: raycam.World) -> Recording:
    """A recording of the cameras `front`, then `side`, then the exposure of one more stop."""
    recording = viewer.record(fps=60)
    viewer.camera = world.camera("side")
    until(lambda: len(recording.times) == 2)
    viewer.world = world.copy()
    viewer.world.set_object("box", color="#0000ff")
    viewer.world = viewer.world
    until(lambda: len(recording.times) >= 3)
    recording.stop()
    return recording


def test_saved_page_contains_each_recorded_image_and_its_time(
    small_world: raycam.World, tmp_path: Path
) -> None:
    with Viewer(small_world, small_world.camera("front"), port=0) as viewer:
        recording = recorded(viewer, small_world)
        last = viewer.world
    recording.save(tmp_path / "x.html", samples=SAMPLES, size=(96, 64))
    text = (tmp_path / "x.html").read_text(encoding="utf-8")
    found = re.search(r'id="recording">(.*?)</script>', text)
    assert found is not None
    document = json.loads(found[1])
    assert document["times"] == recording.times == sorted(set(recording.times))
    assert document["times"][0] == 0
    assert document["times"][-1] < document["seconds"] == recording.seconds
    images = [
        np.asarray(Image.open(io.BytesIO(base64.b64decode(data))))
        for data in re.findall(r'id="image-\d+">(.*?)</script>', text)
    ]
    assert len(images) == len(recording.times)
    for image, world, name in [
        (images[0], small_world, "front"),
        (images[1], small_world, "side"),
        (images[-1], last, "side"),
    ]:
        expected = raycam.render(
            world, small_world.camera(name).resized((96, 64)), integrator="direct", samples=SAMPLES
        )
        assert np.abs(image.astype(int) - expected.to_srgb8()).mean() < 5, name
    assert "://" not in text


def test_saving_counts_the_images_and_stops_after_an_exception(
    small_world: raycam.World,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    with Viewer(small_world, small_world.camera("front"), port=0) as viewer:
        recording = recorded(viewer, small_world)
    count, seen = len(recording.times), []
    recording.save(tmp_path / "x.html", samples=1, progress=lambda *done: seen.append(done))
    assert seen == [(number + 1, count) for number in range(count)]
    with pytest.raises(KeyboardInterrupt):
        recording.save(tmp_path / "y.html", samples=1, progress=lambda *done: _interrupt())
    assert not (tmp_path / "y.html").exists()
    capsys.readouterr()
    monkeypatch.setattr(progress_module, "LINE_AFTER_SECONDS", 0.0)
    recording.save(tmp_path / "x.html", samples=1)
    assert "rendering images" in capsys.readouterr().err


def _interrupt() -> None:
    raise KeyboardInterrupt


def test_recording_stops_at_its_limit_and_with_its_viewer(small_world: raycam.World) -> None:
    with Viewer(small_world, small_world.camera("front"), port=0) as viewer:
        short, other = viewer.record(seconds=0.2), viewer.record()
        until(lambda: not short._thread.is_alive())
        assert short.seconds == 0.2
    assert not other._thread.is_alive()
    for options in ({"fps": 0}, {"fps": 100}, {"seconds": 601}):
        with raises(raycam.SettingsError, code="out_of_range"):
            viewer.record(**options)


@pytest.mark.proof
def test_saved_page_plays_in_a_browser_without_requests(
    tab: Tab, small_world: raycam.World, tmp_path: Path
) -> None:
    with Viewer(small_world, small_world.camera("front"), port=0) as viewer:
        recording = recorded(viewer, small_world)
    recording.save(tmp_path / "x.html", samples=1)
    tab.said.clear()
    tab.call("Page.navigate", url=(tmp_path / "x.html").as_uri())
    tab.wait("document.getElementById('picture').naturalWidth === 48")
    tab.requests.clear()
    first = tab.evaluate("document.getElementById('picture').src")
    tab.evaluate("document.getElementById('play').click()")
    end = f"{recording.seconds:.1f} s of {recording.seconds:.1f} s"
    tab.wait(f"document.getElementById('time-text').textContent === '{end}'")
    tab.wait("document.getElementById('play').textContent === 'Play'")
    assert tab.evaluate("document.getElementById('picture').src") != first
    assert [each for each in tab.requests if not each.startswith("data:")] == []
    assert tab.said == []


def test_recording_is_refused_before_rendering_unless_it_can_be_saved_as_a_page(
    small_world: raycam.World, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with Viewer(small_world, small_world.camera("front"), port=0) as viewer:
        recording = viewer.record()
        monkeypatch.setattr(recording_module, "render", lambda *given, **keys: pytest.fail("rendered"))
        for name in ("tour.mp4", "tour.gif", "tour"):
            with raises(raycam.FormatError, code="unknown_format", mentions=[name, ".html", "Save video"]):
                recording.save(tmp_path / name)
        with pytest.raises(FileNotFoundError):
            recording.save(tmp_path / "missing" / "tour.html")
    assert list(tmp_path.iterdir()) == []
