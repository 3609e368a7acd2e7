"""The progress bar."""

from __future__ import annotations

import pytest
from raycam import progress


def on_a_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    """Makes stderr a terminal on which even short work is drawn immediately."""
    monkeypatch.setattr("sys.stderr.isatty", lambda: True, raising=False)
    monkeypatch.setattr(progress, "SHOW_AFTER_SECONDS", 0.0)
    monkeypatch.setattr(progress, "DRAW_AFTER_SECONDS", 0.0)


def test_progress_bar_prints_nothing_without_a_terminal(
    capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(progress, "SHOW_AFTER_SECONDS", 0.0)
    with progress.bar("rendering") as tell:
        for i in range(3):
            tell(i, 3)
    captured = capfd.readouterr()
    assert captured.out == captured.err == ""


def test_progress_bar_shows_long_work_on_a_terminal(
    capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    on_a_terminal(monkeypatch)
    with progress.bar("rendering") as tell:
        for i in range(5):
            tell(i, 4)
    captured = capfd.readouterr()
    assert "rendering" in captured.err
    assert "100 %" in captured.err
    assert captured.err.endswith("\r"), "the bar is gone, and the cursor before it"
    assert not captured.err.split("\r")[-2].strip()
    assert captured.out == ""


def test_progress_bar_is_hidden_for_short_work(
    capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.stderr.isatty", lambda: True, raising=False)
    with progress.bar("rendering") as tell:
        tell(1, 2)
        tell(2, 2)
    assert capfd.readouterr().err == ""


def test_progress_bar_shows_frame_rate_and_failures(
    capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    on_a_terminal(monkeypatch)
    monkeypatch.setenv("COLUMNS", "100")
    clock = iter(range(0, 1000, 10))
    monkeypatch.setattr(progress.time, "monotonic", lambda: float(next(clock)))
    with progress.frames_bar("views") as tell:
        tell(10, 40, 0)  # ten frames were already finished before the job started
        tell(19, 40, 1)
    first, last, *_ = [part for part in capfd.readouterr().err.split("\r") if part.strip()]
    assert "[=======>" in first
    assert "-:--:--" in first
    assert "20/40 frames" in last
    assert "1 failed" in last
    assert "[===============>" in last
    assert ":" in last.split()[-1]
    assert "-" not in last.split()[-1]


def test_progress_bar_fits_a_narrow_terminal(
    capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.stderr.isatty", lambda: True, raising=False)
    monkeypatch.setattr(progress, "SHOW_AFTER_SECONDS", 0.0)
    monkeypatch.setenv("COLUMNS", "20")
    with progress.bar("rendering") as tell:
        tell(0, 9)
        tell(1, 9)
    assert max(map(len, capfd.readouterr().err.split("\r"))) == 19
