"""Imports have no cycles and follow the order of folders in `layout.py`."""

from __future__ import annotations

from pathlib import Path

import pytest
from rules import graph, layout, python_imports, rust_facts
from rules.source import CRATES

ROOT = Path(__file__).resolve().parents[2]


def imports_of(part: str) -> graph.Arrows:
    return (
        python_imports.arrows(ROOT / "python" / "raycam")
        if part == "python"
        else rust_facts.imports(ROOT, part)
    )


@pytest.mark.parametrize("part", [*CRATES, "python"])
def test_files_import_each_other_without_cycles(part: str) -> None:
    assert graph.circles(imports_of(part)) == []


@pytest.mark.parametrize("part", [*CRATES, "python"])
def test_folders_import_only_folders_before_them(part: str) -> None:
    assert graph.upward_arrows(imports_of(part), layout.order_of(part)) == []


@pytest.mark.parametrize("part", [*CRATES, "python"])
def test_every_entry_of_the_folder_order_has_files(part: str) -> None:
    order = layout.order_of(part)
    used = {order[index] for name in imports_of(part) if (index := graph.place_of(name, order)) is not None}
    assert sorted(set(order) - used) == []


def write(folder: Path, files: dict[str, str]) -> Path:
    for name, text in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    return folder


RUST_ARROWS = {
    "use of a type": ("use crate::b::B;", {"b/mod.rs"}),
    "grouped use": ("use crate::b::{self, c::{C, D}};", {"b/c.rs"}),
    "use by another name": ("use crate::b::c::C as Other;", {"b/c.rs"}),
    "path in the code": ("fn f() { crate::b::c::make(1) }", {"b/c.rs"}),
    "path through an imported module": ("use crate::b::c; fn f() { c::make(1) }", {"b/c.rs"}),
    "super": ("use super::b::B;", {"b/mod.rs"}),
    "re-export": ("use crate::b::Shown;", {"b/c.rs"}),
    "re-export by a glob": ("use crate::b::Starred;", {"b/d.rs"}),
    "glob": ("use crate::b::c::*; fn f() -> C { make(1) }", {"b/c.rs"}),
    "made by a macro": ("use crate::b::kernel;", {"b/mod.rs"}),
    "associated item": ("fn f() { crate::b::B::new() }", {"b/mod.rs"}),
    "module alone": ("use crate::b;", set()),
    "own re-export": ("pub use crate::b::B;", set()),
    "own re-export that is used": ("pub use crate::b::B; fn f(b: B) {}", {"b/mod.rs"}),
    "other crate": ("use glam::Vec3; use std::mem;", set()),
    "visibility": ("pub(in crate::b) fn f() {}", set()),
    "only for tests": ("#[cfg(test)]\nmod tests { use crate::b::B; }", set()),
    "comment": ("// use crate::b::B;\n", set()),
}


@pytest.mark.parametrize("kind", RUST_ARROWS)
def test_imports_of_rust_file_are_found(kind: str, tmp_path: Path) -> None:
    text, expected = RUST_ARROWS[kind]
    write(
        tmp_path / "crates" / "a" / "src",
        {
            "lib.rs": "mod a;\nmod b;\n",
            "a.rs": text,
            "b/mod.rs": "mod c;\nmod d;\npub use c::Shown;\npub use d::*;\npub struct B;\nmake_kernel!(kernel);\n",
            "b/c.rs": "pub struct C; pub struct D; pub struct Shown; pub fn make(i: u8) -> C { C }\n",
            "b/d.rs": "pub enum Starred { A }\n",
        },
    )
    assert rust_facts.imports(tmp_path, "a")["a.rs"] == expected


