"""Names: the field's terms, each type once, no function called `of`."""

from __future__ import annotations

from pathlib import Path

import pytest
from house import limits, names, prose
from house.source import CRATES

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.parametrize("crate", CRATES)
def test_functions_have_an_object_in_their_name(crate: str) -> None:
    found = prose.rust_bare_names(ROOT, crate)
    assert len(found) <= limits.BARE_NAMES[crate], found


def test_python_functions_have_an_object_in_their_name() -> None:
    found = prose.python_bare_names(ROOT)
    assert len(found) <= limits.BARE_NAMES["python"], found


@pytest.mark.parametrize("crate", CRATES)
def test_a_crate_has_a_type_name_once(crate: str) -> None:
    assert names.repeated_types(ROOT, crate) == []


@pytest.mark.parametrize("crate", sorted(names.TERMS))
def test_a_crate_says_the_terms_of_its_field(crate: str) -> None:
    assert names.missing_terms(ROOT, crate) == []


def test_files_are_named_after_their_concept() -> None:
    assert names.vague_names(ROOT) == []


def test_a_broken_house_is_noticed(tmp_path: Path) -> None:
    source = tmp_path / "crates" / "bvh" / "src"
    source.mkdir(parents=True)
    (source / "lib.rs").write_text("mod utils;\nstruct Part;\nfn at() {}\n")
    (source / "utils.rs").write_text("//! A tlas.\npub(crate) enum Part { A }\nfn rotate_at() {}\n")
    assert names.repeated_types(tmp_path, "bvh") == ["crates/bvh: Part in lib.rs and utils.rs"]
    assert names.vague_names(tmp_path) == ["crates/bvh/src/utils.rs has a name that says nothing"]
    assert "crates/bvh never says TLAS" in names.missing_terms(tmp_path, "bvh")
    assert prose.rust_bare_names(tmp_path, "bvh") == ["crates/bvh/src/lib.rs: fn at"]
    module = tmp_path / "python" / "raycam" / "a.py"
    module.parent.mkdir(parents=True)
    module.write_text("class A:\n    def put(self): ...\n")
    assert prose.python_bare_names(tmp_path) == ["python/raycam/a.py: def put"]
