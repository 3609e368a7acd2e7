"""Names: each type once in a crate, files named after their concept."""

from __future__ import annotations

from pathlib import Path

import pytest
from house import names
from house.source import CRATES

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.parametrize("crate", CRATES)
def test_a_crate_has_a_type_name_once(crate: str) -> None:
    assert names.repeated_types(ROOT, crate) == []


def test_files_are_named_after_their_concept() -> None:
    assert names.vague_names(ROOT) == []


def test_a_broken_house_is_noticed(tmp_path: Path) -> None:
    source = tmp_path / "crates" / "bvh" / "src"
    source.mkdir(parents=True)
    (source / "lib.rs").write_text("mod utils;\nstruct Part;\n\n")
    (source / "utils.rs").write_text("//! A tlas.\npub(crate) enum Part { A }\nfn rotate_at() {}\n")
    assert names.repeated_types(tmp_path, "bvh") == ["crates/bvh: Part in lib.rs and utils.rs"]
    assert names.vague_names(tmp_path) == ["crates/bvh/src/utils.rs has a name that says nothing"]
