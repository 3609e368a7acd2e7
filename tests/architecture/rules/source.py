"""Source files of a repository."""

from __future__ import annotations

from functools import cache
from pathlib import Path

CRATES = ("bvh", "scene", "formats", "calibration", "render", "settle", "web", "bindings")
"""The crates, in the order in which they may use each other."""


@cache
def text_of(path: Path) -> str:
    """The text of a file."""
    return path.read_text(encoding="utf-8")


def python_files(root: Path) -> list[Path]:
    """The files of the Python package."""
    return sorted((root / "python" / "raycam").rglob("*.py"))
