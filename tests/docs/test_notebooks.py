"""Notebooks are stored without outputs, and all their cells run."""

from __future__ import annotations

import ast
import json
import warnings
from pathlib import Path

import pytest
from support.subject_share import MIN_SHARE, SavedPictures

ROOT = Path(__file__).resolve().parents[2]
NOTEBOOKS = sorted((ROOT / "python" / "raycam" / "lecture" / "notebooks").glob("*.ipynb"))


def cells(path: Path, kind: str) -> list[str]:
    made = json.loads(path.read_text(encoding="utf-8"))
    return ["".join(cell["source"]) for cell in made["cells"] if cell["cell_type"] == kind]


def test_notebooks_are_listed_and_have_no_outputs() -> None:
    assert [path.name[0] for path in NOTEBOOKS] == list("1234456789")
    page = (ROOT / "docs" / "notebooks" / "index.md").read_text(encoding="utf-8")
    for path in NOTEBOOKS:
        made = json.loads(path.read_text(encoding="utf-8"))
        assert made["nbformat"] == 4
        assert cells(path, "markdown")[0].startswith("# ")
        assert path.name in page
        for cell in made["cells"]:
            if cell["cell_type"] == "code":
                assert cell["outputs"] == []
                assert cell["execution_count"] is None
                ast.parse("".join(cell["source"]))


def test_exercises_have_no_solutions_and_solutions_are_correct() -> None:
    exercises, solutions = (cells(path, "code") for path in NOTEBOOKS if path.name[0] == "4")
    checks = [source for source in exercises if "exercises.check_" in source]
    assert len(checks) == 6
    assert all("    ..." in source or "= ..." in source for source in checks)
    names: dict[str, object] = {}
    for source in solutions[:-1]:
        tree = ast.parse(source)
        last = tree.body.pop()
        exec(compile(tree, "solutions", "exec"), names)
        if "exercises.check_" in source:
            assert isinstance(last, ast.Expr)
            verdict = eval(compile(ast.Expression(last.value), "solutions", "eval"), names)
            assert verdict.correct, verdict.text


@pytest.mark.proof
@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_every_notebook_cell_runs(path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    pictures = SavedPictures(monkeypatch)
    names: dict[str, object] = {}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # notices are printed below a cell and do not stop it
        for number, source in enumerate(cells(path, "code")):
            tree = ast.parse(source)
            last = tree.body.pop() if tree.body and isinstance(tree.body[-1], ast.Expr) else None
            exec(compile(tree, f"{path.name}[{number}]", "exec"), names)
            if last is not None:
                shown = eval(compile(ast.Expression(last.value), f"{path.name}[{number}]", "eval"), names)
                share = pictures.share_of(shown)
                assert share is None or share >= MIN_SHARE, (
                    f"{path.name}[{number}]: {share:.1%} of the picture"
                )
                if hasattr(shown, "_repr_html_"):
                    assert shown._repr_html_()
