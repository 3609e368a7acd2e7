"""Lights that are added, changed, moved and removed in a view."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raycam
from raycam.viewer import client_messages as messages
from raycam.viewer.scene.edits import Edits, edited
from raycam.viewer.scene.light_edits import NEW_LIGHTS, describe_light
from raycam.viewer.session import Session
from support.raises import raises


def irradiance_at(world: raycam.World, point: Any, normal: Any) -> np.ndarray:
    """The irradiance at a point, from the radiance of a small white matte square there.

    E = pi L.
    """
    probe = raycam.World(up=world.up)
    for light in world.lights:
        probe.add_light(light)
    normal = np.array(normal, float) / np.linalg.norm(normal)
    first = np.cross(normal, [0.3, 0.5, 0.7])
    first /= np.linalg.norm(first)
    matrix = np.eye(4)
    matrix[:3, :3] = np.stack([first, np.cross(normal, first), normal], axis=1)
    matrix[:3, 3] = point
    probe.add_object(plane={"size": [1e-3, 1e-3]}, matrix=matrix, type="matte", color=[1, 1, 1], diffuse=1.0)
    eye = np.array(point) + 0.01 * normal + 0.002 * first
    camera = raycam.Camera.look_at(eye, point, size=(9, 9), fov=1)
    image = raycam.render(probe, camera, channels="color", samples=256, integrator="direct")
    return np.pi * image["color"].astype(float).mean(axis=(0, 1))


@pytest.mark.parametrize("kind", NEW_LIGHTS)
@pytest.mark.parametrize("up", ["z", "y"])
def test_new_light_shines_down_on_the_center_of_the_world(kind: str, up: str) -> None:
    world = raycam.World(up=up)
    world.add_object(box=2, location=[5, 6, 7])
    lit = edited(world, "light", 0, "add", kind)
    assert [each["type"] for each in lit.lights] == [kind]
    assert world.lights == []
    (light,) = lit.lights
    axis = 2 if up == "z" else 1
    if light.get("position") is not None:
        toward = np.array(light["position"]) - [5, 6, 7]
    else:
        toward = -np.array(light["direction"])
    assert toward[axis] > 0
    found = irradiance_at(lit, [5, 6, 7], toward)
    assert np.allclose(found, 3.0, rtol=0.05 if kind == "area" else 0.01), found


def test_light_keeps_its_strength_if_its_color_changes(small_world: raycam.World) -> None:
    before = describe_light(small_world.lights[0], 0)
    red = edited(small_world, "light", 0, "color", "#ff0000")
    assert np.allclose(red.lights[0]["irradiance"], [3, 0, 0])
    grey = edited(red, "light", 0, "color", "#bcbcbc")
    assert np.allclose(grey.lights[0]["irradiance"], 3)
    half = edited(grey, "light", 0, "level", 1.5)
    assert np.allclose(half.lights[0]["irradiance"], 1.5)
    assert (before["color"], before["level"], before["unit"]) == ("#ffffff", 3.0, "W/m²")
    tint = edited(half, "light", 0, "color", "#ff8040")
    assert describe_light(tint.lights[0], 0)["color"] == "#ff8040"


def test_light_of_strength_zero_becomes_white_if_its_strength_is_increased(small_world: raycam.World) -> None:
    off = edited(small_world, "light", 0, "level", 0)
    assert np.allclose(off.lights[0]["irradiance"], 0)
    on = edited(off, "light", 0, "level", 2)
    assert np.allclose(on.lights[0]["irradiance"], 2)


@pytest.mark.parametrize(
    ("number", "key", "value", "code"),
    [
        (0, "color", "red", "invalid_value"),
        (0, "color", "#12345", "invalid_value"),
        (0, "color", "#000000", "out_of_range"),
        (0, "color", 7, "invalid_value"),
        (0, "level", -1, "out_of_range"),
        (0, "level", True, "wrong_type"),
        (0, "direction", [3, 2], "wrong_shape"),
        (0, "direction", [1, 2, 3, 4], "wrong_shape"),
        (0, "position", [1, 2, 3], "unknown_name"),
        (0, "add", "laser", "unknown_name"),
        (9, "remove", True, "index_out_of_range"),
        (0, "remove", False, "unknown_name"),
    ],
)
def test_invalid_light_edits_are_refused(
    small_world: raycam.World, number: int, key: str, value: Any, code: str
) -> None:
    with raises(raycam.Error, code=code):
        edited(small_world, "light", number, key, value)


def test_drag_of_a_light_is_one_step_of_undo(small_world: raycam.World) -> None:
    world = small_world.copy()
    world.add_light({"type": "point", "position": [0, 0, 1], "power": [9, 9, 9]})
    session = Session(Edits(world), world.camera("front"))
    session.receive(messages.SelectLight(1))
    drawn = session.overlay(session.view)
    (arrow,) = (each for each in drawn if each.get("handle") == "z")
    begin = arrow["lines"][0][-1]
    for step in (5, 10, 15):
        end = [begin[0], begin[1] - step]
        session.receive(messages.Gizmo("z", 7, begin, end))
    edits = session.view.opened.edits
    (x, y, z) = edits.world.lights[1]["position"]
    assert np.allclose([x, y], 0)
    assert z > 1.05
    assert edits.about()["undo"] == 1
    edits.undo()
    assert edits.world.lights[1]["position"] == [0, 0, 1]


def test_lights_are_restored_from_the_saved_glb(small_world: raycam.World, tmp_path: Path) -> None:
    lit = edited(edited(small_world, "light", 0, "add", "point"), "light", 1, "color", "#40ff40")
    lit.to_gltf(tmp_path / "lit.glb")
    again = raycam.load(tmp_path / "lit.glb")
    images = [
        raycam.render(
            each, each.camera("front").resized((48, 32)), channels="color", samples=4, integrator="direct"
        )["color"]
        for each in (lit, again)
    ]
    assert images[0].max() > 0
    assert np.abs(images[0] - images[1]).max() < 0.01 * images[0].max()
