"""World files saved from an edited view: they render the same image."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raycam
from raycam.viewer.scene.contents import materials_of_object
from raycam.viewer.scene.edits import edited
from raycam.viewer.scene.material_edits import describe_material, edit_material
from raycam.viewer.scene.world_file import toml_text, world_file
from support.raises import Fault, fault, raises
from support.two_materials import two_materials

ROOM = """
up = "z"
[render]
integrator = "direct"
[camera]
size = [48, 32]
fov = 40
location = [4, -3, 2]
yaw = 143
pitch = 20
[[object]]
name = "box"
box = { size = 1 }
yaw = 10
color = "#c83c28"
[[object]]
name = "ball \\"é\\""
mesh = "ball.ply"
location = [1, 1, 0]
type = "principled"
metallic = 0.2
[[light]]
type = "sun"
direction = [-1, 1, -2]
irradiance = [3, 3, 3]
[[light]]
type = "sky"
zenith = [0.2, 0.3, 0.5]
horizon = [0.5, 0.5, 0.5]
"""
BALL = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement face 4\n"
BALL += "property list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n"
BALL += "3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n"
EDITS: list[list[tuple[str, int, str, Any]]] = [
    [],
    [("object", 0, "move", [0.3, 0.1, 0.2]), ("object", 0, "turn", 30.0)],
    [("object", 1, "scale", 1.7), ("material", 1, "color", "#20a040"), ("object", 0, "visible", False)],
    [("material", 0, "roughness", 0.2), ("material", 0, "metallic", 0.9), ("material", 1, "emission", 2.5)],
    [("light", 0, "strength", 0.25), ("light", 1, "strength", 3.0)],
]


def changed(world: raycam.World, kind: str, number: int, key: str, value: Any) -> raycam.World:
    if kind == "material":
        return edit_material(world, number, None, key, value)
    return edited(world, kind, number, key, value)


@pytest.fixture
def room(tmp_path: Path) -> Path:
    (tmp_path / "ball.ply").write_text(BALL)
    (tmp_path / "room.toml").write_text(ROOM, encoding="utf-8")
    return tmp_path / "room.toml"


@pytest.mark.parametrize("key", ["roughness", "metallic"])
def test_saved_world_file_keeps_edited_glass_and_metal(tmp_path: Path, key: str) -> None:
    path = tmp_path / "room.toml"
    objects = ['type = "glass"\nior = 1.7', 'type = "metal"\nmetal = "gold"']
    path.write_text("".join(f"[[object]]\nsphere = {{ radius = 1 }}\n{each}\n" for each in objects))
    opened = raycam.load(path)
    world = edit_material(edit_material(opened, 0, None, key, 0.4), 1, None, key, 0.4)
    camera = raycam.Camera.look_at([4, -3, 2], [0, 0, 0], size=(8, 6), fov=40)
    (tmp_path / "changed.toml").write_text(world_file(path, opened, world, camera))
    again = raycam.load(tmp_path / "changed.toml")
    assert [again._core.material(i, 0) for i in range(2)] == [world._core.material(i, 0) for i in range(2)]


@pytest.mark.parametrize("number", range(len(EDITS)))
def test_saved_world_file_renders_the_same_image(room: Path, number: int) -> None:
    opened = raycam.load(room)
    world = opened
    for edit in EDITS[number]:
        world = changed(world, *edit)
    camera = raycam.Camera.look_at([3.5, -3, 2.5], [0, 0, 0], size=(40, 30), focal=45)
    (room.parent / "changed.toml").write_text(world_file(room, opened, world, camera), encoding="utf-8")
    again = raycam.load(room.parent / "changed.toml")
    settings: dict[str, Any] = {"samples": 2, "channels": ["color", "depth"]}
    wanted = raycam.render(world, camera, **settings)
    found = raycam.render(again, **settings)
    assert np.allclose(found["color"], wanted["color"], rtol=1e-4, atol=1e-6)
    assert np.allclose(found["depth"], wanted["depth"])
    assert again.render_settings == opened.render_settings
    assert list(again.cameras)[1:] == list(opened.cameras)


def test_edited_mesh_file_is_saved_as_a_world_file(room: Path) -> None:
    source = room.parent / "ball.ply"
    opened = raycam.load(source)
    world = edit_material(opened, 0, None, "color", "#ff0000")
    camera = opened.default_camera()
    document = tomllib.loads(world_file(source, opened, world, camera))
    assert document["object"][0]["mesh"] == "ball.ply"


@pytest.mark.parametrize(
    "table", ["", "[object.slots.blue]\nopacity = 0.5\n", "[object.slots.1]\nopacity = 0.5\n"]
)
def test_edited_slots_are_saved_in_world_files_and_glb(tmp_path: Path, table: str) -> None:
    two_materials(tmp_path)
    source = tmp_path / "square.toml"
    source.write_text(f'[[object]]\nmesh = "m.obj"\n{table}')
    opened = raycam.load(source)
    world = edit_material(edit_material(opened, 0, 1, "color", "#00ff00"), 0, 1, "roughness", 0.25)
    (tmp_path / "saved.toml").write_text(world_file(source, opened, world, opened.default_camera()))
    world.to_gltf(tmp_path / "saved.glb")
    for saved in ("saved.toml", "saved.glb"):
        again = raycam.load(tmp_path / saved)
        found = [describe_material(again, 0, slot) for slot in range(2)]
        assert np.allclose([each["linear"] for each in found], [[0.8, 0.1, 0.1], [0, 1, 0]], atol=1e-6)
        assert found[1]["roughness"] == pytest.approx(0.25)
        assert again.objects[0].materials == ("red", "blue")


@pytest.mark.parametrize(
    ("names", "table"),
    [
        (("kit", "kit"), "[object.slots.kit]\nopacity = 0.5\n"),  # the table belongs to both slots
        (("1", "0"), "[object.slots.1]\nopacity = 0.5\n"),  # the table belongs to the slot 1, named "0"
        (("7", "0"), "[object.slots.7]\nopacity = 0.5\n"),  # no slot has the number 7
    ],
)
def test_edited_slot_is_saved_with_any_material_names(
    tmp_path: Path, names: tuple[str, str], table: str
) -> None:
    two_materials(tmp_path).to_gltf(tmp_path / "m.glb")
    data = (tmp_path / "m.glb").read_bytes()
    for old, new in zip(("red", "blue"), names, strict=True):
        data = data.replace(b'"%s"' % old.encode(), (b'"%s"' % new.encode()).ljust(len(old) + 2))
    (tmp_path / "m.glb").write_bytes(data)
    source = tmp_path / "square.toml"
    source.write_text(f'[[object]]\nmesh = "m.glb"\n{table}')
    opened = raycam.load(source)
    assert opened.objects[0].materials == names
    world = edit_material(opened, 0, 0, "color", "#00ff00")
    (tmp_path / "saved.toml").write_text(world_file(source, opened, world, opened.default_camera()))
    again = raycam.load(tmp_path / "saved.toml")
    for key in ("color", "opacity"):
        saved, shown = ([each[key] for each in materials_of_object(found, 0)] for found in (again, world))
        assert np.allclose(saved, shown, atol=1e-6)


def test_edited_slot_of_an_object_with_one_material_is_saved(tmp_path: Path) -> None:
    source = tmp_path / "box.toml"
    source.write_text("[[object]]\nbox = { size = 1 }\nslots = { 0 = { color = [1, 0, 0] } }\n")
    opened = raycam.load(source)
    world = edit_material(opened, 0, 0, "color", "#00ff00")
    (tmp_path / "saved.toml").write_text(world_file(source, opened, world, opened.default_camera()))
    assert describe_material(raycam.load(tmp_path / "saved.toml"), 0)["color"] == "#00ff00"


def test_edits_without_a_world_file_equivalent_are_refused(room: Path, small_world: raycam.World) -> None:
    camera = small_world.camera("front")
    with raises(raycam.WorldError, code="cannot_write", mentions=["GLB"]):
        world_file(None, small_world, small_world, camera)
    opened = raycam.load(room)
    several = room.parent / "several.obj"
    several.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\no a\nf 1 2 3\no b\nf 1 3 2\n")
    pair = raycam.load(several)
    if len(pair.objects) > 1:
        with raises(raycam.WorldError, code="cannot_write", mentions=["several"]):
            world_file(several, pair, edited(pair, "object", 1, "turn", 5.0), camera)
    moved = opened.copy()
    moved.remove_object(1)
    with raises(raycam.WorldError, code="cannot_write", mentions=["1", "2"]):
        world_file(room, opened, moved, camera)


def test_written_toml_is_read_back() -> None:
    document = {
        "up": "z",
        "a b": 1,
        "camera": [{"name": 'x"\\é\n', "K": [[1.5, 0.0], [1e-7, -2.0]], "flag": True}],
        "object": [{"box": {"size": [1, 2, 3]}}, {"name": "two"}],
        "video": {"fps": 24, "orbit": {"target": [0.0, 0.0, 1.0]}},
    }
    assert tomllib.loads(toml_text(document)) == document


@pytest.mark.parametrize(
    ("name", "text", "told"),
    [
        ("room.toml", None, fault("file_unreadable", "room.toml")),
        ("room.toml", "x = [\n", fault("file_unreadable", "room.toml")),
        ("room.toml", ROOM.replace("size = 1 ", "size = 2 "), fault("changed_file", "room.toml")),
        ("ball.ply", BALL.replace("\n1 0 0", "\n3 0 0"), fault("changed_file", "room.toml")),
    ],
)
def test_changed_source_file_is_reported(room: Path, name: str, text: str | None, told: Fault) -> None:
    opened = raycam.load(room)
    path = room.parent / name
    path.unlink()
    if text is not None:
        path.write_text(text, encoding="utf-8")
    with raises(raycam.WorldError, **told):
        world_file(room, opened, opened, opened.default_camera())
