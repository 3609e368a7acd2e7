"""Edits and undo."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raycam
from raycam.viewer.scene.edits import Edits, edited, material
from raycam.viewer.session import Session
from support.raises import raises
from support.session_messages import receive


def test_objects_are_hidden_colored_and_placed(small_world: raycam.World) -> None:
    hidden = edited(small_world, "object", 0, "visible", False)
    assert [each.visible for each in hidden.objects] == [False, True]
    moved = edited(small_world, "object", 0, "move", [1, 2, 3])
    assert np.allclose(moved.objects[0].matrix[:3, 3] - small_world.objects[0].matrix[:3, 3], [1, 2, 3])
    turned = edited(moved, "object", 0, "turn", 90)
    assert np.allclose(turned.objects[0].matrix[:3, :3], [[0, -1, 0], [1, 0, 0], [0, 0, 1]])
    assert np.allclose(turned.objects[0].matrix[:3, 3], [1, 2, 3])
    scaled = edited(turned, "object", 0, "scale", 2)
    assert np.allclose(scaled.objects[0].matrix[:3, :3], [[0, -2, 0], [2, 0, 0], [0, 0, 2]])
    camera = small_world.camera("front")
    blue = raycam.render(
        edited(small_world, "object", 0, "color", "#0000ff"), camera, channels=["albedo", "instance"]
    )
    assert blue["albedo"][blue["instance"] == 0].max(axis=0).tolist() == [0, 0, 1]
    assert all(each.visible for each in small_world.objects)


@pytest.mark.parametrize(
    "light",
    [
        {"type": "sun", "direction": [0, 0, -1], "irradiance": 2},
        {"type": "point", "position": [0, 0, 3], "power": 40},
        {"type": "sky", "radiance": [0.5, 0.25, 1]},
        {"type": "sky", "zenith": [0, 0, 1], "horizon": [1, 1, 1]},
        {"type": "area", "center": [0, 0, 3], "size": [1, 1], "radiance": 3},
    ],
)
def test_light_of_twice_the_strength_doubles_the_radiance(light: dict[str, Any]) -> None:
    world = raycam.World()
    world.add_object(plane={"size": [4, 4]})
    try:
        world.add_light(light)
    except raycam.WorldError:
        world.add_light(
            {"type": "area", "position": [0, 0, 3], "u": [1, 0, 0], "v": [0, -1, 0], "radiance": 3}
        )
    camera = raycam.Camera.look_at([0, -3, 1], [0, 0, 0], size=(16, 12), fov=20)
    before, after = (
        raycam.render(each, camera, channels="color", samples=4)["color"].astype(float)
        for each in (world, edited(world, "light", 0, "strength", 2))
    )
    assert before.max() > 0
    assert np.allclose(after, 2 * before, rtol=1e-4)


@pytest.mark.parametrize(
    "edit",
    [
        ("object", 7, "visible", True),
        ("light", 1, "strength", 2.0),
        ("light", 0, "color", "red"),
        ("object", 0, "strength", 2.0),
        ("object", 0, "visible", 1),
        ("object", 0, "color", "no such colour"),
        ("object", 0, "move", [1, 2]),
        ("object", 0, "scale", 0),
        ("object", 0, "turn", "x"),
        ("object", 0, "roughness", 1.5),
        ("object", 0, "metallic", True),
        ("object", 0, "emission", -1),
    ],
)
def test_invalid_edits_are_refused_and_change_nothing(small_world: raycam.World, edit: Any) -> None:
    edits = Edits(small_world)
    with pytest.raises(raycam.Error):
        edits.edit(*edit)
    assert edits.world is small_world
    with raises(raycam.WorldError, code="nothing_to_undo"):
        edits.undo()


def test_edits_can_be_undone_and_reach_all_sessions(small_world: raycam.World) -> None:
    edits = Edits(small_world)
    first, second = (Session(edits, small_world.camera("front")) for _ in range(2))
    heard: list[dict[str, Any]] = []
    second.connection.open(lambda message, buffers: heard.append(message))
    receive(first, {"type": "edit", "kind": "object", "number": 0, "key": "visible", "value": False})
    assert second.view.world is first.view.world is edits.world is not small_world
    contents = [each for each in heard if each["type"] == "contents"][-1]
    assert contents["objects"][0] == {"name": "box", "visible": False}
    assert (contents["undo"], contents["redo"]) == (1, 0)
    receive(first, {"type": "undo"})
    assert second.view.base is first.view.base is not small_world  # undo shows a copy of the world
    assert second.view.base.to_bytes() == small_world.to_bytes()
    receive(first, {"type": "redo"})
    assert not second.view.base.objects[0].visible
    with raises(raycam.WorldError, code="nothing_to_undo"):
        receive(first, {"type": "redo"})


def test_view_without_edit_refuses_edits(small_world: raycam.World) -> None:
    edits = Edits(small_world, allowed=False)
    with raises(raycam.SettingsError, code="read_only", mentions=["edit=False"]):
        edits.edit("object", 0, "visible", False)
    assert not edits.about()["editable"]


def test_materials_are_changed_and_keep_their_colour(small_world: raycam.World) -> None:
    before = material(small_world, 0)
    rough = edited(small_world, "object", 0, "roughness", 0.25)
    shiny = edited(rough, "object", 0, "metallic", 1)
    bright = edited(shiny, "object", 0, "emission", 4)
    found = material(bright, 0)
    assert (found["model"], found["roughness"], found["metallic"]) == ("principled", 0.25, 1)
    assert (found["color"], found["emission"]) == (before["color"], 4)
    assert material(small_world, 0) == before
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
    found = material(world, 0)
    assert (found["roughness"], found["metallic"]) == pytest.approx((roughness, metallic))
    camera = raycam.Camera.look_at([4, -3, 2], [0, 0, 0], size=(9, 9), fov=20)
    frame = raycam.render(world, camera, channels=["roughness", "metallic"])
    assert [frame[key][4, 4] for key in ("roughness", "metallic")] == pytest.approx([roughness, metallic])


def test_roughness_of_glass_and_metal_keeps_the_model() -> None:
    world = raycam.World()
    world.add_object(sphere={"radius": 1}, type="glass", ior=1.7)
    world.add_object(sphere={"radius": 1}, type="metal", metal="gold")
    for number, model in enumerate(["glass", "metal"]):
        found = material(edited(world, "object", number, "roughness", 0.4), number)
        assert (found["model"], found["roughness"]) == (model, 0.4)


def test_metallic_keeps_the_shown_roughness() -> None:
    world = raycam.World()
    world.add_object(sphere={"radius": 1}, color="#404040", specular=0.5, shininess=150)
    before = material(world, 0)["roughness"]
    assert material(edited(world, "object", 0, "metallic", 0.5), 0)["roughness"] == pytest.approx(before)


def test_roughness_keeps_color_and_texture_of_each_material(tmp_path: Path) -> None:
    (tmp_path / "m.mtl").write_text("newmtl red\nKd 0.8 0.1 0.1\nnewmtl blue\nKd 0.1 0.1 0.9\n")
    faces = "usemtl red\nf 1 2 3\nusemtl blue\nf 2 4 3\n"
    (tmp_path / "m.obj").write_text(f"mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\n{faces}")
    world = raycam.load(tmp_path / "m.obj")
    colors = [json.loads(edited(world, "object", 0, "roughness", 0.5)._core.material(0, i)) for i in range(2)]
    assert [each["color"] for each in colors] == [[0.8, 0.1, 0.1], [0.1, 0.1, 0.9]]
    assert [each["model"]["Principled"]["roughness"]["value"] for each in colors] == [0.5, 0.5]
    textured = raycam.World()
    textured.add_object(box={"size": 1}, texture=np.full((2, 2, 3), 128, np.uint8))
    assert material(edited(textured, "object", 0, "roughness", 0.5), 0)["textured"]
