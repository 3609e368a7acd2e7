"""Navigation in the client, checked with raycam's cameras for every kind of camera."""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np
import pytest
import raycam
from raycam.viewer import probe
from raycam.viewer.session import Session, View
from support.node_core import needs_node, run_module

pytestmark = needs_node
PIVOT = np.array([0.2, -0.1, 0.4])
BOUNDS = np.array([[-3.0, -1.0, 0.0], [2.0, 5.0, 4.0]])
PLACE: dict[str, Any] = {"size": (64, 48), "fov": 50}
STEEPEST = math.radians(89)


def pinhole(up: str = "z") -> raycam.Camera:
    eye = [4, -3, 2] if up == "z" else [4, 2, 3]
    return raycam.Camera.look_at(eye, PIVOT, up, **PLACE)


CAMERAS = {
    "z up": pinhole(),
    "y up": pinhole("y"),
    "opencv": raycam.Camera.look_at([4, -3, 2], PIVOT, distortion=[-0.2, 0.05, 0, 0], **PLACE),
    "fisheye": raycam.Camera.look_at([4, -3, 2], PIVOT, distortion=[0.1, 0, 0, 0], model="fisheye", **PLACE),
    "half pixels": raycam.Camera.look_at([4, -3, 2], PIVOT, pixel_center="half", **PLACE),
}
PARALLEL = raycam.Camera.orthographic([4, -3, 2], target=[0, 0, 0], size=(64, 48), height=4)
cameras = pytest.mark.parametrize("camera", CAMERAS.values(), ids=CAMERAS)


def view_of(camera: raycam.Camera) -> View:
    """A view of an empty world at the camera's own size."""
    session = Session(raycam.World(up=camera.up), camera, size=camera.size)
    return session.view.moved(camera.R, camera.location, camera.K[0, 0], PIVOT)


def moved(camera: raycam.Camera, *calls: str) -> list[raycam.Camera]:
    """The cameras that result from calls of the client's functions, sent as `move` messages."""
    view = view_of(camera)
    state = {**view.camera_message(0), "bounds": BOUNDS.tolist()}
    script = f"const camera = {json.dumps(state)}; return [{', '.join(calls)}];"
    made = []
    for found in run_module("navigation.js", script):
        R, C = np.reshape(found["R"], (3, 3)), np.array(found["C"])
        assert np.allclose(R @ R.T, np.eye(3), atol=1e-12)
        assert np.linalg.det(R) > 0
        made.append(view.moved(R, C, found["K"][0], np.array(found["pivot"])).camera)
    return made


@cameras
def test_orbit_keeps_the_pivot_at_its_pixel_and_distance(camera: raycam.Camera) -> None:
    angles = np.random.default_rng(1).uniform(-2, 2, (40, 2))
    for turned in moved(camera, *(f"orbit(camera, {yaw}, {pitch})" for yaw, pitch in angles)):
        assert np.allclose(turned.project(PIVOT)[0], camera.project(PIVOT)[0], atol=1e-6)
        assert np.linalg.norm(turned.C - PIVOT) == pytest.approx(np.linalg.norm(camera.C - PIVOT))


@cameras
def test_orbit_keeps_the_horizon_level(camera: raycam.Camera) -> None:
    axis = 2 if camera.up == "z" else 1
    pitches = np.linspace(-10, 10, 41)
    for turned in moved(camera, *(f"orbit(camera, 0.3, {pitch})" for pitch in pitches)):
        assert abs(turned.R[0, axis]) < 1e-9
        assert turned.R[1, axis] < 0
        assert abs(turned.forward[axis]) <= math.sin(STEEPEST) + 1e-9


def test_orbit_turns_left_for_a_positive_yaw() -> None:
    camera = pinhole()
    (turned,) = moved(camera, "orbit(camera, 0.3, 0)")
    arm, before = turned.C - PIVOT, camera.C - PIVOT
    angle = math.atan2(arm[1], arm[0]) - math.atan2(before[1], before[0])
    assert angle == pytest.approx(0.3)
    assert turned.C[2] == pytest.approx(camera.C[2])


@cameras
def test_looking_around_keeps_the_centre(camera: raycam.Camera) -> None:
    (turned,) = moved(camera, "lookAround(camera, 0.5, 0.1)")
    assert np.array_equal(turned.C, camera.C)
    assert np.degrees(np.arccos(turned.forward @ camera.forward)) > 5


