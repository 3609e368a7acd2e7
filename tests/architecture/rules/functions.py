"""Long functions, and the sizes of files and folders."""

from __future__ import annotations

import ast
from collections import Counter
from pathlib import Path

from . import rust_facts
from .python_imports import tree_of
from .source import python_files, text_of

MAX_FUNCTION_LINES = 80
MAX_FILE_LINES = 700
MAX_FOLDER_FILES = 16


def long_functions(root: Path) -> list[str]:
    """Functions of the crates and the package with more than `MAX_FUNCTION_LINES` lines.

    Tests are excluded, and so are the lines of docstrings.
    """
    found = [
        (file, name, lines)
        for file, facts in rust_facts.files(root).items()
        if rust_facts.is_source(file)
        for name, lines in facts["functions"]
    ]
    for path in python_files(root):
        for node in ast.walk(tree_of(path)):
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                lines = _length(node) - (_length(node.body[0]) if ast.get_docstring(node) else 0)
                found.append((path.relative_to(root).as_posix(), node.name, lines))
    return [f"{file}: {name} has {lines} lines" for file, name, lines in found if lines > MAX_FUNCTION_LINES]


def _length(node: ast.stmt) -> int:
    return (node.end_lineno or node.lineno) - node.lineno + 1


def large_files(root: Path) -> list[str]:
    """Files with more than `MAX_FILE_LINES` lines.

    The number is reported, but not limited by a rule.
    """
    paths = [root / name for name in rust_facts.files(root) if rust_facts.is_source(name)] + python_files(
        root
    )
    sizes = {path.relative_to(root).as_posix(): text_of(path).count("\n") for path in paths}
    return [f"{name} has {lines} lines" for name, lines in sizes.items() if lines > MAX_FILE_LINES]


def large_folders(root: Path) -> list[str]:
    """Folders with more than `MAX_FOLDER_FILES` source files.

    The number is reported, but not limited by a rule.
    """
    paths = [root / name for name in rust_facts.files(root) if rust_facts.is_source(name)] + python_files(
        root
    )
    counts = Counter(path.parent.relative_to(root).as_posix() for path in paths)
    return [f"{name} has {count} files" for name, count in sorted(counts.items()) if count > MAX_FOLDER_FILES]
