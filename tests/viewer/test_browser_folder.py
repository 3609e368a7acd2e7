"""The folder of pages for browsers, with and without browsers from snap."""

from __future__ import annotations

import stat
from pathlib import Path

import pytest
import raycam
from raycam.viewer.files import browser_folder
from raycam.viewer.page import page, write_page
from raycam.viewer.viewer import Viewer


@pytest.fixture
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A home folder, and an empty folder in place of the folder of snap's commands."""
    for name in ("home", "snap"):
        (tmp_path / name).mkdir()
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    monkeypatch.setattr(browser_folder, "SNAP_COMMANDS", tmp_path / "snap")
    return tmp_path / "home"


def test_pages_for_browsers_from_snap_are_in_a_visible_private_folder(
    home: Path, small_world: raycam.World
) -> None:
    assert browser_folder.browser_folder() is None
    (home.parent / "snap" / "firefox").touch()
    frame = raycam.render(small_world, small_world.camera("front"), samples=1)
    folder = home / "raycam-pages"
    assert write_page(page(frame), browser=False).parent == folder
    assert stat.S_IMODE(folder.stat().st_mode) == 0o700
    with Viewer(small_world, port=0) as viewer:
        redirect = viewer.redirect_file()
        assert redirect.is_relative_to(folder)
        assert not any(part.startswith(".") for part in redirect.relative_to(home).parts)
        assert stat.S_IMODE(redirect.stat().st_mode) == 0o600
    assert not redirect.exists()


def test_default_folder_is_used_if_the_page_folder_cannot_be_created(home: Path) -> None:
    (home.parent / "snap" / "chromium").touch()
    (home / "raycam-pages").write_text("a file")
    assert browser_folder.browser_folder() is None
