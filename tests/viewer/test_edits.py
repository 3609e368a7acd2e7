"""Edits and undo."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import raycam
from raycam.viewer.scene.edits import Edits, edited
from raycam.viewer.scene.material_edits import edit_material
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
        edit_material(small_world, 0, None, "color", "#0000ff"), camera, channels=["albedo", "instance"]
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
        ("object", 0, "move", [1, 2]),
        ("object", 0, "scale", 0),
        ("object", 0, "turn", "x"),
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
