"""Undo of camera moves, looks and variants, in one order with edits of the world."""

from __future__ import annotations

import numpy as np
import pytest
import raycam
from raycam.viewer.scene.edits import Edits
from raycam.viewer.session import Session
from raycam.viewer.session.history import History
from support.raises import raises
from support.session_messages import orbit, receive

NO_COLORS = {"ground_color": "", "backdrop": "light", "background": ""}
LOOK = {"light": "sun", "rotation": 0, "azimuth": 10, "elevation": 20, "ground": "none", **NO_COLORS}
LENS = {"type": "lens", "fx": 60, "fy": 61, "cx": 20, "cy": 15, "distortion": []}


@pytest.fixture
def clock() -> list[float]:
    return [0.0]


@pytest.fixture
def session(small_world: raycam.World, clock: list[float]) -> Session:
    made = Session(small_world, small_world.camera("front"))
    made.history = History(lambda: clock[0])
    return made


def later(clock: list[float], seconds: float = 5) -> None:
    clock[0] += seconds


def test_moves_without_a_pause_are_one_step_of_undo(session: Session, clock: list[float]) -> None:
    first = session.view.camera
    for _ in range(5):
        orbit(session, 3)
        later(clock, 0.5)
    second = session.view.camera
    later(clock)
    orbit(session, 10)
    assert session.history.counts == (2, 0)
    receive(session, {"type": "undo"})
    assert session.view.camera == second
    receive(session, {"type": "undo"})
    assert session.view.camera == first
    assert session.view.camera_name == "front"
    receive(session, {"type": "redo"})
    assert session.view.camera == second
    assert session.view.camera_name == ""


@pytest.mark.parametrize(
    "message",
    [
        LENS,
        {"type": "look", **LOOK},
        {"type": "camera", "seq": 1, "name": "side"},
        {"type": "side", "seq": 1, "name": "top"},
        {"type": "pose", "location": [1, 2, 3], "roll": 0, "pitch": 10, "yaw": 20},
        {"type": "quality", "integrator": "path"},
    ],
    ids=lambda each: each["type"],
)
def test_every_change_of_the_view_is_undone_and_repeated(session: Session, message: dict) -> None:
    before = session.view
    receive(session, message)
    after = session.view
    assert not after.shows_like(before)
    receive(session, {"type": "undo"})
    assert session.view.shows_like(before)
    receive(session, {"type": "redo"})
    assert session.view.shows_like(after)


def test_edits_and_moves_are_undone_in_reverse_order(session: Session, clock: list[float]) -> None:
    edits = session.view.opened.edits
    camera = session.view.camera
    receive(session, {"type": "edit", "kind": "object", "number": 0, "key": "move", "value": [0, 0, 1]})
    orbit(session, 20)
    moved = session.view.camera
    receive(session, {"type": "edit", "kind": "object", "number": 0, "key": "move", "value": [0, 0, 1]})

    def height() -> float:
        return float(np.array(edits.world.objects[0].matrix)[2, 3])

    states = [(2, moved), (1, moved), (1, camera), (0, camera)]
    assert (height(), session.view.camera) == states[0]
    for expected in states[1:]:
        receive(session, {"type": "undo"})
        assert (height(), session.view.camera) == expected
    with raises(raycam.WorldError, code="nothing_to_undo"):
        receive(session, {"type": "undo"})
    for expected in states[-2::-1]:
        receive(session, {"type": "redo"})
        assert (height(), session.view.camera) == expected
    with raises(raycam.WorldError, code="nothing_to_undo"):
        receive(session, {"type": "redo"})


def test_moves_of_one_client_are_not_undone_by_another(small_world: raycam.World) -> None:
    edits = Edits(small_world)
    first, second = (Session(edits, small_world.camera("front")) for _ in range(2))
    orbit(first, 20)
    moved = first.view.camera
    with raises(raycam.WorldError, code="nothing_to_undo"):
        receive(second, {"type": "undo"})
    receive(second, {"type": "edit", "kind": "object", "number": 0, "key": "visible", "value": False})
    receive(first, {"type": "undo"})
    assert edits.world is not small_world
    assert edits.world.objects[0].visible
    assert first.view.camera == moved


def test_display_changes_are_not_steps_of_undo(session: Session) -> None:
    receive(session, {"type": "channel", "name": "depth"})
    receive(session, {"type": "display", "exposure": 1, "view": "agx"})
    receive(session, {"type": "size", "width": 300, "height": 200, "ratio": 2})
    assert session.history.counts == (0, 0)


def test_restored_camera_has_the_current_size_of_the_window(clock: list[float]) -> None:
    world = raycam.World()
    world.add_object(box={"size": 1})
    session = Session(world)
    session.history = History(lambda: clock[0])
    receive(session, {"type": "size", "width": 400, "height": 200, "ratio": 1})
    forward = session.view.camera.forward
    orbit(session, 30)
    receive(session, {"type": "size", "width": 200, "height": 400, "ratio": 1})
    receive(session, {"type": "undo"})
    assert session.view.camera.size == (200, 400)
    np.testing.assert_allclose(session.view.camera.forward, forward, atol=1e-12)


def test_client_receives_undo_steps_and_the_restored_look(session: Session) -> None:
    sent: list[dict] = []
    session.connection.open(lambda message, buffers: sent.append(message))
    session.greet()
    sent.clear()
    receive(session, {"type": "look", **LOOK})
    receive(session, {"type": "undo"})
    steps = [(each["undo"], each["redo"]) for each in sent if each["type"] == "history"]
    assert steps == [(1, 0), (0, 1)]
    looks = [each["look"]["light"] for each in sent if each["type"] == "look"]
    assert looks == ["sun", session.view.look.light]
