"""Worlds in folders and archives, and several models in one world."""

from __future__ import annotations

import warnings
import zipfile
from pathlib import Path

import numpy as np
import pytest
import raycam
from raycam.viewer.files import sources
from raycam.viewer.files.sources import combine_models, find_world
from support.raises import raises

TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 0 2\nf 1 2 3\n"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "models").mkdir()
    for name in ("a.obj", "models/b.obj"):
        (tmp_path / name).write_text(TRIANGLE)
    (tmp_path / "LICENSE").write_text("free")
    return tmp_path


def test_file_is_opened_as_a_world(folder: Path) -> None:
    assert find_world(folder / "a.obj", folder) == (folder / "a.obj", None)


def test_folder_shows_the_world_nearest_to_the_top(folder: Path) -> None:
    assert find_world(folder, folder)[0] == folder / "a.obj"
    (folder / "w.toml").write_text('[[object]]\nmesh = "models/b.obj"\n')
    path, root = find_world(folder, folder)
    assert path == folder / "w.toml"
    assert raycam.load(path, folder=root).counts["triangles"] == 1


def test_folder_with_several_worlds_gives_a_notice(folder: Path) -> None:
    (folder / "c.obj").write_text(TRIANGLE)
    with pytest.warns(raycam.Notice) as found:
        assert find_world(folder, folder)[0] == folder / "a.obj"
    (notice,) = (each.message for each in found)
    assert notice.code == "chosen_world"
    assert "c.obj" in str(notice)
    assert "b.obj" not in str(notice)


def test_folder_without_world_is_refused(tmp_path: Path) -> None:
    with pytest.raises(raycam.SettingsError) as found:
        find_world(tmp_path, tmp_path)
    assert found.value.code == "missing_value"


def test_photograph_instead_of_a_model_is_refused_with_the_options_for_photographs(tmp_path: Path) -> None:
    (tmp_path / "IMG_1.JPG").write_bytes(b"")
    with raises(raycam.SettingsError, code="wrong_type", mentions=["IMG_1.JPG", "--photos", "photos="]):
        find_world(tmp_path / "IMG_1.JPG", tmp_path)


def test_archive_is_unpacked_with_its_folders(folder: Path, tmp_path: Path) -> None:
    with zipfile.ZipFile(folder / "z.zip", "w") as archive:
        archive.writestr("scene/w.toml", '[[object]]\nmesh = "parts/b.obj"\n')
        archive.writestr("scene/parts/b.obj", TRIANGLE)
        archive.writestr("scene/readme.md", "text")
    path, root = find_world(folder / "z.zip", tmp_path / "unpacked")
    assert raycam.load(path, folder=root).counts["triangles"] == 1
    assert not list((tmp_path / "unpacked").rglob("readme.md"))


@pytest.mark.parametrize("name", ["../out.obj", "/out.obj", "a/../../out.obj"])
def test_archive_writes_nothing_outside_its_folder(tmp_path: Path, name: str) -> None:
    with zipfile.ZipFile(tmp_path / "z.zip", "w") as archive:
        archive.writestr(name, TRIANGLE)
    with pytest.raises(raycam.SettingsError):
        find_world(tmp_path / "z.zip", tmp_path / "in")
    assert not list(tmp_path.rglob("out.obj"))


def test_archive_beyond_the_limit_is_refused_before_it_is_unpacked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sources, "MAX_ARCHIVE_BYTES", 1 << 20)
    with zipfile.ZipFile(tmp_path / "z.zip", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("a.obj", TRIANGLE)
        archive.writestr("b.obj", bytes(2 << 20))
    with pytest.raises(raycam.SettingsError) as found:
        find_world(tmp_path / "z.zip", tmp_path / "in")
    assert found.value.code == "too_large"
    assert not list(tmp_path.glob("in/**/*.obj"))


def test_models_keep_their_coordinates(folder: Path) -> None:
    world = combine_models([folder / "a.obj", folder / "models/b.obj"])
    assert world.up == "y"
    assert [each.name for each in world.objects] == ["a", "b"]
    np.testing.assert_array_equal(world.bounds, [[0, 0, 0], [1, 0, 2]])


def test_models_with_the_same_name_are_numbered(folder: Path) -> None:
    (folder / "models/a.obj").write_text(TRIANGLE)
    world = combine_models([folder / "a.obj", folder / "models/a.obj"])
    assert [each.name for each in world.objects] == ["a", "a 2"]


def test_y_up_models_are_rotated_next_to_z_up_models(folder: Path) -> None:
    (folder / "c.stl").write_text(
        "solid c\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n"
        "endloop\nendfacet\nendsolid c\n"
    )
    world = combine_models([folder / "a.obj", folder / "c.stl"])
    assert world.up == "z"
    np.testing.assert_allclose(world.triangles(0)[0], [[0, 0, 0], [1, 0, 0], [0, -2, 0]], atol=1e-12)
    np.testing.assert_array_equal(world.triangles(1)[0], [[0, 0, 0], [1, 0, 0], [0, 1, 0]])


def test_world_files_cannot_be_combined(folder: Path) -> None:
    (folder / "w.toml").write_text('[[object]]\nmesh = "a.obj"\n')
    with pytest.raises(raycam.SettingsError) as found:
        combine_models([folder / "a.obj", folder / "w.toml"])
    assert found.value.code == "conflicting_values"


def test_hidden_files_of_macos_archives_are_ignored(folder: Path) -> None:
    with zipfile.ZipFile(folder / "mac.zip", "w") as archive:
        for name in ("__MACOSX/._cat.obj", "._cat.obj", "cat.obj"):
            archive.writestr(name, TRIANGLE if name == "cat.obj" else "\0\5\x16\7")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with raycam.view(folder / "mac.zip", browser=False, block=False, port=0) as viewer:
            assert viewer.world.counts["objects"] == 1


def test_view_opens_folders_archives_and_lists(folder: Path) -> None:
    with zipfile.ZipFile(folder / "z.zip", "w") as archive:
        archive.writestr("b.obj", TRIANGLE)
    for what, count in ((folder / "models", 1), (folder / "z.zip", 1), ([folder / "a.obj"] * 2, 2)):
        with raycam.view(what, browser=False, block=False, port=0) as viewer:
            assert viewer.world.counts["objects"] == count
            assert viewer.world.up == "y"  # all of them are OBJ files
