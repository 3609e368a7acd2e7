"""Source files of a repository, and their text without comments, strings and tests."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

CRATES = ("bvh", "scene", "formats", "calibration", "render", "web", "bindings")

NOT_CODE = re.compile(
    r"""
      //[^\n]* | /\*.*?\*/                # comments
    | r(\#*)".*?"\1 | "(?:\\.|[^"\\])*"   # strings
    | '(?:\\.[^']*|[^'\\])'              # characters, but not lifetimes
    """,
    re.S | re.X,
)
TEST_ATTRIBUTE = re.compile(r"#\[cfg\((?:all\()?test\b[^\]]*\]")


@cache
def text_of(path: Path) -> str:
    return path.read_text(encoding="utf-8")


def crates(root: Path) -> list[str]:
    """Names of the crates that are there, in the order in which they may use each other."""
    return [name for name in CRATES if (root / "crates" / name / "src").is_dir()]


def rust_files(root: Path, crate: str) -> list[Path]:
    """All Rust files of a crate, its tests, examples and benchmarks included."""
    paths = sorted((root / "crates" / crate).rglob("*.rs"))
    return [path for path in paths if "target" not in path.relative_to(root).parts]


def rust_sources(root: Path, crate: str) -> list[Path]:
    """Rust files under `src`, without test modules in files of their own."""
    source = root / "crates" / crate / "src"
    return [path for path in sorted(source.rglob("*.rs")) if not is_test_file(path.relative_to(source))]


def is_test_file(path: Path) -> bool:
    """True of `tests.rs`, and of files in a folder `tests`."""
    return "tests" in (*path.parts[:-1], path.stem)


def python_files(root: Path) -> list[Path]:
    return sorted((root / "python" / "raycam").rglob("*.py"))


@cache
def code_of(path: Path) -> str:
    """Rust source without comments and the insides of strings and characters, line for line."""
    return NOT_CODE.sub(_blank, text_of(path))


def _blank(found: re.Match[str]) -> str:
    lines = "\n" * found[0].count("\n")
    return (lines or " ") if found[0].startswith("/") else f'""{lines}'


@cache
def product_code_of(path: Path) -> str:
    """Rust code without the items that are compiled for tests only, line for line."""
    code = code_of(path)
    for start, end in reversed(test_spans(code)):
        code = code[:start] + "\n" * code[start:end].count("\n") + code[end:]
    return code


@cache
def product_lines(path: Path) -> list[str]:
    """Lines of a Rust file, comments included, without the items that are compiled for tests only."""
    lines = text_of(path).split("\n")
    code = code_of(path)
    drop: set[int] = set()
    for start, end in test_spans(code):
        drop |= set(range(code.count("\n", 0, start), code.count("\n", 0, end) + 1))
    return [line for number, line in enumerate(lines) if number not in drop]


def test_spans(code: str) -> list[tuple[int, int]]:
    """Start and end of each item under `#[cfg(test)]`."""
    spans: list[tuple[int, int]] = []
    for found in TEST_ATTRIBUTE.finditer(code):
        if not spans or found.start() >= spans[-1][1]:
            spans.append((found.start(), end_of_item(code, found.end())))
    return spans


def end_of_item(code: str, start: int) -> int:
    """Index after the item that begins at `start`: its closing brace, or its semicolon."""
    is_use = re.match(r"\s*(?:pub(?:\([^)]*\))?\s+)?use\b", code[start:]) is not None
    depth = 0
    for found in re.finditer(r"[{}()\[\];]", code[start:]):
        sign = found[0]
        if sign in "{([":
            depth += 1
        elif sign in "})]":
            depth -= 1
            if depth == 0 and sign == "}" and not is_use:
                return start + found.end()
        elif depth == 0:
            return start + found.end()
    return len(code)
