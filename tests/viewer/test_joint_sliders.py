"""Sliders of robots' joints in the live view, driven by client messages."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raycam
from raycam.viewer.joint_sliders import MAX_SLIDERS
from raycam.viewer.viewer import Viewer
from support.patience import until
from support.raises import raises
from support.session_messages import receive

LINKS = "".join(
    f'<link name="{name}"><visual><geometry><box size="0.2 0.1 0.1"/></geometry></visual></link>'
    for name in ("base", "a", "b", "c", "d", "e")
)


def joint(name: str, kind: str, parent: str, child: str, extra: str = "") -> str:
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="0 0 0.2"/><axis xyz="0 0 1"/>{extra}</joint>'
    )


ARM = (
    f'<robot name="arm">{LINKS}'
    + joint("float", "floating", "base", "a")
    + joint("elbow", "revolute", "a", "b", '<limit lower="-0.5" upper="2"/>')
    + joint("wheel", "continuous", "b", "c")
    + joint("slide", "prismatic", "c", "d", '<limit lower="0" upper="0.3"/>')
    + joint("copy", "prismatic", "d", "e", '<limit lower="0" upper="0.3"/><mimic joint="slide"/>')
    + "</robot>"
)


@pytest.fixture
def arm(tmp_path: Path) -> raycam.World:
    (tmp_path / "arm.urdf").write_text(ARM)
    return raycam.load(tmp_path / "arm.urdf")


def listed(viewer: Viewer) -> dict[str, dict[str, Any]]:
    return {each["label"]: each for each in viewer.controls.message()["controls"]}


def move(viewer: Viewer, session: Any, name: str, value: float) -> None:
    """Moves a slider as a client does, and waits until the world has the value."""
    receive(session, {"type": "control", "id": listed(viewer)[name]["id"], "value": value})
    places = {"elbow": 7, "wheel": 8, "slide": 9}
    until(lambda: viewer.world.robots["arm"].values[places[name]] == value)


def test_sliders_have_the_limits_and_values_of_joints(arm: raycam.World) -> None:
    arm.set_joints("arm", {"elbow": 0.25})
    with Viewer(arm, port=0) as viewer:
        found = listed(viewer)
    assert {each["folder"] for each in found.values()} == {"Joints of arm"}
    ranges = {name: (each["min"], each["max"], each["value"]) for name, each in found.items()}
    assert ranges == {
        "elbow": (-0.5, 2.0, 0.25),
        "wheel": (-math.pi, math.pi, 0.0),
        "slide": (0.0, 0.3, 0.0),
    }


def test_sliders_move_the_robot_like_set_joints(arm: raycam.World) -> None:
    expected = arm.copy()
    expected.set_joints("arm", {"elbow": 1.25, "slide": 0.2})
    with Viewer(arm, port=0) as viewer:
        session = viewer._session()
        move(viewer, session, "elbow", 1.25)
        move(viewer, session, "slide", 0.2)
        for one, other in zip(viewer.world.objects, expected.objects, strict=True):
            np.testing.assert_array_equal(one.matrix, other.matrix)
        assert not np.allclose(viewer.world.objects[-1].matrix, arm.objects[-1].matrix)


def test_drag_of_a_slider_is_one_step_of_undo_and_undo_moves_the_slider(arm: raycam.World) -> None:
    with Viewer(arm, port=0) as viewer:
        session = viewer._session()
        for value in (0.5, 1.0, 1.5):
            move(viewer, session, "elbow", value)
        move(viewer, session, "wheel", 2.0)
        receive(session, {"type": "undo"})
        assert (listed(viewer)["elbow"]["value"], listed(viewer)["wheel"]["value"]) == (1.5, 0.0)
        receive(session, {"type": "undo"})
        assert listed(viewer)["elbow"]["value"] == 0.0
        assert viewer.world.robots["arm"].pose("b")[0, 0] == 1
        receive(session, {"type": "redo"})
        assert listed(viewer)["elbow"]["value"] == 1.5


def test_sliders_follow_worlds_that_a_script_shows(arm: raycam.World, tmp_path: Path) -> None:
    with Viewer(arm, port=0) as viewer:
        changed = arm.copy()
        with pytest.warns(raycam.Notice) as notices:
            changed.set_joints("arm", {"elbow": 2.5})
        assert [notice.message.code for notice in notices] == ["outside_limits"]
        viewer.world = changed
        assert (listed(viewer)["elbow"]["max"], listed(viewer)["elbow"]["value"]) == (2.5, 2.5)
        (tmp_path / "one.urdf").write_text(ARM.replace('"arm"', '"other"').replace("wheel", "turn"))
        viewer.world = raycam.load(tmp_path / "one.urdf")
        assert list(listed(viewer)) == ["elbow", "turn", "slide"]
        assert listed(viewer)["turn"]["folder"] == "Joints of other"


def test_worlds_without_robots_and_read_only_views_have_no_sliders(
    arm: raycam.World, small_world: raycam.World
) -> None:
    with Viewer(arm, port=0, edit=False) as viewer:
        assert listed(viewer) == {}
        with raises(raycam.SettingsError, code="read_only"):
            viewer._edits.change(lambda world: None, "stroke")
    with Viewer(small_world, small_world.camera("front"), port=0) as viewer:
        assert listed(viewer) == {}


def test_joints_beyond_the_limit_are_reported(tmp_path: Path) -> None:
    count = MAX_SLIDERS + 3
    links = "".join(f'<link name="l{i}"/>' for i in range(1, count + 1))
    joints = "".join(joint(f"j{i}", "continuous", f"l{i}", f"l{i + 1}") for i in range(count))
    first = '<link name="l0"><visual><geometry><sphere radius="1"/></geometry></visual></link>'
    (tmp_path / "snake.urdf").write_text(f'<robot name="snake">{first}{links}{joints}</robot>')
    with Viewer(raycam.load(tmp_path / "snake.urdf"), port=0) as viewer:
        found = listed(viewer)
    assert len(found) == MAX_SLIDERS + 1
    assert found["Joints"]["value"] == f"3 of {count} joints have no slider; the limit is {count - 3}"
