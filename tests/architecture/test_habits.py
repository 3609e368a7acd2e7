"""Habits: short functions, and docstrings."""

from __future__ import annotations

from pathlib import Path

import pytest
from house import habits, limits, size
from house.source import CRATES

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.parametrize("crate", CRATES)
def test_rust_functions_fit_on_a_screen_or_two(crate: str) -> None:
    found = size.long_rust_functions(ROOT, crate)
    assert len(found) <= limits.LONG_FUNCTIONS.get(crate, 0), found


def test_python_functions_fit_on_a_screen_or_two() -> None:
    found = size.long_python_functions(ROOT)
    assert len(found) <= limits.LONG_FUNCTIONS.get("python", 0), found


def test_public_python_is_documented() -> None:
    assert habits.undocumented_python(ROOT) == []


def test_a_broken_house_is_noticed(tmp_path: Path) -> None:
    def write(name: str, text: str) -> None:
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")

    long = "fn long() {\n" + "    f();\n" * 79 + "}\n"
    write(
        "crates/bvh/src/lib.rs", "mod ray;\nmod hit;\npub mod node;\npub use hit::Hit;\npub use ray::Ray;\n"
    )
    write("crates/bvh/src/hit.rs", "pub struct Hit;\n")
    write("crates/bvh/src/ray.rs", f"pub struct Ray;\n{long}#[cfg(test)]\n{long}")
    write("crates/bvh/src/node.rs", "pub struct Node;\n" + "// line\n" * 700)
    write("crates/bvh/tests/node.rs", "")
    assert size.long_rust_functions(tmp_path, "bvh") == ["crates/bvh/src/ray.rs: fn long has 81 lines"]
    assert size.long_files(tmp_path) == ["crates/bvh/src/node.rs has 701 lines, above 700"]

    write("python/raycam/a.py", "def f():\n" + "    g()\n" * 80)
    module = "python/raycam/a.py"
    assert size.long_python_functions(tmp_path) == [f"{module}: def f has 81 lines"]
    assert habits.undocumented_python(tmp_path) == [
        f"{module} has no docstring",
        f"{module}.f has no docstring",
    ]
