"""The command `raycam learn`."""

from __future__ import annotations

import webbrowser
from pathlib import Path

import pytest
from raycam.cli import main
from support.node_core import needs_core

pytestmark = needs_core


def test_learn_writes_the_page_and_opens_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[str] = []
    monkeypatch.setattr(webbrowser, "open", opened.append)
    path = tmp_path / "lecture.html"
    assert main(["learn", str(path)]) == 0
    text = path.read_text(encoding="utf-8")
    assert "<title>Making Virtual Worlds</title>" in text
    assert len(text) < 6e6
    assert opened == [path.as_uri()]


def test_learn_with_no_open_opens_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[str] = []
    monkeypatch.setattr(webbrowser, "open", opened.append)
    assert main(["learn", str(tmp_path / "lecture.html"), "--no-open"]) == 0
    assert opened == []
