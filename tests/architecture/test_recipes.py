"""Recipes in CONTRIBUTING.md.

The named paths and identifiers exist, and a recipe lists every file that must be changed for an addition.
"""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from rules import recipes

ROOT = Path(__file__).resolve().parents[2]
RECIPES = recipes.recipes(ROOT)
# Each recipe, with the enums that its new member extends.
ENUMS = {
    "A camera model": ("Lens", "LensModel"),
    "A material": ("MaterialModel", "MaterialType"),
    "A light": ("Light", "PreparedLight"),
    "A channel": ("Channel",),
    "An integrator": ("Integrator",),
}


def test_common_additions_have_a_recipe() -> None:
    others = [
        "A calibration format",
        "A file format",
        "A primitive",
        "A render option",
        "A data set format",
        "A sensor",
        "A viewer control",
        "An example",
    ]
    assert sorted(RECIPES) == sorted([*ENUMS, *others])


@pytest.mark.parametrize("title", RECIPES)
def test_paths_names_and_commands_of_recipe_exist(title: str) -> None:
    recipe = RECIPES[title]
    offences = recipes.missing_paths(ROOT, recipe)
    offences += recipes.missing_names(ROOT, recipe)
    offences += recipes.missing_commands(ROOT, recipe)
    assert offences == []


@pytest.mark.parametrize("title", RECIPES)
def test_recipe_steps_are_numbered(title: str) -> None:
    assert RECIPES[title].steps == list(range(1, len(RECIPES[title].steps) + 1)) != []


@pytest.mark.parametrize(
    ("title", "enum"), [(title, enum) for title, enums in ENUMS.items() for enum in enums]
)
def test_recipe_lists_every_file_with_exhaustive_match(title: str, enum: str) -> None:
    files = recipes.files_with_every_variant(ROOT, enum)
    assert files, f"no enum is called {enum}"
    assert sorted(set(files) - set(RECIPES[title].paths)) == []


def test_wrong_recipe_is_reported(tmp_path: Path) -> None:
    source = tmp_path / "crates/scene/src"
    source.mkdir(parents=True)
    (tmp_path / "Makefile").write_text("check:\n")
    (source / "light.rs").write_text("pub enum Light { Sun, Disk }\n")
    (source / "all.rs").write_text(
        "fn f(l: Light) -> u8 { match l { Light::Sun => { g(|x| x) } Light::Disk => 1 } }\n"
    )
    (source / "alias.rs").write_text(
        "use crate::Light as L;\nfn f(l: L) { match l { L::Sun | L::Disk => 1 } }\n"
    )
    (source / "some.rs").write_text("fn f() { match l { Light::Sun => 1, _ => 2 } }\n")
    (source / "made.rs").write_text('fn f() { match s { "sun" => Light::Sun, "d" => Light::Disk } }\n')
    (tmp_path / "CONTRIBUTING.md").write_text(
        "# How\n\n## Source tree\n\nText.\n\n## A light\n\n"
        "1. `Light` and `Lamp` in `crates/scene/src/light.rs`, `crates/scene/src/gone.rs`.\n"
        "2. Write `crates/scene/src/foo.rs` and `crates/nowhere/foo.rs`.\n"
        "   `make check`, `make tea`, `cargo test -p raycam-x`\n"
    )
    recipe = recipes.recipes(tmp_path)["A light"]
    assert recipe.steps == [1, 2]
    assert recipes.missing_paths(tmp_path, recipe) == [
        "A light: crates/scene/src/gone.rs does not exist",
        "A light: crates/nowhere/foo.rs has no folder",
    ]
    assert recipes.missing_names(tmp_path, recipe) == ["A light: none of its files names Lamp"]
    assert recipes.missing_commands(tmp_path, recipe) == [
        "A light: `make tea` does nothing here",
        "A light: `cargo test -p raycam-x` does nothing here",
    ]
    broken = recipes.files_with_every_variant(tmp_path, "Light")
    assert broken == [f"crates/scene/src/{name}.rs" for name in ("alias", "all", "light")]


def test_make_targets_in_contributing_exist() -> None:
    everything = recipes.Recipe("CONTRIBUTING.md", "".join(f"`{line}`" for line in make_lines()))
    assert recipes.missing_commands(ROOT, everything) == []


def make_lines() -> list[str]:
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    return re.findall(r"\bmake [a-z]+\b(?=`|\s+#)", text)
