"""Names: each type once in a crate, and files named after their concept."""

from __future__ import annotations

from pathlib import Path

from . import rust_imports
from .source import CRATES, python_files

VAGUE_NAMES = {"util", "utils", "helper", "helpers", "common", "misc", "stuff"}


def repeated_types(root: Path, crate: str) -> list[str]:
    """Type names that two files of a crate define."""
    found = rust_imports.types(root / "crates" / crate / "src")
    return [
        f"crates/{crate}: {name} in {' and '.join(files)}"
        for name, files in sorted(found.items())
        if len(set(files)) > 1
    ]


def vague_names(root: Path) -> list[str]:
    """Files and folders whose names tell nothing of their concept."""
    paths = [path for crate in CRATES for path in (root / "crates" / crate / "src").rglob("*.rs")]
    return [
        f"{path.relative_to(root)} has a name that says nothing"
        for path in sorted(paths) + python_files(root)
        if VAGUE_NAMES & {path.stem, *path.relative_to(root).parts}
    ]
