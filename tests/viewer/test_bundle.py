"""The client's modules, bundled into one text."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
import raycam
from raycam.viewer import bundle as bundling
from support.raises import raises

CLIENT = Path(raycam.__file__).parent / "viewer" / "client"
LONGEST_FILE = 400
ENTRIES = ["main.js", "start.js", "lecture/main.js", "explanation/main.js", "recording/main.js"]


@pytest.fixture
def altered(monkeypatch: pytest.MonkeyPatch):
    """Replaces the text of some modules."""

    def alter(texts: dict[str, str]) -> None:
        monkeypatch.setattr(bundling, "client_file", texts.__getitem__)
        for cached in (bundling.modules, bundling.bundle):
            monkeypatch.setattr(bundling, cached.__name__, cached.__wrapped__)

    return alter


def test_bundle_contains_every_module_after_its_imports() -> None:
    entries = [bundling.modules(entry) for entry in ENTRIES]
    assert {name for names in entries for name in names} == {
        path.relative_to(CLIENT).as_posix() for path in CLIENT.rglob("*.js")
    }
    for names in entries:
        for name in names:
            for _, source in bundling.IMPORT.findall(bundling.client_file(name)):
                assert names.index(bundling.beside(name, source)) < names.index(name)


@pytest.mark.parametrize("entry", ENTRIES)
def test_bundle_contains_no_imports_and_loads_nothing(entry: str) -> None:
    text = bundling.bundle(entry)
    assert not re.search(r"^\s*(?:import|export)\b", text, re.M)
    assert not re.search(
        r"https?://|\beval\b|new Function|innerHTML|insertAdjacentHTML|document\.write", text
    )


@pytest.mark.parametrize("path", sorted(CLIENT.rglob("*.*")), ids=lambda path: path.name)
def test_files_are_short_and_begin_with_a_comment(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    assert text.count("\n") <= LONGEST_FILE
    assert text.startswith(
        {".js": "// ", ".ts": "// ", ".css": "/* ", ".html": "<!doctype html>"}[path.suffix]
    )


def test_import_cycles_are_refused(altered) -> None:
    altered(
        {
            "main.js": 'import { a } from "./a.js";\n',
            "a.js": 'import { b } from "./b.js";\nexport const a = 1;\n',
            "b.js": 'import { a } from "./a.js";\nexport const b = 1;\n',
        }
    )
    with raises(ValueError, mentions=["a.js", "b.js"]):
        bundling.modules()


@pytest.mark.parametrize(
    ("main", "facts"),
    [
        ('import { a } from "./a.js";\nconst a = 1;\n', ["main.js", "a.js"]),
        ('import { A } from "./b.js";\nconst B = 2, A = 1;\n', ["main.js", "b.js"]),
        ('import { c } from "./a.js";\n', ["main.js", "a.js"]),
        ('import * as a from "./a.js";\n', ["main.js"]),
        ("export default 1;\n", ["main.js"]),
        ('const text = "</script>";\n', ["script"]),
    ],
)
def test_unsupported_import_syntax_is_refused(main: str, facts: list[str], altered) -> None:
    altered({"main.js": main, "a.js": "export const a = 1;\n", "b.js": "export const A = 1;\n"})
    with raises(ValueError, mentions=facts):
        bundling.bundle()