@cameras
def test_dolly_keeps_the_point_under_the_cursor(camera: raycam.Camera) -> None:
    point, factors = np.array([0.5, 0.3, 0.1]), np.geomspace(0.1, 10, 15)
    found = moved(camera, *(f"dolly(camera, {point.tolist()}, {factor})" for factor in factors))
    for near, factor in zip(found, factors, strict=True):
        assert np.allclose(near.project(point)[0], camera.project(point)[0], atol=1e-6)
        assert np.linalg.norm(near.C - point) == pytest.approx(np.linalg.norm(camera.C - point) / factor)


def test_dolly_of_parallel_rays_magnifies_around_the_point() -> None:
    point = np.array([0.5, 0.3, 0.1])
    (near,) = moved(PARALLEL, f"dolly(camera, {point.tolist()}, 1.5)")
    assert np.allclose(near.K[:2, :2], 1.5 * PARALLEL.K[:2, :2])
    assert np.allclose(near.project(point)[0], PARALLEL.project(point)[0])


def test_panning_moves_the_pivot_by_pixels() -> None:
    for camera in (pinhole(), PARALLEL):
        (shifted,) = moved(camera, "pan(camera, 5, -3)")
        assert np.allclose(shifted.project(PIVOT)[0] - camera.project(PIVOT)[0], [5, -3])
        assert np.array_equal(shifted.R, camera.R)


def test_flying_moves_along_right_up_and_forward() -> None:
    camera = pinhole()
    (flown,) = moved(camera, "move(camera, 1, 2, 3)")
    assert np.allclose(flown.C - camera.C, camera.R[0] + [0, 0, 2] + 3 * camera.forward)


def test_rolling_turns_about_the_principal_axis() -> None:
    camera = pinhole()
    (rolled,) = moved(camera, f"roll(camera, {math.radians(30)})")
    assert np.allclose(rolled.forward, camera.forward)
    assert abs(rolled.roll_pitch_yaw[0] - camera.roll_pitch_yaw[0]) == pytest.approx(30)


@pytest.mark.parametrize("camera", [*CAMERAS.values(), PARALLEL], ids=[*CAMERAS, "parallel"])
def test_fit_shows_the_whole_box_and_fills_the_image(camera: raycam.Camera) -> None:
    (fitted,) = moved(camera, "fit(camera, camera.bounds)")
    corners = np.array(np.meshgrid(*BOUNDS.T)).reshape(3, -1).T
    pixels, visible = fitted.project(corners)
    assert visible.all()
    assert (pixels >= camera.corner).all()
    assert (pixels <= np.array(camera.size) + camera.corner).all()
    assert (np.ptp(pixels, axis=0) / camera.size).max() > 0.4
    assert ((BOUNDS.mean(axis=0) - fitted.location) @ fitted.forward) > 0


def steps_at(x: float) -> float:
    """The height of the ground of `stairs` at x: steps of 0.2 m, then nothing."""
    return 0.2 * math.floor(x) if 0 <= x < 5 else math.nan


def stairs(up: str) -> raycam.World:
    """Boxes along x, each higher than the one before."""
    world = raycam.World(up=up)
    for i in range(5):
        height = 0.2 * i + 1
        middle, size = [i + 0.5, 0, height / 2 - 1], [1, 4, height]
        if up == "y":
            middle, size = ([each[0], each[2], -each[1]] for each in (middle, size))
        world.add_object(box={"size": np.abs(size).tolist()}, location=middle)
    return world


WALK = """
const sent = [];
const navigator = new Navigator((message) => sent.push(message), () => 1);
navigator.welcome({ ...camera, seq: 0 });
const step = async (right, upwards, forward) => {
  const walking = navigator.walk(right / navigator.step, upwards / navigator.step, forward / navigator.step);
  const { begin, end } = sent.pop();
  navigator.answer({ id: navigator.questions, below: [height(begin), height(end)] });
  await walking;
  return { C: navigator.camera.C, R: navigator.camera.R };
};
"""


