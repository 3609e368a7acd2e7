"""Tests that every script in `benchmarks/` finds the project's own modules that it imports."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
BENCHMARKS = ROOT / "benchmarks"
# Modules of the tests; scripts import them as `support.NAME`.
OWN = {path.stem for path in (ROOT / "tests" / "support").glob("*.py")}


def imported(source: Path) -> set[str]:
    """Names of all modules that a file imports at its top level."""
    names: set[str] = set()
    for node in ast.parse(source.read_text(encoding="utf-8")).body:
        if isinstance(node, ast.Import):
            names |= {name.name for name in node.names}
        if isinstance(node, ast.ImportFrom) and node.module:
            names.add(node.module)
    return names


@pytest.mark.parametrize("source", sorted(BENCHMARKS.glob("*.py")), ids=lambda path: path.stem)
def test_benchmark_finds_the_modules_of_the_tests(source: Path) -> None:
    for name in imported(source):
        top, _, rest = name.partition(".")
        if top == "support":
            assert rest in OWN, name
        assert top not in OWN or (BENCHMARKS / f"{top}.py").exists(), f"{name} is in tests/support"
