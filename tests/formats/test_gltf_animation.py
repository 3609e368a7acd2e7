"""Animations of glTF files, compared at times for which the document defines the result."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support.gltf_document import TRIANGLE, Document, animated, load


def test_keyframes_are_interpolated_as_specified(tmp_path: Path) -> None:
    times, places = [1, 2, 4], np.array([[0, 0, 0], [4, 0, 0], [4, 8, 0]], np.float32)
    tangents = np.array([[1, 2, 3], [0, -1, 0], [2, 0, 0]], np.float32)
    spline = np.stack([tangents, places, -tangents], 1).reshape(-1, 3)
    document = Document()
    node = document.node(mesh=document.square())
    animated(document, "translation", times, places, node=node)
    animated(document, "translation", times, places, node=node, interpolation="STEP")
    animated(document, "translation", times, spline, node=node, interpolation="CUBICSPLINE")
    world = load(document, tmp_path)
    assert [animation.duration for animation in world.animations] == [4, 4, 4]

    def place(time: float, animation: int) -> Any:
        return world.at(time, animation).objects[0].matrix[:3, 3]

    np.testing.assert_allclose(
        [place(t, 0) for t in (0, 1.25, 3, 9)], [places[0], [1, 0, 0], [4, 4, 0], places[2]]
    )
    np.testing.assert_allclose([place(t, 1) for t in (0, 1.99, 2, 9)], places[[0, 0, 1, 2]])
    from scipy.interpolate import CubicHermiteSpline

    for first in (0, 1):
        # Each keyframe has its own incoming and outgoing tangent.
        ends = [-tangents[first], tangents[first + 1]]
        curve = CubicHermiteSpline(times[first : first + 2], places[first : first + 2], ends)
        for time in np.linspace(times[first], times[first + 1], 5):
            np.testing.assert_allclose(place(float(time), 2), curve(time), atol=1e-6)


def test_rotations_follow_the_shorter_arc_at_constant_speed(tmp_path: Path) -> None:
    ends = Rotation.from_euler("zx", [[0, 0], [170, 40]], degrees=True)
    from scipy.spatial.transform import Slerp

    document = Document()
    node = document.node(mesh=document.square())
    # The second quaternion has the opposite sign, so it describes the same rotation along the longer arc.
    animated(document, "rotation", [0, 1], ends.as_quat() * [[1], [-1]], node=node)
    world = load(document, tmp_path)
    for time in (0.0, 0.25, 0.5, 0.9, 1.0):
        turned = world.at(time).objects[0].matrix[:3, :3]
        np.testing.assert_allclose(turned, Slerp([0, 1], ends)(time).as_matrix(), atol=1e-6)


def test_morph_targets_and_skins_move_the_vertices(tmp_path: Path) -> None:
    up = np.array([[0, 0, 0], [0, 0, 1], [0, 2, 0]], np.float32)
    document = Document()
    mesh = document.mesh({"POSITION": TRIANGLE}, targets=[{"POSITION": document.accessor(up)}])
    document.json["meshes"][mesh]["weights"] = [0.5]
    node = document.node(mesh=mesh)
    animated(document, "weights", [0, 1], [0, 1], node=node)
    weights = np.array([[1, 0, 0, 0], [0.5, 0.5, 0, 0], [0, 1, 0, 0]], np.float32)
    attributes = {
        "POSITION": TRIANGLE,
        "JOINTS_0": np.tile(np.array([0, 1, 0, 0], np.uint8), (3, 1)),
        "WEIGHTS_0": weights,
    }
    bind = np.tile(np.eye(4, dtype=np.float32), (2, 1, 1))
    bind[1, 3, :3] = [0, -5, 0]
    joints = [document.node(translation=[1, 0, 0]), document.node(translation=[0, 5, 0])]
    document.add("skins", joints=joints, inverseBindMatrices=document.accessor(bind))
    # The node's own transform does not apply to a skin.
    document.node(mesh=document.mesh(attributes), skin=0, translation=[100, 0, 0])
    animated(document, "translation", [0, 2], [[0, 5, 0], [0, 5, 6]], node=joints[1])
    world = load(document, tmp_path)
    np.testing.assert_allclose(world.triangles()[0], TRIANGLE + 0.5 * up)
    np.testing.assert_allclose(world.triangles()[1], TRIANGLE + weights[:, :1] * [1, 0, 0], atol=1e-6)
    np.testing.assert_allclose(world.at(0.25, "weights of 0").triangles()[0], TRIANGLE + 0.25 * up)
    moved = TRIANGLE + weights[:, :1] * [1, 0, 0] + weights[:, 1:2] * [0, 0, 3]
    np.testing.assert_allclose(world.at(1, 1).triangles()[1], moved, atol=1e-6)


@pytest.mark.parametrize(
    "damage",
    [
        lambda a: a["samplers"][1].update(interpolation=0),
        lambda a: a["samplers"][1].update(interpolation="SMOOTH"),
        lambda a: a["samplers"][1].update(input=99),
        lambda a: a["samplers"][1].pop("output"),
        lambda a: a["channels"][1].update(sampler=9),
        lambda a: a["channels"][1].update(target={"node": 0, "path": 5}),
        lambda a: a["channels"].__setitem__(1, None),
    ],
)
def test_faulty_channel_is_omitted_with_a_notice(
    tmp_path: Path, damage: Callable[[dict[str, Any]], object]
) -> None:
    document = Document()
    node = document.node(mesh=document.square())
    animated(document, "translation", [0, 2], [[0, 0, 0], [4, 0, 0]], node=node)
    animated(document, "scale", [0, 2], [[1, 1, 1], [3, 3, 3]], node=node)
    animations = document.json["animations"]
    first, second = animations
    first["channels"].append({**second["channels"][0], "sampler": 1})
    first["samplers"].append(second["samplers"][0])
    animations[1] = {"channels": 7}
    damage(first)
    world = load(document, tmp_path)
    moved = world.at(1.0).objects[0].matrix
    np.testing.assert_allclose(moved[:3], [[1, 0, 0, 2], [0, 1, 0, 0], [0, 0, 1, 0]], atol=1e-6)
    notices = [notice for notice in world.notices if notice.code == "ignored_element"]
    places = [subject.split(": ")[-1] for notice in notices for subject in notice.subjects]
    assert places == ["animations[0].channels[1]", "animations[1]"]
