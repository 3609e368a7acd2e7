"""Boundaries: which crates, languages and packages may use each other."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from rules import boundaries
from rules.source import CRATES

ROOT = Path(__file__).resolve().parents[2]
RULES: list[Callable[[Path], list[str]]] = [
    boundaries.unlisted_crates,
    boundaries.forbidden_dependencies,
    boundaries.forbidden_uses,
    boundaries.unsafe_outside_bvh,
    boundaries.python_outside_bindings,
    boundaries.shared_code_of_reference,
    boundaries.unknown_python_packages,
    boundaries.undeclared_python_packages,
    boundaries.compat_that_reaches_in,
]


@pytest.fixture
def broken_tree(tmp_path: Path) -> Path:
    """A source tree that breaks every rule once."""

    def write(name: str, text: str) -> None:
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")

    for crate in CRATES:
        write(f"crates/{crate}/Cargo.toml", f'[package]\nname = "raycam-{crate}"\n')
        write(f"crates/{crate}/src/lib.rs", "#![forbid(unsafe_code)]\n")
    write("crates/extra/Cargo.toml", "[package]\n")
    manifest = "[target.x.dev-dependencies]\nraycam-scene = {}\n[dependencies]\npyo3 = {}\n"
    write("crates/bvh/Cargo.toml", manifest)
    write("crates/scene/src/lib.rs", "pub fn f() { unsafe { g() } }\n")
    write("crates/formats/src/obj.rs", 'use raycam_render::Frame;\ninclude!("../../scene/src/lib.rs");\n')
    write("python/raycam/__init__.py", "import pandas\nimport rich\n")
    write(
        "python/raycam/reference/__init__.py", '"""Text."""\nfrom .. import _core\nfrom raycam import world\n'
    )
    manifest = '[project]\ndependencies = ["numpy"]\n[project.optional-dependencies]\n[dependency-groups]\ntest = []\n'
    write("pyproject.toml", manifest)
    write("tests/architecture/test_a.py", "import numpy\nimport pygments\n")
    write("python/raycam/compat/other.py", "from raycam.world import World\n")
    return tmp_path


@pytest.mark.parametrize("rule", RULES)
def test_source_obeys_the_boundary_rule(rule: Callable[[Path], list[str]]) -> None:
    assert rule(ROOT) == []


@pytest.mark.parametrize("rule", RULES)
def test_boundary_rule_reports_broken_tree(rule: Callable[[Path], list[str]], broken_tree: Path) -> None:
    assert rule(broken_tree) != []


def test_words_in_comments_and_strings_are_not_uses(tmp_path: Path) -> None:
    for crate in CRATES:
        source = tmp_path / "crates" / crate / "src"
        source.mkdir(parents=True)
        (source / "lib.rs").write_text("#![forbid(unsafe_code)]\n")
    (tmp_path / "crates/scene/src/lib.rs").write_text(
        "#![forbid(unsafe_code)]\n/* unsafe raycam_bvh */ // unsafe\n"
        'const A: &str = "unsafe \\" raycam_bvh"; const B: &str = r#"unsafe " unsafe"#;\n'
    )
    assert boundaries.unsafe_outside_bvh(tmp_path) == []
    assert boundaries.forbidden_uses(tmp_path) == []
