"""The chart of the README shows the newest results."""

from __future__ import annotations

from pathlib import Path

import pytest

DOCS = Path(__file__).resolve().parents[2] / "docs"


def test_speed_chart_shows_the_newest_results(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(DOCS))
    import speed_chart  # type: ignore[import-not-found]

    (tmp_path / "images").mkdir()
    monkeypatch.setattr(speed_chart, "DOCS", tmp_path)
    speed_chart.main()
    drawn = (tmp_path / "images" / "speed.svg").read_text("utf-8")
    assert drawn == (DOCS / "images" / "speed.svg").read_text("utf-8"), "python docs/speed_chart.py"
    assert drawn.count("<rect x") == 3 + 3 * (12 + 7)
