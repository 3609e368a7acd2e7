"""Sizes: lines of a crate, of a file and of a function, and files of a folder."""

from __future__ import annotations

import ast
import re
from collections import Counter
from pathlib import Path

from .python_imports import tree_of
from .source import (
    crates,
    end_of_item,
    product_code_of,
    product_lines,
    python_files,
    rust_files,
    rust_sources,
    text_of,
)

FILES_OF_FOLDER = 40
LINES_OF_FILE = 700
LINES_OF_FUNCTION = 80
# Generated or typed-in tables, whose length says nothing about how much there is to understand.
TABLE = re.compile(r"_table\.rs$")


def lines_of_crates(root: Path) -> int:
    """Lines under `crates/*/src`, tests and all."""
    return sum(text_of(path).count("\n") for path in sorted((root / "crates").glob("*/src/**/*.rs")))


def full_folders(root: Path) -> list[str]:
    """Folders with more source files directly in them than one look takes in."""
    paths = [path for crate in crates(root) for path in (root / "crates" / crate / "src").rglob("*.rs")]
    counts = Counter(path.parent.relative_to(root).as_posix() for path in [*paths, *python_files(root)])
    return [
        f"{folder} has {count} files, above {FILES_OF_FOLDER}"
        for folder, count in sorted(counts.items())
        if count > FILES_OF_FOLDER
    ]


def long_files(root: Path) -> list[str]:
    """Files too long to be one algorithm; inline tests do not count."""
    offences = []
    rust = [path for crate in crates(root) for path in rust_files(root, crate)]
    rust = [
        path for path in rust if "tests" not in path.relative_to(root).parts and not TABLE.search(path.name)
    ]
    counts = {path: len(product_lines(path)) - 1 for path in rust}
    for path in [*python_files(root), *sorted((root / "benchmarks").rglob("*.py"))]:
        counts[path] = text_of(path).count("\n")
    for path, lines in counts.items():
        if lines > LINES_OF_FILE:
            offences.append(f"{path.relative_to(root)} has {lines} lines, above {LINES_OF_FILE}")
    return offences


def long_rust_functions(root: Path, crate: str) -> list[str]:
    found = []
    for path in rust_sources(root, crate):
        code = product_code_of(path)
        for function in re.finditer(r"\bfn\s+(\w+)", code):
            body = code[function.start() : end_of_item(code, function.start())]
            lines = body.count("\n") + 1
            if lines > LINES_OF_FUNCTION:
                found.append(f"{path.relative_to(root)}: fn {function[1]} has {lines} lines")
    return found


def long_python_functions(root: Path) -> list[str]:
    found = []
    for path in python_files(root):
        for node in ast.walk(tree_of(path)):
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                lines = (node.end_lineno or 0) - node.lineno + 1
                if lines > LINES_OF_FUNCTION:
                    found.append(f"{path.relative_to(root)}: def {node.name} has {lines} lines")
    return found
