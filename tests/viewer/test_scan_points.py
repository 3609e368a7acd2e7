"""The points of a lidar over the image of the live view."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import raycam
from raycam.viewer.answers import answer
from raycam.viewer.client_messages import Scan
from raycam.viewer.scene.scan_points import MAX_POINTS, lidar_names, scan_points
from raycam.viewer.session import Session


@pytest.fixture
def hall() -> raycam.World:
    """A wall behind a box, seen from the lidar's place and from the side."""
    world = raycam.World()
    world.add_object(box={"size": [0.2, 30, 20]}, location=[10.1, 0, 0], name="wall", color=[0.5] * 3)
    world.add_object(box={"size": [1, 1, 1]}, location=[5, 0, 0], name="box", color=[0.5] * 3)
    world.add_sensor(raycam.Lidar("vlp16", noise=False), "top")
    return world


def camera(eye: list[float]) -> raycam.Camera:
    return raycam.Camera.look_at(eye, [10, 0, 0], fov=60, size=(64, 48))


def test_drawn_points_are_projections_of_visible_points(hall: raycam.World) -> None:
    points = scan_points(hall, "top")
    scan = raycam.scan(hall, "top")
    assert points.total == scan.count
    step = -(-scan.count // MAX_POINTS)
    np.testing.assert_allclose(points.positions, scan.in_world()[::step])
    seen = camera([0, 6, 3])
    drawn = np.reshape(points.drawn(hall, seen)["points"], (-1, 3))
    numbers = drawn[:, 0].astype(int)
    pixels, _ = seen.project(points.positions[numbers])
    np.testing.assert_allclose(drawn[:, 1:], pixels - seen.corner, atol=0.051)
    assert ((drawn[:, 1:] >= 0) & (drawn[:, 1:] <= [64, 48])).all()
    # Drawn points must be visible to the camera: points of the wall that the box hides are not drawn.
    origins, directions = seen.rays(drawn[:, 1:] + seen.corner)
    hits = hall.cast_rays(origins, directions, fields=["position"])
    assert np.nanquantile(np.linalg.norm(hits["position"] - points.positions[numbers], axis=1), 0.95) < 0.2


def test_points_behind_an_object_are_not_drawn(hall: raycam.World) -> None:
    points = scan_points(hall, "top")
    behind = camera([20, 0, 0])  # this camera is behind the wall
    assert points.drawn(hall, behind)["points"] == []
    front = np.reshape(points.drawn(hall, camera([0, 0, 0]))["points"], (-1, 3))
    assert len(front) > 500


def test_message_contains_the_fields_of_the_points(hall: raycam.World) -> None:
    points, scan = scan_points(hall, "top"), raycam.scan(hall, "top")
    message = points.message()
    step = -(-scan.count // MAX_POINTS)
    assert (message["lidar"], message["total"]) == ("top", scan.count)
    np.testing.assert_array_equal(message["fields"]["ring"], scan["ring"][::step])
    np.testing.assert_array_equal(message["fields"]["instance"], scan["instance"][::step])
    np.testing.assert_allclose(message["fields"]["time"], 1e3 * scan["time"][::step], atol=1e-4)
    assert lidar_names(hall) == ["top"]
    assert lidar_names(raycam.World()) == []


def test_session_removes_a_drawn_scan_when_its_world_changes(hall: raycam.World) -> None:
    heard: list[dict[str, Any]] = []
    session = Session(hall, camera([0, 6, 3]))
    session.connection.open(lambda message, buffers: heard.append(message))
    assert session.welcome()["lidars"] == ["top"]
    answer(session, Scan("top"))
    assert [message["type"] for message in heard[-2:]] == ["scan", "overlay"]
    (layer,) = [each for each in session.overlay(session.view) if "points" in each]
    assert (
        len(layer["points"])
        == len(next(each for each in heard[-1]["overlay"] if "points" in each)["points"])
        > 0
    )
    session.view.opened.edits.edit("object", 1, "move", [0.0, 3.0, 0.0])
    assert not [each for each in session.overlay(session.view) if "points" in each]
    assert {"type": "scan", "lidar": "", "total": 0, "fields": {}} in heard
    answer(session, Scan("top"))
    answer(session, Scan(""))
    assert not [each for each in session.overlay(session.view) if "points" in each]
    answer(session, Scan("tip"))
    assert heard[-1]["type"] == "error"
    assert "top" in heard[-1]["text"]
