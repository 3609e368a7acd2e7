"""Numbered examples are short, run in an empty folder, and write the promised files.

The files are named in the example's docstring.
"""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from pathlib import Path

import pytest

EXAMPLES = sorted((Path(__file__).resolve().parents[2] / "examples").glob("[0-9]*.py"))


def test_examples_are_numbered_without_gaps() -> None:
    assert [int(path.name[:2]) for path in EXAMPLES] == list(range(1, len(EXAMPLES) + 1))
    assert len(EXAMPLES) >= 8


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_example_writes_the_files_named_in_its_docstring(path: Path, tmp_path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    assert text.count("\n") < 60
    promise = re.search(r"Writes (.*)\.$", ast.get_docstring(ast.parse(text)) or "", re.M)
    assert promise, "the docstring says what it writes, or that it writes nothing"
    done = subprocess.run(
        [sys.executable, "-W", "error", str(path)], cwd=tmp_path, check=False, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    promised = set(re.findall(r"[\w-]+\.\w+", promise[1]))
    assert {file.name for file in tmp_path.iterdir()} == promised
    assert all((tmp_path / name).stat().st_size > 0 for name in promised)
