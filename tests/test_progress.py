"""The progress bar."""

from __future__ import annotations

import pytest
from raycam import progress


def test_it_is_silent_away_from_a_terminal(
    capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(progress, "SHOW_AFTER_SECONDS", 0.0)
    with progress.bar("rendering") as tell:
        for i in range(3):
            tell(i, 3)
    captured = capfd.readouterr()
    assert captured.out == captured.err == ""


def test_it_shows_long_work_on_a_terminal(
    capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.stderr.isatty", lambda: True, raising=False)
    monkeypatch.setattr(progress, "SHOW_AFTER_SECONDS", 0.0)
    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.setenv("TERM", "xterm")
    with progress.bar("rendering") as tell:
        for i in range(5):
            tell(i, 4)
    captured = capfd.readouterr()
    assert "rendering" in captured.err
    assert "100 %" in captured.err
    assert captured.out == ""


def test_short_work_shows_nothing(capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.stderr.isatty", lambda: True, raising=False)
    with progress.bar("rendering") as tell:
        tell(1, 2)
        tell(2, 2)
    assert capfd.readouterr().err == ""
