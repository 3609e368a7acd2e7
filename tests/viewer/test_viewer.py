"""`raycam.view`, and its command."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import urllib.request
from pathlib import Path
from typing import Any

import pytest
import raycam
from raycam import cli
from raycam.viewer import view as viewing
from raycam.viewer.viewer import Viewer
from support.patience import PATIENCE, until
from support.raises import raises
from support.session_messages import receive


@pytest.fixture
def no_browser(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The addresses that the browser would have opened."""
    opened: list[str] = []
    monkeypatch.setattr("webbrowser.open", lambda url: opened.append(url) is None)
    return opened


def page_at(url: str) -> str:
    with urllib.request.urlopen(url.split("#")[0], timeout=PATIENCE) as answer:
        return answer.read().decode()


def test_world_is_served_until_close(small_world: raycam.World, no_browser: list[str]) -> None:
    viewer = raycam.view(small_world, block=False, browser=True, port=0)
    assert isinstance(viewer, Viewer)
    assert [Path(url.removeprefix("file://")).suffix for url in no_browser] == [".html"]
    assert "raycam" in page_at(viewer.url)
    assert viewer.camera == small_world.default_camera()
    assert viewer.frame() is None
    viewer.close()
    with pytest.raises(OSError):  # noqa: PT011
        page_at(viewer.url)


def test_view_accepts_the_path_of_a_world(no_browser: list[str], tmp_path: Path) -> None:
    (tmp_path / "room.toml").write_text("[[object]]\nbox = { size = 1 }\n")
    with raycam.view(tmp_path / "room.toml", block=False, browser=False, port=0) as viewer:
        assert [each.name for each in viewer.world.objects]
    assert no_browser == []


def test_view_shows_a_frame_as_a_page(small_world: raycam.World, no_browser: list[str]) -> None:
    path = raycam.view(raycam.render(small_world, samples=1), title="mine")
    assert no_browser == [path.as_uri()]
    assert "mine" in path.read_text(encoding="utf-8")
    path.unlink()


@pytest.mark.parametrize(
    "options", [{"integrator": "flat"}, {"integrator": "pth"}, {"samples": 0}, {"samples": 1.5}]
)
def test_invalid_view_options_are_refused_before_serving(
    small_world: raycam.World, options: dict[str, Any]
) -> None:
    with pytest.raises(raycam.SettingsError):
        Viewer(small_world, port=0, **options)


@pytest.mark.parametrize(
    ("environment", "platform", "found"),
    [
        ({"SSH_CONNECTION": "1", "DISPLAY": ":0"}, "linux", False),
        ({}, "linux", False),
        ({"DISPLAY": ":0"}, "linux", True),
        ({}, "darwin", True),
    ],
)
def test_browser_opens_only_on_a_local_desktop(
    environment: dict[str, str],
    platform: str,
    found: bool,
    monkeypatch: pytest.MonkeyPatch,
    no_browser: list[str],
    small_world: raycam.World,
) -> None:
    for name in ("SSH_CONNECTION", "DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    monkeypatch.setattr(viewing.sys, "platform", platform)
    monkeypatch.setattr("webbrowser.get", lambda: None)
    opened: list[str] = []
    monkeypatch.setattr("webbrowser.open", lambda url: opened.append(url) or True)
    with raycam.view(small_world, block=False, browser=False, port=0) as viewer:
        assert viewing.open_browser(viewer) == found
        assert viewing.open_browser(viewer, False) is False
        assert len(opened) == found
        for url in opened:
            path = Path(url.removeprefix("file://"))
            assert viewer._server is not None
            assert viewer._server.token not in url + path.read_text()
            assert path.stat().st_mode & 0o777 == 0o600
    assert not any(Path(url.removeprefix("file://")).exists() for url in opened)


# The command ----------------------------------------------------------------------------------------------


def test_view_command_compares_two_saved_frames(
    small_world: raycam.World, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for seed in (0, 1):
        raycam.render(small_world, samples=2, seed=seed).save(tmp_path / f"{seed}.npz")
    assert cli.main(["view", str(tmp_path / "0.npz"), str(tmp_path / "1.npz"), "--no-browser"]) == 0
    path = Path(capsys.readouterr().out.strip())
    text = path.read_text(encoding="utf-8")
    path.unlink()
    document = json.loads(re.search(r'id="document">(.*?)</script>', text)[1])  # type: ignore[index]
    assert {"a-color", "b-color"} <= {plane["key"] for plane in document["planes"]}


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["w.toml", "--host", "0.0.0.0"], "--host 0.0.0.0"),
        (["w.toml", "--host", "example.org"], "expected an address"),
        (["w.toml", "b.npz"], "cannot be compared with w.toml"),
        (["w.toml", "--integrator", "pth"], "integrator"),
        (["missing.npz"], "missing.npz"),
        (["w.npz"], "w.npz"),
    ],
)
def test_unsupported_files_are_refused_by_the_view_command(
    words: list[str],
    told: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("w.toml").write_text("[[object]]\nbox = { size = 1 }\n")
    Path("w.npz").write_text("no")
    assert cli.main(["view", *words, "--no-browser", "--port", "0"]) != 0
    assert told in capsys.readouterr().err


def test_view_command_serves_until_interrupted(tmp_path: Path) -> None:
    (tmp_path / "w.toml").write_text("[[object]]\nbox = { size = 1 }\n")
    words = [sys.executable, "-m", "raycam", "view", str(tmp_path / "w.toml"), "--no-browser", "--port", "0"]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    with subprocess.Popen(
        words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment
    ) as made:
        assert made.stdout is not None
        url = re.search(r"http\S+", made.stdout.readline())
        assert url
        assert "<html" in page_at(url[0])
        made.send_signal(2)
        assert made.wait(PATIENCE) == 130


def test_size_argument_sets_the_image_size(small_world: raycam.World) -> None:
    with raycam.view(small_world, size=(30, 20), block=False, browser=False, port=0) as viewer:
        assert viewer.camera == small_world.default_camera().resized((30, 20))
        session = viewer._session()
        receive(session, {"type": "size", "width": 900, "height": 700, "ratio": 2})
        assert session.view.size == session.view.still_camera.size == (30, 20)
    with raises(raycam.SettingsError, code="out_of_range", mentions=["4000 x 3000"]):
        raycam.view(small_world, size=(4000, 3000), block=False, browser=False, port=0)


def test_first_client_starts_with_a_camera_that_shows_the_current_world(small_world: raycam.World) -> None:
    other = raycam.World()
    other.add_object(sphere={"radius": 300}, name="moon")
    with Viewer(small_world, view_from="front", size=(64, 48), port=0) as viewer:
        until(lambda: viewer._prepared is not None)
        viewer.world = other
        first = viewer._session()
        assert first.view.camera == viewer._session().view.camera
        assert first.view.camera == other.view_from("front", size=(64, 48))


def test_first_client_gets_the_prepared_session(small_world: raycam.World) -> None:
    with Viewer(small_world, port=0) as viewer:
        until(lambda: viewer._prepared is not None)
        assert viewer._prepared is not None
        prepared = viewer._prepared[1]
        assert viewer._session() is prepared
        assert viewer._session() is not prepared
