"""Runs the test suites of trimesh, Open3D and pyrender with raycam's replacements.

    python benchmarks/drop_ins.py trimesh FOLDER [--original] [-- PYTEST_OPTIONS]
    python benchmarks/drop_ins.py open3d FOLDER [--original | --alone] [-- PYTEST_OPTIONS]
    python benchmarks/drop_ins.py pyrender FOLDER [--original]

FOLDER is a checkout of the library's repository; nothing is downloaded. `--original` tests the library
itself. trimesh's own sources are used together with `raycam.compat.trimesh.install(nearest=True)`. For
Open3D, `RaycastingScene` of the installed package is replaced; with `--alone`, `raycam.compat.open3d`
replaces the whole package `open3d`. pyrender's tests are long functions. Therefore, each of their statements
runs separately, even if an earlier statement failed, and the script counts assertions and `pytest.raises`
blocks.

Each command prints the number of tests or checks that pass, and a line for each that fails.
"""

from __future__ import annotations

import argparse
import ast
import importlib
import os
import sys
import traceback
from collections import Counter
from pathlib import Path
from typing import Any

import pytest

RAYCASTING_TESTS = "python/test/t/geometry/test_raycasting_scene.py"
PYRENDER_TESTS = "tests/unit"


class Outcomes:
    """Pytest plugin that counts the outcomes of tests."""

    def __init__(self) -> None:
        self.counts: Counter[str] = Counter()

    def pytest_runtest_logreport(self, report: Any) -> None:
        if report.when == "call" or report.outcome != "passed":
            self.counts[report.outcome] += 1


def run_pytest(tests: str, options: list[str]) -> Counter[str]:
    """Runs tests in this process and the current folder; returns the outcomes' counts."""
    outcomes = Outcomes()
    settings = ["-q", "--noconftest", "-p", "no:cacheprovider", "--tb=line", *options]
    pytest.main([tests, *settings], plugins=[outcomes])
    return outcomes.counts


def run_trimesh(original: bool, options: list[str]) -> Counter[str]:
    sys.path.insert(0, str(Path.cwd()))
    if not original:
        importlib.import_module("raycam.compat.trimesh").install(nearest=True)
    return run_pytest("tests", options)


def run_open3d(original: bool, alone: bool, options: list[str]) -> Counter[str]:
    compat = importlib.import_module("raycam.compat.open3d")
    if alone:
        sys.modules["open3d"] = compat
    elif not original:
        compat.install()
    return run_pytest(RAYCASTING_TESTS, options)


class Statements:
    """Runs the statements of test functions one by one, and counts the checks.

    Checks are assertions and blocks that expect an error.
    """

    def __init__(self) -> None:
        self.counts: Counter[str] = Counter()

    def run_file(self, path: Path) -> None:
        module = ast.parse(path.read_text())
        scope: dict[str, Any] = {"__name__": path.stem, "__file__": str(path)}
        functions = [node for node in module.body if isinstance(node, ast.FunctionDef)]
        rest = [node for node in module.body if not isinstance(node, ast.FunctionDef)]
        exec(compile(ast.Module(rest, []), str(path), "exec"), scope)
        for function in functions:
            if function.name.startswith("test_"):
                self._run(path, function.body, dict(scope))

    def _run(self, path: Path, body: list[ast.stmt], scope: dict[str, Any]) -> None:
        for statement in body:
            checks = isinstance(statement, ast.Assert | ast.With)
            code = compile(ast.Module([statement], []), str(path), "exec")
            try:
                exec(code, scope)
            except (Exception, pytest.fail.Exception) as error:
                where = f"{path.name}:{statement.lineno}"
                source = ast.unparse(statement).replace("\n", " ")[:110]
                reason = traceback.format_exception_only(error)[-1].strip()[:160]
                print(f"{where}: {source}\n    {reason}")
                self.counts["failed checks" if checks else "failed other statements"] += 1
            else:
                self.counts["passed checks" if checks else "passed other statements"] += 1


def run_pyrender(original: bool) -> Counter[str]:
    sys.path.insert(0, str(Path.cwd()))
    if not original:
        importlib.import_module("raycam.compat.pyrender").install()
    statements = Statements()
    for path in sorted(Path(PYRENDER_TESTS).glob("test_*.py")):
        statements.run_file(path)
    return statements.counts


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("suite", choices=["trimesh", "open3d", "pyrender"])
    parser.add_argument("folder", type=Path, help="checkout of the project's repository")
    parser.add_argument("--original", action="store_true", help="run without raycam, for comparison")
    parser.add_argument("--alone", action="store_true", help="open3d only: hide the installed package")
    parser.add_argument("options", nargs="*", help="pytest options, after --")
    given = parser.parse_args()
    os.chdir(given.folder)
    if given.suite == "trimesh":
        counts = run_trimesh(given.original, given.options)
    elif given.suite == "open3d":
        counts = run_open3d(given.original, given.alone, given.options)
    else:
        counts = run_pyrender(given.original)
    print(f"{given.suite}: " + ", ".join(f"{count} {name}" for name, count in sorted(counts.items())))


if __name__ == "__main__":
    main()
