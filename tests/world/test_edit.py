"""Changes of worlds.

A changed world equals a world built with the change, byte for byte; refused changes have no effect.
"""

from __future__ import annotations

import copy
import json
import os
import pickle
import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raycam
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule
from support.raises import fault, raises

CAMERA = raycam.Camera.look_at([4, -5, 3], [0, 0, 0.4], [0, 0, 1], size=(24, 18), fov=45)
TURNED = np.array([[0, -1, 0, 0.4], [1, 0, 0.3, -0.2], [0, 0, 1.5, 0.7], [0, 0, 0, 1.0]])
BENT = np.array([[-1, -1, 0], [1, -1, 0.2], [1, 1, 0.1], [-1, 1, 0.6]], dtype=float)
QUAD = {"vertices": [[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], "triangles": [[0, 1, 2], [0, 2, 3]]}
ROOF = {"vertices": [[0, 0, 1], [1, 0, 0], [0, 1, 0.5]], "triangles": [[0, 1, 2]]}

Keys = dict[str, Any]


def floor() -> Keys:
    return {"plane": {"size": 6}, "name": "floor", "color": [0.7, 0.7, 0.6]}


def cup() -> Keys:
    return {"box": {"size": 0.8}, "name": "cup", "location": [0, 0, 0.5]}


def lamp() -> Keys:
    return {
        "sphere": {"radius": 0.3, "level": 2},
        "name": "lamp",
        "location": [1, 1, 1.5],
        "emission": [4, 3, 2],
    }


def built(*objects: Keys, lights: list[Keys] | None = None) -> raycam.World:
    world = raycam.World()
    for keys in objects:
        world.add_object(keys)
    for keys in [{"type": "sun", "direction": [-1, 1, -2], "irradiance": 2}] if lights is None else lights:
        world.add_light(keys)
    return world


def pictures(world: raycam.World, camera: raycam.Camera = CAMERA) -> dict[str, bytes]:
    found = {}
    for integrator in ("direct", "path"):
        frame = raycam.render(world, camera, integrator=integrator, samples=2, channels="all")
        found |= {f"{integrator} {name}": frame[name].tobytes() for name in frame}
    return found


def differing(one: raycam.World, other: raycam.World) -> list[str]:
    first, second = pictures(one), pictures(other)
    return [name for name in first if first[name] != second[name]]


CHANGES: dict[str, tuple[Callable[[raycam.World], object], list[Keys]]] = {
    "matrix": (
        lambda w: w.set_object("cup", matrix=TURNED),
        [floor(), {**cup(), "location": None, "matrix": TURNED}],
    ),
    "placement": (
        lambda w: w.set_object(1, location=[0.3, 0.2, 0.6], yaw=30, scale=[1, 2, 0.5]),
        [floor(), {**cup(), "location": [0.3, 0.2, 0.6], "yaw": 30, "scale": [1, 2, 0.5]}],
    ),
    "angles alone": (
        lambda w: w.set_object("cup", roll=20),
        [floor(), {**cup(), "location": [0, 0, 0], "roll": 20}],
    ),
    "colour": (lambda w: w.set_object("cup", color="red"), [floor(), {**cup(), "color": "red"}]),
    "type": (
        lambda w: w.set_object("cup", type="metal", metal="gold", roughness=0.2),
        [floor(), {**cup(), "type": "metal", "metal": "gold", "roughness": 0.2}],
    ),
    "shines": (lambda w: w.set_object("cup", emission=2.0), [floor(), {**cup(), "emission": 2.0}]),
    "texture": (
        lambda w: w.set_object("floor", texture=np.full((2, 2, 3), 0.3)),
        [{**floor(), "color": None, "texture": np.full((2, 2, 3), 0.3)}, cup()],
    ),
    "another mesh": (
        lambda w: w.set_object("cup", vertices=ROOF["vertices"], faces=ROOF["triangles"]),
        [floor(), {**ROOF, "name": "cup", "location": [0, 0, 0.5]}],
    ),
    "mesh with colours": (
        lambda w: w.set_object("cup", **ROOF, vertex_colors=np.eye(3)),
        [floor(), {**ROOF, "name": "cup", "location": [0, 0, 0.5], "vertex_colors": np.eye(3)}],
    ),
    "another shape": (
        lambda w: w.set_object("cup", sphere={"radius": 0.4, "level": 2}),
        [floor(), {"sphere": {"radius": 0.4, "level": 2}, "name": "cup", "location": [0, 0, 0.5]}],
    ),
    "removed": (lambda w: w.remove_object("cup"), [floor()]),
    "first removed": (lambda w: w.remove_object(0), [cup()]),
    "category": (lambda w: w.set_object("cup", category="thing"), [floor(), {**cup(), "category": "thing"}]),
    "name": (lambda w: w.set_object("cup", name="mug"), [floor(), {**cup(), "name": "mug"}]),
    "added again": (
        lambda w: (w.remove_object("cup"), w.add_object(cup())),
        [floor(), cup()],
    ),
}


def known(keys: Keys) -> Keys:
    return {name: value for name, value in keys.items() if value is not None}


@pytest.mark.parametrize("prepared", [False, True])
@pytest.mark.parametrize("name", CHANGES)
def test_changed_world_equals_a_world_built_with_the_change(name: str, prepared: bool) -> None:
    change, objects = CHANGES[name]
    world = built(floor(), cup())
    before = world.copy()
    if prepared:
        seen = pictures(world)
    change(world)
    expected = built(*map(known, objects))
    assert differing(world, expected) == []
    assert [o.name for o in world.objects] == [o.name for o in expected.objects]
    assert world.counts == expected.counts
    if prepared:
        assert pictures(before) == seen


def test_set_vertices_requires_normals_for_smooth_meshes() -> None:
    world = built(floor(), {**QUAD, "name": "quad", "location": [0, 0, 0.5]})
    raycam.render(world, CAMERA)
    world.set_object("quad", vertices=BENT)
    assert (
        differing(world, built(floor(), {**QUAD, "vertices": BENT, "name": "quad", "location": [0, 0, 0.5]}))
        == []
    )
    world = built({"sphere": {"radius": 1, "level": 1}, "name": "ball"})
    corners = world.triangles(0).reshape(-1, 3)
    count = world.counts["vertices"]
    with raises(raycam.WorldError, code="invalid_world", mentions=["normals=None"]):
        world.set_object("ball", vertices=np.zeros((count, 3)) + corners[:count])
    with raises(raycam.WorldError, code="invalid_world", mentions=[count - 1, count]):
        world.set_object("ball", vertices=corners[: count - 1], normals=None)


def test_changing_an_object_leaves_objects_with_the_same_mesh_unchanged() -> None:
    pair = [floor(), cup(), {"instance_of": "cup", "name": "second", "location": [1, 0, 0.5]}]
    world = built(*pair)
    world.set_object("second", color="blue")
    assert differing(world, built(*pair[:2], {**pair[2], "color": "blue"})) == []
    world.set_object("cup", vertices=ROOF["vertices"], faces=ROOF["triangles"])
    assert world.objects[2].triangles == 12
    assert world.objects[1].triangles == 1
    world.remove_object("cup")
    assert world.objects[1].triangles == 12
    assert world.counts["meshes"] == 2


def test_hidden_object_renders_as_removed_and_keeps_its_index() -> None:
    for extra in (lamp(), {**cup(), "location": [0.2, 0.1, 0.4], "name": "glass", "type": "glass"}):
        world = built(floor(), cup(), extra)
        raycam.render(world, CAMERA, integrator="path")
        world.set_object(extra["name"], visible=False)
        without = built(floor(), cup())
        # An unused material is still counted, but does not change the image.
        assert differing(world, without) == []
        assert not world.objects[2].visible
        assert world.bounds is not None
        assert np.array_equal(world.bounds, without.bounds)
        assert np.array_equal(world.triangles(), without.triangles())
        assert len(world.triangles(2)) > 0
        down = world.cast_rays([extra["location"][0], extra["location"][1], 9], [0, 0, -1])
        assert down["instance"] != 2
        assert not world.occluded([1, 1, 9], [0, 0, -1], 8.5)
        again = raycam.World.from_bytes(world.to_bytes())
        assert not again.objects[2].visible
        world.set_object(2, visible=True)
        assert differing(world, built(floor(), cup(), extra)) == []
    world = raycam.World.from_dict({"object": [floor(), {**cup(), "visible": False}]})
    assert [o.visible for o in world.objects] == [True, False]


LIGHTS: list[Keys] = [
    {"type": "sun", "direction": [-1, 1, -2], "irradiance": 2},
    {"type": "point", "position": [1, -1, 2], "power": [40, 30, 20]},
    {"type": "sky", "radiance": [0.2, 0.3, 0.4]},
]


def test_set_light_and_remove_light_change_the_lights() -> None:
    world = built(floor(), cup(), lights=LIGHTS)
    raycam.render(world, CAMERA)
    world.set_light(0, irradiance=[1, 2, 3])
    world.set_light(1, intensity=[4, 4, 4], radius=0.2)
    world.set_light(2, ground=[0.1, 0.1, 0.1])
    expected: list[Keys] = [
        {**LIGHTS[0], "irradiance": [1, 2, 3]},
        {"type": "point", "position": [1, -1, 2], "intensity": [4, 4, 4], "radius": 0.2},
        {"type": "sky", "zenith": [0.2, 0.3, 0.4], "horizon": [0.2, 0.3, 0.4], "ground": [0.1, 0.1, 0.1]},
    ]
    assert differing(world, built(floor(), cup(), lights=expected)) == []
    world.remove_light(1)
    assert differing(world, built(floor(), cup(), lights=[expected[0], expected[2]])) == []
    world.set_light(1, {"type": "sun", "direction": [0, 0, -1], "irradiance": 1})
    assert [light["type"] for light in world.lights] == ["sun", "sun"]
    image = np.random.default_rng(3).random((4, 8, 3))
    world.set_light(0, type="environment", image=image)
    world.set_light(0, yaw=40, scale=2)
    sky = [{"type": "environment", "image": image, "yaw": 40, "scale": 2}, world.lights[1]]
    assert differing(world, built(floor(), cup(), lights=sky)) == []


def test_set_camera_and_remove_camera_change_the_cameras() -> None:
    world = built(floor())
    world.add_camera(CAMERA, "one")
    world.add_camera(CAMERA, "two")
    other = raycam.Camera.look_at([1, -5, 3], [0, 0, 0], [0, 0, 1], size=(8, 8), fov=45)
    world.set_camera("two", other)
    assert world.camera("two") == other
    assert world.camera("one") == CAMERA
    world.remove_camera("one")
    assert list(world.cameras) == ["two"]
    with raises(raycam.WorldError, code="unknown_name"):
        world.remove_camera("tow")
    world.add_rig(raycam.Rig({"left": CAMERA, "right": other}, name="pair"))
    with raises(raycam.WorldError, code="invalid_world", mentions=['"pair/left"']):
        world.set_camera("pair/left", other)


REFUSED: dict[str, Callable[[raycam.World], object]] = {
    "name": lambda w: w.set_object("cub", color="red"),
    "number": lambda w: w.set_object(7, color="red"),
    "negative": lambda w: w.remove_object(-1),
    "both placements": lambda w: w.set_object("cup", matrix=np.eye(4), location=[0, 0, 0]),
    "flat": lambda w: w.set_object("cup", matrix=np.diag([1, 0, 1, 1.0])),
    "transposed": lambda w: w.set_object("cup", matrix=TURNED.T),
    "not finite": lambda w: w.set_object("cup", matrix=np.full((4, 4), np.nan)),
    "colour": lambda w: w.set_object("cup", color=[2, 0, 0], category="x"),
    "key": lambda w: w.set_object("cup", colour="red"),
    "goes with a type": lambda w: w.set_object("cup", metallic=0.5),
    "faces out of range": lambda w: w.set_object("cup", vertices=np.eye(3), faces=[[0, 1, 9]]),
    "file": lambda w: w.set_object("cup", mesh="nowhere.obj"),
    "nothing": lambda w: w.set_object("cup"),
    "light": lambda w: w.set_light(5, irradiance=1),
    "light key": lambda w: w.set_light(0, power=1),
    "light value": lambda w: w.set_light(0, direction=[0, 0, 0]),
    "no light": lambda w: w.remove_light(3),
    "camera": lambda w: w.set_camera("eye", CAMERA),
}


@pytest.mark.parametrize("name", REFUSED)
def test_refused_change_leaves_the_world_unchanged(name: str) -> None:
    world = built(floor(), cup())
    before = world.to_bytes(), world.notices
    with pytest.raises((raycam.WorldError, OSError)) as caught:
        REFUSED[name](world)
    assert (world.to_bytes(), world.notices) == before
    if name == "name":
        assert "cup" in str(caught.value)


def test_read_only_object_attributes_raise_with_the_method_to_use() -> None:
    thing = built(floor(), cup()).objects[1]
    for assign in (
        lambda: setattr(thing, "matrix", np.eye(4)),
        lambda: setattr(thing, "visible", False),
        lambda: thing.matrix.__setitem__((slice(3), 3), 1),
        lambda: thing.matrix[:3, 3].__iadd__(1),
    ):
        with raises(raycam.WorldError, code="read_only", mentions=["world.set_object", "'cup'"]):
            assign()
    mine = thing.matrix.copy()
    mine[:3, 3] = 1
    assert thing.matrix[0, 3] == 0


KEYFRAMES: list[Keys] = [
    {"time": 0, "object": "cup", "location": [0, 0, 0.5]},
    {"time": 2, "object": "cup", "location": [2, 0, 0.5]},
    {"time": 0, "object": "lamp", "location": [1, 1, 1.5]},
    {"time": 2, "object": "lamp", "location": [1, -1, 1.5]},
]


def test_changes_apply_to_videos_and_not_to_existing_moments() -> None:
    world = built(floor(), cup(), lamp())
    world.set_video(keyframe=KEYFRAMES)
    moment = world.at(1)
    moment.set_object("cup", matrix=TURNED)
    assert np.allclose(moment.at(2).objects[1].matrix, TURNED)
    assert np.allclose(world.at(1).objects[1].matrix[:3, 3], [1, 0, 0.5])
    world.set_object("cup", scale=2)
    assert np.allclose(world.at(1).objects[1].matrix[:3], np.c_[2 * np.eye(3), [1, 0, 0.5]])
    world.remove_object("cup")
    assert np.allclose(world.at(1).objects[1].matrix[:3, 3], [1, 0, 1.5])
    assert world.at(1).objects[1].name == "lamp"


def test_matrix_keyframes_interpolate_rotation_and_stretch() -> None:
    world = built(floor(), cup())
    turn = np.eye(4)
    turn[:3, :3] = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
    last = np.eye(4)
    last[:3, :3] = turn[:3, :3] @ np.diag([3, 1, 2])
    last[:3, 3] = [2, 0, 1]
    keys = [{"time": t, "object": "cup", "matrix": m} for t, m in ((0, np.eye(4)), (2, last))]
    world.set_video(keyframe=keys, interpolation="linear")
    for time, expected in ((0, np.eye(4)), (2, last)):
        assert np.allclose(world.at(time).objects[1].matrix, expected, atol=1e-12)
    half = world.at(1).objects[1].matrix
    stretch = np.diag([2, 1, 1.5])
    eighth = np.array([[1, -1, 0], [1, 1, 0], [0, 0, np.sqrt(2)]]) / np.sqrt(2)
    assert np.allclose(half[:3, :3], eighth @ stretch, atol=1e-12)
    assert np.allclose(half[:3, 3], [1, 0, 0.5])
    mirrored = np.diag([1, -1, 1, 1.0])
    for bad, said in (
        ([{**keys[0], "matrix": mirrored}], fault("invalid_matrix", "keyframe[0].matrix")),
        ([keys[0], {"time": 1, "object": "cup", "yaw": 3}], fault("conflicting_values", "[1]")),
        ([{**keys[0], "location": [0, 0, 0]}], fault("conflicting_values", "matrix")),
        ([{"time": 0, "matrix": np.eye(4)}], fault("conflicting_values", "[0]")),
    ):
        with raises(raycam.WorldError, **said):
            world.set_video(keyframe=bad)


def test_concurrent_images_show_a_consistent_state() -> None:
    world = built(floor(), cup())
    places = [[0.1 * i, 0, 0.5] for i in range(8)]
    states = [built(floor(), {**cup(), "location": place}) for place in places]
    allowed = {raycam.render(state, CAMERA, channels="depth")["depth"].tobytes() for state in states}
    world.set_object("cup", location=places[0])
    seen: list[bytes] = []
    done = threading.Event()

    def look() -> None:
        while not done.is_set() or len(seen) < 10:
            seen.append(raycam.render(world, CAMERA, channels="depth")["depth"].tobytes())

    threads = [threading.Thread(target=look) for _ in range(2)]
    for thread in threads:
        thread.start()
    for i in range(60):
        world.set_object("cup", location=places[i % 8])
    done.set()
    for thread in threads:
        thread.join()
    assert set(seen) <= allowed


def test_moments_and_copies_of_an_unrendered_world_share_their_trees() -> None:
    """The first `at` of an unrendered world builds the mesh's tree, and the second reuses it."""
    world = built(floor(), lamp(), cup())
    world.set_video(keyframe=[KEYFRAMES[0], KEYFRAMES[1]])
    first, second = world.at(0.5), world.at(1.5)
    assert first._core.objects_shared_with(second._core) == 3
    assert world.copy()._core.objects_shared_with(second._core) == 3


@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="threads can be counted only in /proc")
def test_small_queries_start_no_threads() -> None:
    code = """
import os, raycam
world = raycam.World()
world.add_object(box={"size": 1}, name="box")
world.add_object(plane={"size": 4}, location=[0, 0, -0.5])
world.prepare(threads=1)
camera = raycam.Camera.look_at([3, -4, 2], [0, 0, 0], [0, 0, 1], size=(48, 48), fov=40)
before = set(os.listdir("/proc/self/task"))
for i in range(20):
    world.set_object("box", location=[0.01 * i + 0.01, 0, 0])
    raycam.render(world, camera, channels=["depth", "instance"])
    world.cast_rays([0, 0, 9], [0, 0, -1])
    world.occluded([0, 0, 9], [0, 0, -1])
    world.intersections([0, 0, 9], [0, 0, -1])
    world.count_intersections([0, 0, 9], [0, 0, -1])
    world.visible([0, 0, 9], [0, 0, 1])
    world.closest_points([[0, 0, 2], [0, 1, 2]])
    world.distance([0, 0, 2])
    world.inside([0, 0, 2], objects=["box"])
print(len(set(os.listdir("/proc/self/task")) - before))
"""
    env = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, env=env)
    assert done.stdout.strip() == "0"