@pytest.mark.parametrize("pitch", [-90, -30, 0, 60, 90])
@pytest.mark.parametrize("up", ["z", "y"])
def test_walk_keeps_the_height_of_the_eyes_on_stairs(up: str, pitch: float) -> None:
    axis = 2 if up == "z" else 1
    upwards, angle = np.eye(3)[axis], math.radians(pitch)
    right = np.cross([1, 0, 0], upwards)
    forward = np.array([math.cos(angle), 0, 0]) + math.sin(angle) * upwards
    ahead = np.array([right, np.cross(forward, right), forward])
    camera = pinhole(up).at_pose(ahead, [0.4, 0.3, 0.3] + (1.6 - 0.3) * upwards)
    state = {**view_of(camera).camera_message(0), "bounds": BOUNDS.tolist()}
    found = run_module(
        "navigator.js",
        f"const camera = {json.dumps(state)};"
        f"const height = (at) => at[{axis}] - 0.2 * Math.floor(at[0] + 0.01);" + WALK + "const made = [];"
        "for (let i = 0; i < 9; i++) made.push(await step(0, 0, 0.4));"
        "made.push(await step(0, 0.5, 0), await step(0, 0, -2), await step(0.2, 0, 0)); return made;",
    )
    for i, pose in enumerate(found[:9], 1):
        assert pose["C"][0] == pytest.approx(0.4 + 0.4 * i)
        assert pose["C"][axis] == pytest.approx(1.6 + steps_at(pose["C"][0] + 0.01), abs=1e-9)
        assert np.allclose(np.reshape(pose["R"], (3, 3)), ahead, atol=1e-12)
    taller, back, side = (np.array(each["C"]) for each in found[9:])
    assert taller[axis] == pytest.approx(found[8]["C"][axis] + 0.5)
    assert back[axis] == pytest.approx(taller[axis] - 0.4)
    assert side - back == pytest.approx(0.2 * camera.R[0], abs=1e-6)


def test_walk_stays_level_without_ground() -> None:
    camera = raycam.Camera.look_at([4.5, 0, 2.4], [9, 0, 2.4], size=(64, 48), fov=60)
    state = json.dumps({**view_of(camera).camera_message(0), "bounds": BOUNDS.tolist()})
    away, back = run_module(
        "navigator.js",
        f"const camera = {state}; const height = (at) => (at[0] < 5 ? 1.6 : null);"
        + WALK
        + "return [await step(0, 0, 5), await step(0, 0, -5)];",
    )
    assert away["C"] == pytest.approx([9.5, 0, 2.4])
    assert back["C"] == pytest.approx([4.5, 0, 2.4])


def test_ground_is_found_below_and_across_cracks() -> None:
    world, camera = stairs("z"), pinhole()
    for x in (0.4, 1.5, 4.9):
        found = probe.ground_below(world, camera, np.array([x, 0.3, 3.0]), 0.01)
        assert found == pytest.approx(3 - steps_at(x), abs=1e-5)
    assert probe.ground_below(world, camera, np.array([9.5, 0, 2.4]), 0.1) is None
    # The world has a gap of 5 cm between two floors, and a cellar far below.
    boards = raycam.World()
    for y in (-1.025, 1.025):
        boards.add_object(box={"size": [2, 2, 0.1]}, location=[0, y, -0.05])
    boards.add_object(box={"size": [9, 9, 1]}, location=[0, 0, -9])
    assert probe.ground_below(boards, camera, np.array([0, 0, 1.5]), 0.1) == pytest.approx(1.5)
    assert probe.ground_below(boards, camera, np.array([0, 0, 1.5]), 0.01) == pytest.approx(10)


NAVIGATOR = """
const sent = [];
const navigator = new Navigator((message) => sent.push(message), () => 1);
navigator.welcome({ ...camera, seq: 4 });
"""


def test_camera_of_the_server_does_not_undo_a_newer_move() -> None:
    state = json.dumps(view_of(pinhole()).camera_message(4))
    found = run_module(
        "navigator.js",
        f"const camera = {state};" + NAVIGATOR + "navigator.orbit(10, 0); const ahead = navigator.camera.C;"
        "navigator.receive({ ...camera, seq: 4 }); const late = navigator.camera.C;"
        "navigator.receive({ ...camera, seq: 5 }); return [ahead, late, navigator.camera.C, sent[0].seq];",
    )
    ahead, late, answered, seq = found
    assert ahead == late != answered
    assert (answered, seq) == (view_of(pinhole()).camera_message(4)["C"], 5)


def test_dolly_probes_once_while_the_pointer_rests() -> None:
    state = json.dumps(view_of(pinhole()).camera_message(4))
    kinds = run_module(
        "navigator.js",
        f"const camera = {state};"
        + NAVIGATOR
        + "const first = navigator.dolly(1, 9, 9); navigator.dolly(1, 9, 9);"
        "navigator.answer({ id: 1, origin: camera.C, direction: [1, 0, 0], point: [0, 0, 0], bounds: null });"
        "await first; await navigator.dolly(1, 9, 9); navigator.orbit(1, 0); navigator.dolly(1, 9, 9);"
        "return sent.map(({ type }) => type);",
    )
    assert kinds == ["locate", "move", "move", "move", "locate"]
