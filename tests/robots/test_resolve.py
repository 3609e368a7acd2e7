"""Files that a robot names: package://, file:// and relative names, within root folders."""

from __future__ import annotations

from pathlib import Path

import pytest
import raycam
from raycam.robots import FileResolver, Missing, find_root
from support.raises import raises


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    """A workspace with two packages and a file outside of them."""
    for name in (
        "ws/one/urdf/r.urdf",
        "ws/one/meshes/A b.stl",
        "ws/two/meshes/c.stl",
        "far/three/d.stl",
        "secret.stl",
    ):
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("x", encoding="utf-8")
    (tmp_path / "ws/one/package.xml").write_text("<package/>", encoding="utf-8")
    return tmp_path


def resolver(tree: Path, **options: object) -> FileResolver:
    return FileResolver(tree / "ws/one/urdf/r.urdf", **options)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("package://one/meshes/A b.stl", "ws/one/meshes/A b.stl"),
        ("package://one/meshes/A%20b.stl", "ws/one/meshes/A b.stl"),
        ("package:///one/meshes/A b.stl", "ws/one/meshes/A b.stl"),
        ("model://one/meshes/A b.stl", "ws/one/meshes/A b.stl"),
        ("../meshes/A b.stl", "ws/one/meshes/A b.stl"),
        ("..\\meshes\\A b.stl", "ws/one/meshes/A b.stl"),
        ("package://two/meshes/c.stl", "ws/two/meshes/c.stl"),
    ],
)
def test_package_and_relative_names_are_resolved_to_files(tree: Path, name: str, expected: str) -> None:
    assert resolver(tree).find(name) == tree / expected


def test_file_urls_are_resolved_inside_the_root(tree: Path) -> None:
    assert resolver(tree).find(f"file://{tree}/ws/one/meshes/A b.stl") == tree / "ws/one/meshes/A b.stl"
    with raises(Missing, mentions=[tree / "secret.stl", "folder="]):
        resolver(tree).find(f"file://{tree}/secret.stl")


def test_file_name_of_another_case_is_found_with_a_notice(tree: Path) -> None:
    files = resolver(tree)
    assert files.find("package://one/Meshes/a B.STL") == tree / "ws/one/meshes/A b.stl"
    assert len(files.notices) == 1
    assert "A b.stl" in str(files.notices[0])


def test_packages_are_searched_in_given_folders(tree: Path) -> None:
    with raises(Missing, mentions=["'three'"]):
        resolver(tree).find("package://three/d.stl")
    assert resolver(tree, packages=[tree / "far"]).find("package://three/d.stl") == tree / "far/three/d.stl"


@pytest.mark.parametrize(
    "name",
    [
        "../../../secret.stl",
        "package://one/../../secret.stl",
        "package://../secret.stl",
        "http://x/a.stl",
        "none.stl",
    ],
)
def test_files_outside_of_the_roots_are_refused(tree: Path, name: str) -> None:
    with pytest.raises(Missing):
        resolver(tree).find(name)


def test_symbolic_links_that_leave_the_root_are_refused(tree: Path) -> None:
    (tree / "ws/one/meshes/link.stl").symlink_to(tree / "secret.stl")
    with raises(Missing, mentions=["link.stl", "folder="]):
        resolver(tree).find("package://one/meshes/link.stl")


def test_folder_argument_confines_packages(tree: Path) -> None:
    with pytest.raises(Missing):
        resolver(tree, folder=tree / "ws/one").find("package://two/meshes/c.stl")
    assert (
        resolver(tree, folder=tree / "ws").find("package://two/meshes/c.stl") == tree / "ws/two/meshes/c.stl"
    )
    with raises(raycam.SettingsError, code="outside_root", mentions=["far"]):
        resolver(tree, folder=tree / "ws", packages=[tree / "far"])


def test_root_is_the_package_or_the_folder_above_urdf(tree: Path) -> None:
    assert find_root(tree / "ws/one/urdf") == tree / "ws/one"
    assert find_root(tree / "ws/two/urdf") == tree / "ws/two"
    assert find_root(tree / "ws/two/meshes") == tree / "ws/two/meshes"
