"""How comments and docstrings open, and function names that say nothing alone."""

from __future__ import annotations

import ast
import re
import tomllib
from pathlib import Path

from .python_imports import tree_of
from .source import product_code_of, product_lines, python_files, rust_sources

RIDDLE = re.compile(r"(What|Where|Whether|Of|That|Those)\b")
COMMENT = re.compile(r"\s*(//[/!]?)\s?(.*)")
# Names that need an object: `at` of what, `put` where?
BARE_NAMES = {"of", "at", "put", "take", "is", "find", "place", "meet", "ask", "tell", "told", "look"}


def doc_openings(root: Path, crate: str) -> list[str]:
    """Doc comments of a crate whose first word is one of a riddle, as `file: text`."""
    return [line for kind, line in _openings(root, crate) if kind != "//"]


def comment_openings(root: Path, crate: str) -> list[str]:
    """Other comments of a crate whose first word is one of a riddle."""
    return [line for kind, line in _openings(root, crate) if kind == "//"]


def descriptions(root: Path) -> list[str]:
    """Descriptions of crates and of the package whose first word is one of a riddle."""
    files = dict.fromkeys(sorted(root.glob("crates/*/Cargo.toml")), "package")
    files[root / "pyproject.toml"] = "project"
    found = []
    for path, table in files.items():
        text = tomllib.loads(path.read_text(encoding="utf-8"))[table]["description"]
        if RIDDLE.match(text):
            found.append(f"{path.relative_to(root)}: {text}")
    return found


def _openings(root: Path, crate: str) -> list[tuple[str, str]]:
    found = []
    for path in rust_sources(root, crate):
        before = ""
        for line in product_lines(path):
            comment = COMMENT.match(line)
            kind = comment[1] if comment else ""
            if comment and kind != before and RIDDLE.match(comment[2]):
                found.append((kind, f"{path.relative_to(root)}: {kind} {comment[2]}"))
            before = kind
    return found


def python_openings(root: Path) -> list[str]:
    """Docstrings of the package whose first word is one of a riddle."""
    found = []
    for path in python_files(root):
        for node in ast.walk(tree_of(path)):
            if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
                text = ast.get_docstring(node) or ""
                if RIDDLE.match(text):
                    found.append(f"{path.relative_to(root)}: {text.splitlines()[0]}")
    return found


def rust_bare_names(root: Path, crate: str) -> list[str]:
    """Functions of a crate whose whole name is one of `BARE_NAMES`."""
    return [
        f"{path.relative_to(root)}: fn {name}"
        for path in rust_sources(root, crate)
        for name in re.findall(r"\bfn\s+(\w+)", product_code_of(path))
        if name in BARE_NAMES
    ]


def python_bare_names(root: Path) -> list[str]:
    return [
        f"{path.relative_to(root)}: def {node.name}"
        for path in python_files(root)
        for node in ast.walk(tree_of(path))
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) and node.name in BARE_NAMES
    ]
