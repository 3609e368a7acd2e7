"""Prose: a comment opens with what a thing is or returns."""

from __future__ import annotations

from pathlib import Path

import pytest
from house import limits, prose
from house.source import CRATES

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.parametrize("crate", CRATES)
def test_doc_comments_open_with_what_a_thing_is(crate: str) -> None:
    found = prose.doc_openings(ROOT, crate)
    assert len(found) <= limits.DOC_OPENINGS[crate], found


@pytest.mark.parametrize("crate", CRATES)
def test_other_comments_open_with_what_a_thing_is(crate: str) -> None:
    found = prose.comment_openings(ROOT, crate)
    assert len(found) <= limits.COMMENT_OPENINGS[crate], found


def test_docstrings_open_with_what_a_thing_is() -> None:
    found = prose.python_openings(ROOT)
    assert len(found) <= limits.DOC_OPENINGS["python"], found


def test_descriptions_open_with_what_a_thing_is() -> None:
    assert prose.descriptions(ROOT) == []


def test_riddles_are_noticed(tmp_path: Path) -> None:
    source = tmp_path / "crates" / "bvh" / "src" / "a.rs"
    source.parent.mkdir(parents=True)
    source.write_text(
        "//! What a ray meets.\n\n/// Whether it is.\nfn a() {}\n/// The box.\n/// Whether it is not, follows.\n"
        "fn b() {\n"
        "    // Of both.\n    f(); // Whatever.\n}\n#[cfg(test)]\nmod tests {\n    /// Where it is.\n    fn c() {}\n}\n"
    )
    assert [line.split(": ", 1)[1] for line in prose.doc_openings(tmp_path, "bvh")] == [
        "//! What a ray meets.",
        "/// Whether it is.",
    ]
    assert len(prose.comment_openings(tmp_path, "bvh")) == 1
    module = tmp_path / "python" / "raycam" / "a.py"
    module.parent.mkdir(parents=True)
    module.write_text(
        '"""Whether."""\n\n\ndef f():\n    """The thing."""\n\n\nclass A:\n    """Those of B."""\n'
    )
    assert len(prose.python_openings(tmp_path)) == 2
