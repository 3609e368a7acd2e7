"""The view loads a world again after its files change."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import raycam
from raycam.viewer.files.watch import Watcher, used_files
from raycam.viewer.session import Session
from support.patience import until

WORLD = '[[object]]\nname = "part"\nmesh = "parts/a b.obj"\nlocation = [{x}, 0, 0]\n'
MESH = "v 0 0 0\nv 1 0 0\nv 0 1 {z}\nf 1 2 3\n"


@pytest.fixture
def path(tmp_path: Path) -> Path:
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "a b.obj").write_text(MESH.format(z=0))
    (tmp_path / "parts" / "other.obj").write_text(MESH.format(z=0))
    (tmp_path / "shot.png").write_bytes(b"")
    made = tmp_path / "w.toml"
    made.write_text(WORLD.format(x=0))
    return made


def change(path: Path, text: str) -> None:
    """Writes a file as editors do: a new file that replaces the old one."""
    new = path.with_suffix(".new")
    new.write_text(text)
    os.replace(new, path)


def test_watched_files_are_the_files_named_in_the_world(path: Path) -> None:
    assert used_files(path) == sorted([path, path.parent / "parts" / "a b.obj"])


def test_watched_files_include_indirect_files_and_files_in_urls(tmp_path: Path) -> None:
    (tmp_path / "m.obj").write_text("mtllib m.mtl\n")
    (tmp_path / "m.mtl").write_text("newmtl a\nmap_Kd red.png\n")
    (tmp_path / "red.png").write_bytes(b"")
    (tmp_path / "g.gltf").write_text('{"buffers": [{"uri": "my%20data.bin"}]}')
    (tmp_path / "my data.bin").write_bytes(b"")
    assert {each.name for each in used_files(tmp_path / "m.obj")} == {"m.obj", "m.mtl", "red.png"}
    assert {each.name for each in used_files(tmp_path / "g.gltf")} == {"g.gltf", "my data.bin"}


def test_watcher_reports_complete_changes_of_used_files_only(path: Path) -> None:
    seen: list[str] = []
    watcher = Watcher(path, lambda: seen.append(path.read_text()))
    watcher.start()
    try:
        (path.parent / "shot.png").write_bytes(b"an image that was rendered next to the world")
        change(path, WORLD.format(x=1))
        until(lambda: seen == [WORLD.format(x=1)])
        change(path.parent / "parts" / "a b.obj", MESH.format(z=5))
        until(lambda: len(seen) == 2)
        path.unlink()
        change(path, WORLD.format(x=2))
        until(lambda: len(seen) == 3)
    finally:
        watcher.end()
    assert not watcher.is_alive()


@pytest.fixture
def viewer(path: Path) -> Iterator[raycam.Viewer]:
    with raycam.view(path, watch=True, browser=False, block=False, port=0) as made:
        yield made


def test_changed_world_is_shown_and_the_camera_stays(viewer: raycam.Viewer, path: Path) -> None:
    camera = viewer.camera
    change(path, WORLD.format(x=3))
    until(lambda: viewer.world.objects[0].matrix[0][3] == 3)
    assert viewer.camera == camera
    change(path.parent / "parts" / "a b.obj", MESH.format(z=5))
    until(lambda: viewer.world.bounds[1, 2] == 5)


def test_error_in_the_changed_file_is_shown_and_the_old_world_stays(
    viewer: raycam.Viewer, path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    told: list[str] = []
    monkeypatch.setattr(Session, "complain", lambda session, text: told.append(text))
    before = viewer.world
    change(path, "[[object]\n")
    until(lambda: told)
    assert "w.toml" in told[0]
    assert viewer.world.to_bytes() == before.to_bytes()
    change(path, WORLD.format(x=4))
    until(lambda: viewer.world.objects[0].matrix[0][3] == 4)


def test_discarded_edits_are_restored_by_undo(viewer: raycam.Viewer, path: Path) -> None:
    edits = viewer._edits
    edits.edit("object", 0, "move", [0, 0, 7])
    edits.edit("object", 0, "move", [0, 0, 1])
    change(path, WORLD.format(x=5))
    until(lambda: viewer.world.objects[0].matrix[0][3] == 5)
    edits.undo()
    np.testing.assert_array_equal(np.array(viewer.world.objects[0].matrix)[:3, 3], [0, 0, 8])


def test_named_camera_follows_the_file(path: Path) -> None:
    camera = "[[camera]]\nname = 'c'\nlocation = [{x}, -5, 1]\ntarget = [0, 0, 0]\nsize = [8, 8]\nfov = 40\n"
    path.write_text(WORLD.format(x=0) + camera.format(x=0))
    with raycam.view(path, watch=True, browser=False, block=False, port=0) as viewer:
        change(path, WORLD.format(x=0) + camera.format(x=2))
        until(lambda: viewer.camera.location[0] == 2)
        view = viewer._first.view.at_home()
        assert (view.camera_name, view.camera.location[0]) == ("c", 2)


def test_watch_requires_a_path(path: Path) -> None:
    with pytest.raises(raycam.SettingsError) as found:
        raycam.view(raycam.load(path), watch=True, browser=False, block=False)
    assert found.value.code == "conflicting_values"
