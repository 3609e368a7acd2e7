"""The notice about cameras that do not show the world, in a session and in Chromium."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import raycam
from raycam.viewer.session.placement_check import PlacementCheck
from raycam.viewer.viewer import Viewer
from support.chromium import Tab


@pytest.fixture
def y_up(tmp_path: Path) -> raycam.World:
    """A model with y up, high above the origin, next to cameras of a world with z up."""
    made = raycam.World(up="y")
    made.add_object(box={"size": 1}, location=[0, 6, 0], name="box")
    made.to_gltf(tmp_path / "model.glb")
    world = raycam.load(tmp_path / "model.glb")
    for i in range(3):
        place = [3 * np.cos(2 * i), 3 * np.sin(2 * i), 6.5]
        world.add_camera(raycam.Camera.look_at(place, [0, 0, 6], size=(48, 32), fov=40), f"photo{i}")
    return world


def turned(world: raycam.World) -> raycam.World:
    changed, turn = world.copy(), np.eye(4)
    turn[:3, :3] = [[1, 0, 0], [0, 0, -1], [0, 1, 0]]
    changed.set_object(0, matrix=turn @ world.objects[0].matrix)
    return changed


def test_misplaced_world_is_reported_once_and_until_it_is_turned(y_up: raycam.World) -> None:
    misplaced = PlacementCheck()
    (text,) = misplaced.check(y_up)
    assert "90 degrees about the x axis" in text
    assert misplaced.texts == (text,)
    assert misplaced.check(y_up) == misplaced.check(y_up.copy()) == ()
    assert misplaced.texts == (text,)
    assert misplaced.check(turned(y_up)) == misplaced.texts == ()


def test_world_without_cameras_gives_no_notice() -> None:
    world = raycam.World()
    world.add_object(box={"size": 1})
    assert PlacementCheck().check(world) == ()


def test_view_shows_the_rotation_that_makes_the_model_visible(tab: Tab, y_up: raycam.World) -> None:
    with Viewer(y_up, y_up.camera("photo0"), port=0, samples=1) as viewer:
        tab.said.clear()
        tab.open(viewer.url)
        tab.wait("document.getElementById('message').textContent.includes('90 degrees about the x axis')")
        tab.wait("document.getElementById('notices').textContent.includes('90 degrees about the x axis')")
        viewer.world = turned(y_up)
        tab.wait("!document.getElementById('notices').textContent.includes('90 degrees')")
        assert tab.said == []
