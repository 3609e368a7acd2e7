"""Archives are unpacked within limits and inside of their folder."""

from __future__ import annotations

import zipfile
from pathlib import Path

import pytest
import raycam
from raycam.io.archive import check_name, unpack
from support.raises import raises


def accept(name: str, size: int) -> None:
    """Accepts every file."""


def test_only_files_with_known_endings_are_unpacked(tmp_path: Path) -> None:
    with zipfile.ZipFile(tmp_path / "a.zip", "w") as archive:
        for name in ("in/a.DAE", "b.png", "c.exe", "folder/"):
            archive.writestr(name, b"text")
    found = unpack(tmp_path / "a.zip", tmp_path / "out", accept, (".dae", ".png"))
    assert found == ["in/a.DAE", "b.png"]
    assert sorted(path.name for path in (tmp_path / "out").rglob("*.*")) == ["a.DAE", "b.png"]


@pytest.mark.parametrize(
    "name", ["../a.dae", "/a.dae", "C:a.dae", "a/../../b.dae", "a\nb.dae", "a/" * 20 + "b.dae"]
)
def test_names_that_could_leave_the_folder_raise(tmp_path: Path, name: str) -> None:
    with raises(raycam.SettingsError, code="invalid_value"):
        check_name(name)
    with zipfile.ZipFile(tmp_path / "a.zip", "w") as archive:
        archive.writestr(name, b"text")
    with raises(raycam.SettingsError, code="invalid_value"):
        unpack(tmp_path / "a.zip", tmp_path / "out", accept, (".dae",))
    assert not (tmp_path / "out").exists()


def test_damaged_archives_raise(tmp_path: Path) -> None:
    (tmp_path / "a.zip").write_bytes(b"PK\x03\x04 and more")
    with raises(raycam.SettingsError, code="file_unreadable", mentions=["a.zip"]):
        unpack(tmp_path / "a.zip", tmp_path / "out", accept, (".dae",))
