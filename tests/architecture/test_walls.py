"""Who may use whom: crates, `unsafe`, Python, the oracle, third parties."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from house import walls
from house.source import CRATES, code_of, product_code_of

ROOT = Path(__file__).resolve().parents[2]
RULES: list[Callable[[Path], list[str]]] = [
    walls.strange_crates,
    walls.manifests_that_reach,
    walls.sources_that_reach,
    walls.unsafe_outside_bvh,
    walls.python_outside_bindings,
    walls.oracle_that_shares,
    walls.unknown_python_packages,
    walls.undeclared_python_packages,
    walls.compat_that_reaches_in,
]


@pytest.fixture
def broken_house(tmp_path: Path) -> Path:
    """A house where every rule is broken once."""

    def write(name: str, text: str) -> None:
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")

    for crate in CRATES:
        write(f"crates/{crate}/Cargo.toml", f'[package]\nname = "raycam-{crate}"\n')
        write(f"crates/{crate}/src/lib.rs", "#![forbid(unsafe_code)]\n")
    write("crates/kitchen/Cargo.toml", "[package]\n")
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
def test_this_house_keeps_the_rule(rule: Callable[[Path], list[str]]) -> None:
    assert rule(ROOT) == []


@pytest.mark.parametrize("rule", RULES)
def test_a_broken_house_is_noticed(rule: Callable[[Path], list[str]], broken_house: Path) -> None:
    assert rule(broken_house) != []


def test_comments_and_strings_are_not_code(tmp_path: Path) -> None:
    path = tmp_path / "a.rs"
    path.write_text(
        """// unsafe
        /* unsafe */ let a = "unsafe \\" unsafe"; let c = '"';
        let b = r#"unsafe " unsafe"#; let d: &'a str = "unsafe";
        """
    )
    assert "unsafe" not in code_of(path)
    assert "let b" in code_of(path)
    assert code_of(path).count("\n") == path.read_text().count("\n")


def test_items_for_tests_are_not_product_code(tmp_path: Path) -> None:
    path = tmp_path / "a.rs"
    path.write_text(
        "#[cfg(test)]\nuse a::{b, c};\nfn kept() -> [u8; 3] { d }\n#[cfg(test)]\nmod tests { fn f() { g } }\n"
    )
    assert "fn kept() -> [u8; 3] { d }" in product_code_of(path)
    assert not {"b", "f", "tests"} & set(product_code_of(path).split())
