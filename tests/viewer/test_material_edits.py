"""Materials of slots in a view: the shown values, edits of one slot or of all slots, and clicks on a slot."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raycam
from raycam.viewer.probe import values_at
from raycam.viewer.scene.contents import materials_of_object
from raycam.viewer.scene.edits import Edits
from raycam.viewer.scene.material_edits import describe_material, edit_material, list_slots
from raycam.viewer.session import Session
from support.raises import raises
from support.session_messages import receive
from support.two_materials import two_materials


def test_materials_are_changed_and_keep_their_colour(small_world: raycam.World) -> None:
    before = describe_material(small_world, 0)
    rough = edit_material(small_world, 0, None, "roughness", 0.25)
    shiny = edit_material(rough, 0, None, "metallic", 1)
    bright = edit_material(shiny, 0, None, "emission", 4)
    found = describe_material(bright, 0)
    assert (found["model"], found["roughness"], found["metallic"]) == ("principled", 0.25, 1)
    assert (found["color"], found["emission"]) == (before["color"], 4)
    assert describe_material(small_world, 0) == before
    camera = small_world.camera("front")
    seen = raycam.render(bright, camera, integrator="path", max_depth=1, samples=1)["color"]
    assert np.allclose(seen[16, 24], 4)


@pytest.mark.parametrize(
    ("kind", "roughness", "metallic"),
    [
        ({"type": "glass", "roughness": 0.1}, 0.1, 0),
        ({"type": "metal", "metal": "gold", "roughness": 0.2}, 0.2, 1),
        ({"type": "principled", "roughness": 0.3, "metallic": 0.6}, 0.3, 0.6),
        ({"color": "#404040", "specular": 0.5, "shininess": 150}, (2 / 152) ** 0.25, 0),
        ({"type": "matte"}, 1, 0),
    ],
)
def test_shown_roughness_and_metallic_equal_the_channels(
    kind: dict[str, Any], roughness: float, metallic: float
) -> None:
    world = raycam.World()
    world.add_object(box={"size": 1}, name="box", **kind)
    found = describe_material(world, 0)
    assert (found["roughness"], found["metallic"]) == pytest.approx((roughness, metallic))
    camera = raycam.Camera.look_at([4, -3, 2], [0, 0, 0], size=(9, 9), fov=20)
    frame = raycam.render(world, camera, channels=["roughness", "metallic"])
    assert [frame[key][4, 4] for key in ("roughness", "metallic")] == pytest.approx([roughness, metallic])


def test_roughness_of_glass_and_metal_keeps_the_model() -> None:
    world = raycam.World()
    world.add_object(sphere={"radius": 1}, type="glass", ior=1.7)
    world.add_object(sphere={"radius": 1}, type="metal", metal="gold")
    for number, model in enumerate(["glass", "metal"]):
        found = describe_material(edit_material(world, number, None, "roughness", 0.4), number)
        assert (found["model"], found["roughness"]) == (model, 0.4)


def test_metallic_keeps_the_shown_roughness() -> None:
    world = raycam.World()
    world.add_object(sphere={"radius": 1}, color="#404040", specular=0.5, shininess=150)
    before = describe_material(world, 0)["roughness"]
    assert describe_material(edit_material(world, 0, None, "metallic", 0.5), 0)["roughness"] == pytest.approx(
        before
    )


def test_roughness_keeps_color_and_texture_of_each_material(tmp_path: Path) -> None:
    found = materials_of_object(edit_material(two_materials(tmp_path), 0, None, "roughness", 0.5), 0)
    assert [each["color"] for each in found] == [[0.8, 0.1, 0.1], [0.1, 0.1, 0.9]]
    assert [each["model"]["Principled"]["roughness"]["value"] for each in found] == [0.5, 0.5]
    textured = raycam.World()
    textured.add_object(box={"size": 1}, texture=np.full((2, 2, 3), 128, np.uint8))
    assert describe_material(edit_material(textured, 0, None, "roughness", 0.5), 0)["textured"]


def colors(world: raycam.World) -> list[list[float]]:
    return [each["color"] for each in materials_of_object(world, 0)]


def test_edit_of_a_slot_keeps_the_other_slots_and_can_be_undone(tmp_path: Path) -> None:
    session = Session(Edits(two_materials(tmp_path)), None)
    receive(session, {"type": "select", "number": 0, "slot": 1, "tool": "outline"})
    about = session.selection.about()
    assert (about["slot"], about["slot_count"], about["material"]["linear"]) == (1, 2, [0.1, 0.1, 0.9])
    assert [(each["name"], each["textured"]) for each in about["slots"]] == [("red", False), ("blue", False)]
    edit = {"type": "edit_material", "number": 0, "slot": 1, "key": "color", "value": "#00ff00"}
    receive(session, edit)
    assert np.allclose(colors(session.view.base), [[0.8, 0.1, 0.1], [0, 1, 0]])
    assert session.selection.about()["slots"][1]["color"] == "#00ff00"
    receive(session, {**edit, "key": "metallic", "value": 0.7})
    models = [each["model"] for each in materials_of_object(session.view.base, 0)]
    assert ["Principled" in each for each in models] == [False, True]
    receive(session, {"type": "undo"})
    receive(session, {"type": "undo"})
    assert np.allclose(colors(session.view.base), [[0.8, 0.1, 0.1], [0.1, 0.1, 0.9]])


def test_edit_of_all_slots_keeps_the_model_and_other_values_of_each_slot(tmp_path: Path) -> None:
    world = two_materials(tmp_path)
    world.set_object(0, slots={"red": {"type": "glass"}, "blue": {"type": "principled", "metallic": 0.8}})
    world = edit_material(world, 0, None, "roughness", 0.4)
    found = [describe_material(world, 0, slot) for slot in range(2)]
    assert [each["model"] for each in found] == ["glass", "principled"]
    assert [each["roughness"] for each in found] == pytest.approx([0.4, 0.4])
    assert found[1]["metallic"] == pytest.approx(0.8)


def test_pixel_reports_the_slot_of_its_triangle(tmp_path: Path) -> None:
    world = two_materials(tmp_path)
    camera = world.view_from("top", size=(16, 16))
    seen = raycam.render(world, camera, channels=["triangle"], samples=1)["triangle"]
    for triangle in range(2):
        row, column = np.argwhere(seen == triangle)[0]
        values = values_at(world, camera, None, int(column), int(row), ["m"])
        assert values["material"]["slot"] == triangle


@pytest.mark.parametrize(
    ("number", "slot", "key", "value", "code"),
    [
        (0, 2, "color", "#ffffff", "index_out_of_range"),
        (1, 0, "color", "#ffffff", "index_out_of_range"),
        (1, None, "color", "#ffffff", "index_out_of_range"),
        (0, 1, "color", "no such colour", "invalid_value"),
        (0, 1, "color", 0.5, "unknown_key"),
        (0, 1, "visible", True, "unknown_key"),
        (0, 1, "roughness", 1.5, "out_of_range"),
        (0, 1, "metallic", True, "wrong_type"),
        (0, 1, "emission", -1, "out_of_range"),
    ],
)
def test_invalid_edits_of_slots_are_refused_and_change_nothing(
    tmp_path: Path, number: int, slot: int | None, key: str, value: Any, code: str
) -> None:
    edits = Edits(two_materials(tmp_path))
    before = edits.world
    with raises(raycam.Error, code=code):
        edits.edit_material(number, slot, key, value)
    assert edits.world is before


def test_only_the_first_slots_are_listed(tmp_path: Path) -> None:
    names = [f"paint{i}" for i in range(250)]
    (tmp_path / "many.mtl").write_text("".join(f"newmtl {name}\nKd 0.5 0.5 0.5\n" for name in names))
    faces = "".join(f"usemtl {name}\nf 1 2 3\n" for name in names)
    (tmp_path / "many.obj").write_text(f"mtllib many.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\n{faces}")
    world = raycam.load(tmp_path / "many.obj")
    assert [each["name"] for each in list_slots(world, 0)] == names[:200]
    assert world.objects[0].materials == tuple(names)