SHAPES: list[Keys] = [
    {"box": {"size": 0.6}},
    {"sphere": {"radius": 0.4, "level": 1}},
    {"plane": {"size": 2}},
    {"cone": {"radius": 0.4, "height": 0.8, "segments": 8}},
]
NAMES = ["a", "b", "c"]
PLACES = st.tuples(*[st.integers(-8, 8).map(lambda n: n / 8)] * 3).map(list)


class Edits(RuleBasedStateMachine):
    """Random changes of a world, with a list of the expected objects and lights."""

    def __init__(self) -> None:
        super().__init__()
        self.world = raycam.World()
        self.objects: list[Keys] = []
        self.lights: list[Keys] = []

    @precondition(lambda self: len(self.objects) < 3)
    @rule(shape=st.sampled_from(SHAPES), place=PLACES)
    def add(self, shape: Keys, place: list[float]) -> None:
        name = next(name for name in NAMES if all(o["name"] != name for o in self.objects))
        keys = {**shape, "name": name, "location": place}
        self.world.add_object(keys)
        self.objects.append(keys)

    @precondition(lambda self: self.objects)
    @rule(data=st.data(), place=PLACES, yaw=st.sampled_from([None, 30.0]))
    def move(self, data: st.DataObject, place: list[float], yaw: float | None) -> None:
        i = data.draw(st.integers(0, len(self.objects) - 1))
        keys = {"location": place} if yaw is None else {"location": place, "yaw": yaw}
        self.world.set_object(self.objects[i]["name"], **keys)  # type: ignore[arg-type]
        self.objects[i] = {k: v for k, v in self.objects[i].items() if k not in ("location", "yaw")} | keys

    @precondition(lambda self: self.objects)
    @rule(
        data=st.data(),
        color=st.sampled_from([[1, 0, 0], [0.2, 0.4, 0.6]]),
        emission=st.sampled_from([0, 1.5]),
    )
    def paint(self, data: st.DataObject, color: list[float], emission: float) -> None:
        i = data.draw(st.integers(0, len(self.objects) - 1))
        self.world.set_object(i, color=color, emission=emission)
        self.objects[i] |= {"color": color, "emission": emission}

    @precondition(lambda self: self.objects)
    @rule(data=st.data(), visible=st.booleans())
    def show(self, data: st.DataObject, visible: bool) -> None:
        i = data.draw(st.integers(0, len(self.objects) - 1))
        self.world.set_object(i, visible=visible)
        self.objects[i] |= {"visible": visible}

    @precondition(lambda self: self.objects)
    @rule(data=st.data(), shape=st.sampled_from(SHAPES))
    def reshape(self, data: st.DataObject, shape: Keys) -> None:
        i = data.draw(st.integers(0, len(self.objects) - 1))
        self.world.set_object(i, **shape)  # type: ignore[arg-type]
        kept = {k: v for k, v in self.objects[i].items() if not any(k in other for other in SHAPES)}
        self.objects[i] = {**shape, **kept}

    @precondition(lambda self: self.objects)
    @rule(data=st.data())
    def remove(self, data: st.DataObject) -> None:
        i = data.draw(st.integers(0, len(self.objects) - 1))
        self.world.remove_object(i)
        del self.objects[i]

    @precondition(lambda self: len(self.lights) < 2)
    @rule(light=st.sampled_from(LIGHTS))
    def shine(self, light: Keys) -> None:
        self.world.add_light(light)
        self.lights.append(dict(light))

    @precondition(lambda self: self.lights)
    @rule()
    def darken(self) -> None:
        self.world.remove_light(0)
        del self.lights[0]

    @rule()
    def copy(self) -> None:
        self.world = self.world.copy()

    @invariant()
    def shows_what_it_is(self) -> None:
        expected = built(*self.objects, lights=self.lights)
        assert self.world.to_bytes() == expected.to_bytes()
        if self.objects:
            assert picture(self.world) == picture(expected)


