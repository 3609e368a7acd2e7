"""The handles that turn a sun."""

from __future__ import annotations

import numpy as np
import pytest
import raycam
from raycam.viewer import client_messages as messages
from raycam.viewer.scene.edits import Edits
from raycam.viewer.scene.sun_handle import center_of_objects
from raycam.viewer.session import Session

DIRECTION = [1.0, 0.5, -2.0]


@pytest.fixture
def session() -> Session:
    world = raycam.World()
    world.add_object(box={"size": 1}, location=[1, 2, 0.5], name="box")
    world.add_ground()
    world.add_light({"type": "sun", "direction": DIRECTION, "irradiance": [2, 2, 2]})
    world.add_light({"type": "sky", "radiance": 0.5})
    world.add_camera(
        raycam.Camera.look_at([1, 2, 6], [1, 2, 0.5], size=(320, 240), fov=40, up=[0, 1, 0]), "top"
    )
    made = Session(Edits(world), world.camera("top"))
    made.receive(messages.SelectLight(0))
    return made


def lines_of(session: Session, handle: str | None) -> np.ndarray:
    found = [each["lines"] for each in session.overlay(session.view) if each.get("handle") == handle]
    return np.concatenate([np.array(line) for lines in found for line in lines])


def middle_of(session: Session) -> np.ndarray:
    """The box's centre in pixels from the image's top left corner.

    It is computed with the pinhole equation.
    """
    camera = session.view.still_camera
    u, v, w = camera.K @ (camera.R @ ([1, 2, 0.5] - camera.location))
    return np.array([u / w, v / w]) - camera.corner


def sun_of(session: Session) -> np.ndarray:
    return np.array(session.view.opened.edits.world.lights[0]["direction"])


def test_circles_surround_the_centre_of_the_objects_without_the_ground(session: Session) -> None:
    assert center_of_objects(session.view.world) == pytest.approx([1, 2, 0.5])
    circle = lines_of(session, "z")
    assert (circle.min(axis=0) + circle.max(axis=0)) / 2 == pytest.approx(middle_of(session), abs=1)
    assert np.ptp(circle, axis=0).min() > 100


def test_drag_of_the_horizontal_circle_turns_the_azimuth_in_one_step(session: Session) -> None:
    # The camera looks down, so this drag from the right of the centre to its upper side is a quarter turn.
    middle = middle_of(session)
    for way in ([40, -40], [0, -60]):
        session.receive(
            messages.Gizmo("z", 5, np.add(middle, [60, 0]).tolist(), np.add(middle, way).tolist())
        )
    x, y, z = DIRECTION
    assert sun_of(session) == pytest.approx([-y, x, z], abs=1e-6)  # a quarter turn, seen from above
    assert session.view.opened.edits.about()["undo"] == 1
    session.receive(messages.Undo())
    assert sun_of(session) == pytest.approx(DIRECTION)


def test_drawn_ray_begins_on_the_side_of_the_sun(session: Session) -> None:
    ray = lines_of(session, None)
    away = ray[np.argmax(np.hypot(*(ray - middle_of(session)).T))] - middle_of(session)
    assert away @ [-DIRECTION[0], DIRECTION[1]] > 0  # rows of the image point to -y


def test_lights_without_a_direction_have_no_circles(session: Session) -> None:
    session.receive(messages.SelectLight(1))
    assert session.overlay(session.view) == []
    session.receive(messages.Gizmo("z", 6, [240, 120], [160, 40]))
    assert session.view.opened.edits.about()["undo"] == 0


def test_read_only_view_draws_no_circles() -> None:
    world = raycam.World()
    world.add_object(box={"size": 1})
    world.add_light({"type": "sun", "direction": DIRECTION, "irradiance": [2, 2, 2]})
    session = Session(Edits(world, allowed=False), world.view_from("front", size=(64, 48)))
    session.receive(messages.SelectLight(0))
    assert session.overlay(session.view) == []
