"""`raycam learn`: the files of the lecture are written, and notebooks with answers are kept."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import pytest
from raycam import cli
from raycam.lecture import learn
from support.node_core import needs_core

DOCS = Path(__file__).resolve().parents[2] / "docs"
NOTEBOOKS = Path(learn.__file__).parent / "notebooks"


def test_lecture_page_has_the_current_text(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "path", [str(DOCS), *sys.path])
    import lecture_page

    page = lecture_page.PAGE.read_text(encoding="utf-8")
    text = lecture_page.SOURCE.read_text(encoding="utf-8")
    outdated = "run: python docs/lecture_page.py"
    assert f'content="{lecture_page.digest(text)}"' in page, outdated
    assert page.count("<figure>") == text.count("```{figure}")
    assert "<!--block" not in page


def test_learn_writes_lecture_and_notebooks(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    opened: list[str] = []
    monkeypatch.setattr("webbrowser.open", opened.append)
    monkeypatch.setattr("raycam.viewer.web.core.is_built", lambda: False)
    assert cli.main(["learn", str(tmp_path / "course")]) == 0
    names = sorted(path.name for path in (tmp_path / "course").iterdir())
    assert "lecture.html" in names
    notebooks = {name for name in names if name.endswith(".ipynb")}
    assert notebooks == {path.name for path in NOTEBOOKS.glob("*.ipynb")}
    assert "4_ray_tracer_by_hand_solutions.ipynb" in notebooks
    assert opened == [(tmp_path / "course" / "lecture.html").resolve().as_uri()]
    page = (tmp_path / "course" / "lecture.html").read_text(encoding="utf-8")
    assert "make web" in page
    assert "live.html" not in page
    assert not re.search(r'(?:src|href)="(?!data:|https?:)', page)
    assert all(name in capsys.readouterr().out for name in ["lecture.html"])


@needs_core
def test_learn_opens_the_interactive_page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[str] = []
    monkeypatch.setattr("webbrowser.open", opened.append)
    assert cli.main(["learn", str(tmp_path)]) == 0
    assert opened == [(tmp_path / "live.html").resolve().as_uri()]
    text = (tmp_path / "live.html").read_text(encoding="utf-8")
    assert "<title>Making Virtual Worlds</title>" in text
    assert len(text) < 6e6


def test_learn_keeps_notebooks_with_answers(tmp_path: Path) -> None:
    learn.write_lecture(tmp_path)
    notebook = next(tmp_path.glob("4*hand.ipynb"))
    notebook.write_text("my answers")
    learn.write_lecture(tmp_path)
    assert notebook.read_text() == "my answers"


def test_no_open_does_not_start_the_browser(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("webbrowser.open", lambda url: pytest.fail("the browser was opened"))
    assert cli.main(["learn", str(tmp_path), "--no-open"]) == 0