def picture(world: raycam.World) -> list[bytes]:
    frame = raycam.render(world, CAMERA, integrator="path", samples=1, region=(6, 4, 12, 10), channels="all")
    return [frame[name].tobytes() for name in frame]


TestEdits = Edits.TestCase
TestEdits.settings = settings(
    max_examples=8, stateful_step_count=10, deadline=None, suppress_health_check=list(HealthCheck)
)


def test_read_only_tables_raise_with_the_method_to_use() -> None:
    world = raycam.World()
    world.add_object(box={"size": 1}, name="cup")
    world.add_light("sun", direction=[0, 0, -1], irradiance=2)
    camera = raycam.Camera.look_at([0, 3, 3], [0, 0, 0], fov=40, size=(4, 4))
    world.add_camera(camera, "front")
    before = world.to_bytes()
    changes: list[tuple[str, Any]] = [
        (fault("read_only", "set_light"), lambda: world.lights[0].update(irradiance=3)),
        (fault("read_only", "set_light"), lambda: world.lights[0].__setitem__("irradiance", 3)),
        (fault("read_only", "remove_light"), lambda: world.lights.pop()),
        (fault("read_only", "add_light"), lambda: world.lights.append({})),
        (fault("read_only", "remove_object"), lambda: world.objects.clear()),
        (fault("read_only", "add_object"), lambda: world.objects.__setitem__(0, None)),
        (fault("read_only", "set_camera"), lambda: world.cameras.__setitem__("front", camera)),
        (fault("read_only", "remove_camera"), lambda: world.cameras.pop("front")),
    ]
    for way, change in changes:
        with raises(raycam.WorldError, **way):
            change()
    assert world.to_bytes() == before
    light = copy.deepcopy(world.lights)[0]
    light["irradiance"] = 3
    assert type(light) is dict
    assert pickle.loads(pickle.dumps(world.lights)) == world.lights
    assert json.loads(json.dumps(world.lights)) == world.lights


@pytest.mark.parametrize("which", [0.5, None, True, ["cup"], np.array([0, 1])])
def test_invalid_object_references_raise_world_errors(which: Any) -> None:
    world = raycam.World()
    world.add_object(box={"size": 1}, name="cup")
    camera = raycam.Camera.look_at([0, 3, 3], [0, 0, 0], fov=40, size=(4, 4))
    calls = [
        lambda: world.set_object(which, visible=False),
        lambda: world.remove_object(which),
        lambda: world.set_camera(which, camera),
        lambda: world.set_camera("camera", which),
        lambda: world.remove_camera(which),
    ]
    if which is None or isinstance(which, float | bool):
        calls += [lambda: world.topology(which), lambda: world.inside([0, 0, 0], objects=which)]
    for call in calls if which is not None else calls[:-1]:
        with pytest.raises(raycam.WorldError):
            call()
    assert world.inside([0, 0, 0], objects=np.array(0))
    assert world.inside([0, 0, 0], objects=np.array([0]))
