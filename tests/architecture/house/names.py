"""Names: unique types, files named after their concept, and the field's terms where these things are."""

from __future__ import annotations

import re
from pathlib import Path

from . import rust_imports
from .source import CRATES, python_files, rust_sources, text_of

VAGUE_NAMES = {"util", "utils", "helper", "helpers", "common", "misc", "stuff"}
TERMS = {
    "bvh": ("TLAS", "BLAS", "AABB", "SAH", "SoA", "frustum", "octant"),
    "render": ("BSDF", "MIS", "NEE|next-event estimation", "SoA", "Russian roulette", "caustic"),
}


def repeated_types(root: Path, crate: str) -> list[str]:
    """Type names that two files of a crate define."""
    found = rust_imports.types(root / "crates" / crate / "src")
    return [
        f"crates/{crate}: {name} in {' and '.join(files)}"
        for name, files in sorted(found.items())
        if len(set(files)) > 1
    ]


def missing_terms(root: Path, crate: str) -> list[str]:
    """Terms of the field that a crate does not use for what it has."""
    text = "\n".join(text_of(path) for path in rust_sources(root, crate))
    return [
        f"crates/{crate} never says {term}"
        for term in TERMS.get(crate, ())
        if not re.search(rf"\b({term})", text, 0 if term.isupper() else re.I)
    ]


def vague_names(root: Path) -> list[str]:
    """Files and folders whose names tell nothing of their concept."""
    paths = [path for crate in CRATES for path in (root / "crates" / crate / "src").rglob("*.rs")]
    return [
        f"{path.relative_to(root)} has a name that says nothing"
        for path in sorted(paths) + python_files(root)
        if VAGUE_NAMES & {path.stem, *path.relative_to(root).parts}
    ]
