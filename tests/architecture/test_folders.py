"""Folders: one imports only those before it, and one look takes in its files."""

from __future__ import annotations

from pathlib import Path

import pytest
from house import graph, layout, python_imports, rust_imports, size
from house.source import CRATES

ROOT = Path(__file__).resolve().parents[2]


def arrows_of(house: str) -> graph.Arrows:
    if house == "python":
        return python_imports.arrows(ROOT / "python" / "raycam")
    return rust_imports.arrows(ROOT / "crates" / house / "src")


@pytest.mark.parametrize("house", [*CRATES, "python"])
def test_folders_import_only_those_before_them(house: str) -> None:
    assert graph.upward_arrows(arrows_of(house), layout.order_of(house)) == []


@pytest.mark.parametrize("house", [*CRATES, "python"])
def test_the_order_has_no_place_without_files(house: str) -> None:
    order = layout.order_of(house)
    used = {order[index] for name in arrows_of(house) if (index := graph.place_of(name, order)) is not None}
    assert sorted(set(order) - used) == []


def test_folders_are_small() -> None:
    assert size.full_folders(ROOT) == []


def test_an_arrow_upwards_is_noticed() -> None:
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


def test_a_file_belongs_to_the_longest_place() -> None:
    order = ["scene", "traverse/mod", "traverse", "scene/query"]
    places = {
        name: graph.place_of(name, order)
        for name in ("scene/mod.rs", "scene/query.rs", "traverse/mod.rs", "traverse/packet/soa.rs", "lib.rs")
    }
    assert list(places.values()) == [0, 3, 1, 2, None]


def test_a_full_folder_is_noticed(tmp_path: Path) -> None:
    folder = tmp_path / "python" / "raycam"
    folder.mkdir(parents=True)
    for number in range(size.FILES_OF_FOLDER + 1):
        (folder / f"m{number}.py").write_text("")
    assert size.full_folders(tmp_path) == [
        f"python/raycam has {size.FILES_OF_FOLDER + 1} files, above {size.FILES_OF_FOLDER}"
    ]
