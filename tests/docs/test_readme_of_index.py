"""README.md on the package index: all links are absolute."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from types import ModuleType
from urllib.parse import urlsplit

from markdown_it import MarkdownIt
from support.raises import raises

ROOT = Path(__file__).parents[2]


def script() -> ModuleType:
    spec = importlib.util.spec_from_file_location("readme_of_index", ROOT / ".ci" / "readme_of_index.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def targets(text: str) -> list[tuple[str, str]]:
    """Tag and target of every image and link, from a CommonMark parser."""
    found = []
    for block in MarkdownIt().enable("table").parse(text):
        for token in block.children or []:
            where = (
                token.attrGet("src" if token.tag == "img" else "href") if token.tag in ("img", "a") else None
            )
            if isinstance(where, str):
                found.append((token.tag, where))
    return found


def test_readme_links_become_absolute_addresses() -> None:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    before, after = targets(text), targets(script().absolute(text, "someone/raycam", "v1.2.3"))
    relative = [where for _, where in before if not urlsplit(where).scheme]
    assert len(relative) > 40
    assert [tag for tag, _ in before] == [tag for tag, _ in after]
    for (tag, was), (_, where) in zip(before, after, strict=True):
        if urlsplit(was).scheme:
            assert where == was
            continue
        address = urlsplit(where)
        parts = address.path.strip("/").split("/")
        host = "raw.githubusercontent.com" if tag == "img" else "github.com"
        inside = ROOT / urlsplit(was).path
        kind = [] if tag == "img" else ["tree" if inside.is_dir() else "blob"]
        assert (address.scheme, address.netloc) == ("https", host)
        assert parts[: 3 + len(kind)] == ["someone", "raycam", *kind, "v1.2.3"]
        assert ROOT.joinpath(*parts[3 + len(kind) :]) == inside
        assert inside.exists()


def test_code_and_anchors_are_unchanged_and_missing_files_raise() -> None:
    text = "[a](#b) <https://x.org> [c](https://x.org/y)\n\n```text\n[d](e.md)\n```\n"
    assert script().absolute(text, "a/b", "c") == text
    with raises(ValueError, mentions=["e.md"]):
        script().absolute("[d](e.md)", "a/b", "c")