PYTHON_ARROWS = {
    "class of a package": ("from .b import B", {"b/__init__.py"}),
    "handed on by a package": ("from .b import Shown", {"b/c.py"}),
    "module of a package": ("from .b import c", {"b/c.py"}),
    "module": ("from . import d", {"d.py"}),
    "absolute": ("from raycam.b.c import C", {"b/c.py"}),
    "inside a function": ("def f():\n    from .d import g\n", {"d.py"}),
    "only for types": ("if TYPE_CHECKING:\n    from .d import g\n", {"d.py"}),
    "the core": ("from . import _core", set()),
    "other package": ("import numpy as np", set()),
}


@pytest.mark.parametrize("kind", PYTHON_ARROWS)
def test_imports_of_python_file_are_found(kind: str, tmp_path: Path) -> None:
    text, expected = PYTHON_ARROWS[kind]
    package = write(
        tmp_path / "raycam",
        {
            "__init__.py": "from .b import B\n",
            "_core.pyi": "",
            "a.py": text,
            "b/__init__.py": "from .c import Shown\nclass B: ...\n",
            "b/c.py": "class C: ...\nclass Shown: ...\n",
            "d.py": "def g(): ...\n",
        },
    )
    assert python_imports.arrows(package)["a.py"] == expected


DELEGATING_IMPORTS = {
    "inside a method": (
        "class Rig:\n    def render(self):\n        from ..world.world import World\n",
        set(),
    ),
    "only for types": ("if TYPE_CHECKING:\n    from ..world.world import World\n", set()),
    "at the top": ("from ..world.world import World\n", {"world/world.py"}),
    "of another file": ("def f():\n    from ..world.load import load\n", {"world/load.py"}),
}


@pytest.mark.parametrize("kind", DELEGATING_IMPORTS)
def test_delegating_imports_do_not_count_inside_methods(kind: str, tmp_path: Path) -> None:
    text, expected = DELEGATING_IMPORTS[kind]
    files = {
        "__init__.py": "",
        "rig/__init__.py": "",
        "rig/rig.py": text,
        "world/__init__.py": "",
        "world/world.py": "class World: ...\n",
        "world/load.py": "def load(): ...\n",
    }
    assert python_imports.arrows(write(tmp_path / "raycam", files))["rig/rig.py"] == expected


def test_listed_delegations_exist_in_the_code() -> None:
    package = ROOT / "python" / "raycam"
    for name, targets in layout.DELEGATIONS.items():
        nodes = python_imports.all_imports(package / name)
        assert targets <= python_imports.files_of(package, package / name, nodes), name


def test_re_exporting_package_is_not_part_of_a_cycle(tmp_path: Path) -> None:
    files = {
        "__init__.py": "",
        "b/__init__.py": "from .c import C\n",
        "b/c.py": "from . import d\n",
        "b/d.py": "",
    }
    assert graph.circles(python_imports.arrows(write(tmp_path / "raycam", files))) == []


def test_cycles_are_found() -> None:
    arrows = {"a": {"b"}, "b": {"c"}, "c": {"a"}, "d": {"a", "e"}, "e": {"d"}, "f": {"a"}, "g": set()}
    assert graph.circles(arrows) == [["a", "b", "c"], ["d", "e"]]


def test_upward_import_is_reported() -> None:
    arrows = {
        "a/mod.rs": {"b/x.rs"},
        "b/x.rs": {"a/mod.rs"},
        "b/y.rs": {"c.rs"},
        "c.rs": set(),
        "d.rs": set(),
    }
    assert graph.upward_arrows(arrows, ["a", "b", "c"]) == [
        "d.rs has no place in the order of folders",
        "a/mod.rs imports b/x.rs: a stands below b",
        "b/y.rs imports c.rs: b stands below c",
    ]


def test_file_belongs_to_the_most_specific_entry_of_the_order() -> None:
    order = ["scene", "traverse/mod", "traverse", "scene/query"]
    places = {
        name: graph.place_of(name, order)
        for name in ("scene/mod.rs", "scene/query.rs", "traverse/mod.rs", "traverse/packet/soa.rs", "lib.rs")
    }
    assert list(places.values()) == [0, 3, 1, 2, None]
