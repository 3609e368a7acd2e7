"""The key `slots`: materials of single slots of a mesh, in calls and in world files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raycam
from support.raises import raises
from support.two_materials import two_materials

RED, BLUE = [0.8, 0.1, 0.1], [0.1, 0.1, 0.9]


def colors(world: raycam.World) -> np.ndarray:
    """The albedo [2, 3] of the triangles of the first object."""
    camera = world.view_from("top", size=(32, 32))
    seen = raycam.render(world, camera, channels=["albedo", "triangle", "instance"], samples=1)
    shown = [(seen["instance"] == 0) & (seen["triangle"] == triangle) for triangle in range(2)]
    return np.array([seen["albedo"][pixels].mean(axis=0) for pixels in shown])


def test_names_of_the_materials_are_listed(tmp_path: Path) -> None:
    assert two_materials(tmp_path).objects[0].materials == ("red", "blue")
    world = raycam.World()
    world.add_object(box=1, name="crate")
    assert world.objects[0].materials == ("crate",)


def test_triangle_has_the_slot_of_its_material(tmp_path: Path) -> None:
    core = two_materials(tmp_path)._core
    assert [core.slot(0, triangle) for triangle in range(3)] == [0, 1, None]
    world = raycam.World()
    world.add_object(box=1)
    assert [world._core.slot(*place) for place in ((0, 11), (0, 12), (1, 0))] == [0, None, None]


@pytest.mark.parametrize("slot", [1, "1", "blue", np.int64(1)])
def test_changed_slot_keeps_the_other_slot_and_its_name(tmp_path: Path, slot: Any) -> None:
    world = two_materials(tmp_path)
    before = world.copy()
    world.set_object(0, slots={slot: {"color": [0, 1, 0]}})
    assert np.allclose(colors(world), [RED, [0, 1, 0]], atol=1e-6)
    assert world.objects[0].materials == ("red", "blue")
    assert np.allclose(colors(before), [RED, BLUE], atol=1e-6)


def test_slots_are_changed_after_the_keys_for_all_slots(tmp_path: Path) -> None:
    two_materials(tmp_path)
    world = raycam.World()
    texture = np.full((2, 2, 3), [0, 1, 0], np.float32)
    slots = {"red": {"color": [1, 1, 1], "texture": texture}}
    world.add_object(mesh=str(tmp_path / "m.obj"), color=[0.25, 0.5, 0.75], slots=slots)
    assert np.allclose(colors(world), [[0, 1, 0], [0.25, 0.5, 0.75]], atol=1e-6)


def test_slots_of_world_files_and_instances_are_read(tmp_path: Path) -> None:
    two_materials(tmp_path)
    (tmp_path / "w.toml").write_text(
        '[[object]]\nmesh = "m.obj"\nname = "first"\n[object.slots.blue]\ncolor = [0, 1, 0]\n'
        '[[object]]\ninstance_of = "first"\nlocation = [3, 0, 0]\nslots = { 0 = { color = [1, 1, 1] } }\n'
    )
    world = raycam.load(tmp_path / "w.toml")
    assert np.allclose(colors(world), [RED, [0, 1, 0]], atol=1e-6)
    assert world.objects[1].materials == ("red", "blue")
    world.remove_object("first")
    assert np.allclose(colors(world), [[1, 1, 1], [0, 1, 0]], atol=1e-6)


@pytest.mark.parametrize(
    ("slots", "code", "mentions"),
    [
        ({2: {"color": "red"}}, "unknown_name", ["slots.2", "2 material slots", '"red"', '"blue"']),
        ({"bleu": {"color": "red"}}, "unknown_name", ["slots.bleu", "blue"]),
        ({"blue": {"yaw": 20}}, "conflicting_values", ["slots.blue.yaw"]),
        ({"blue": {"metallic": 1}}, "conflicting_values", ["slots.blue.metallic"]),
        ({"blue": {"opacity": 1}, 1: {"opacity": 0.5}}, "conflicting_values", ["slots.blue"]),
        ({"1": {"opacity": 1}, 1: {"opacity": 0.5}}, "conflicting_values", ["slot 1"]),
    ],
)
def test_invalid_slots_are_refused_and_change_nothing(
    tmp_path: Path, slots: dict[Any, Any], code: str, mentions: list[str]
) -> None:
    world = two_materials(tmp_path)
    before = world.to_bytes()
    with raises(raycam.WorldError, code=code, mentions=mentions):
        world.set_object(0, slots=slots)
    assert world.to_bytes() == before
