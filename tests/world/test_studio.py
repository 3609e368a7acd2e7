"""The studio: floor, soft shadow and ground truth.

Grounds and targets of lights are checked, too.
"""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
import pytest
import raycam
from raycam.world.studio import FLOOR
from support.raises import fault, raises


def bare(up: Literal["z", "y"] = "z", scale: float = 1.0) -> raycam.World:
    world = raycam.World(up=up)
    world.add_object(sphere={"radius": scale}, color="tomato")
    return world


@pytest.mark.parametrize("up", ["z", "y"])
@pytest.mark.parametrize("scale", [1.0, 1e-4, 1e5])
def test_world_without_lights_has_a_soft_studio_shadow(up: Literal["z", "y"], scale: float) -> None:
    world = bare(up, scale)
    frame = raycam.render(world)
    assert any(notice.code == "studio" for notice in frame.notices)
    assert frame.view == "pbr_neutral"
    color, ground = frame["color"], frame["instance"] < 0
    corner = color[:40, :40].reshape(-1, 3)
    # A corner shows the floor or the room, which look the same.
    np.testing.assert_allclose(corner.mean(axis=0), FLOOR, rtol=0.01)
    shadow = color[ground].mean(axis=1)
    assert shadow.min() < 0.5 * FLOOR
    assert np.isinf(frame["depth"][ground]).all()
    assert set(np.unique(frame["instance"])) == {-1, 0}
    assert len(world.lights) == 0
    assert len(world.objects) == 1


def size_camera(world: raycam.World) -> raycam.Camera:
    return world.default_camera((64, 48))


@pytest.mark.parametrize("up", ["z", "y"])
def test_studio_floor_and_room_have_equal_radiance(up: Literal["z", "y"]) -> None:
    world = bare(up)
    camera = world.view_from("default", size=(160, 120), zoom=0.15)
    world.add_studio(camera)
    frame = raycam.render(world, camera, integrator="path", max_depth=6, samples=64, channels="all")
    floor = frame["instance"] == 1
    far = floor & (frame["distance"] > np.quantile(frame["distance"][floor], 0.8))
    room = (frame["instance"] < 0) & (frame["coverage"] == 1)
    assert floor.any()
    assert room.any()
    np.testing.assert_allclose(frame["color"][room], FLOOR, rtol=2e-3)
    np.testing.assert_allclose(frame["color"][far].mean(axis=0), FLOOR, rtol=0.02)


@pytest.mark.parametrize("irradiance", [0.2, 1.5])
def test_studio_without_key_light_continues_the_floor_under_a_sun(irradiance: float) -> None:
    world = bare()
    camera = world.view_from("default", size=(160, 120), zoom=0.15)
    world.add_light("sun", direction=[1, 2, -3], irradiance=irradiance)
    world.add_studio(camera, key=False)
    assert [light["type"] for light in world.lights] == ["sun", "environment"]
    frame = raycam.render(world, camera, integrator="path", max_depth=6, samples=64, channels="all")
    floor = frame["instance"] == 1
    far = floor & (frame["distance"] > np.quantile(frame["distance"][floor], 0.8))
    room = (frame["instance"] < 0) & (frame["coverage"] == 1)
    assert np.ptp(frame["color"][room]) < 1e-6
    np.testing.assert_allclose(frame["color"][far].mean(axis=0), frame["color"][room][0], rtol=0.02)


def test_studio_room_keeps_its_brightness_at_another_exposure() -> None:
    images = []
    for stops in (0, -3):
        world = bare()
        world.add_light("sun", direction=[1, 2, -3], irradiance=1.5 * 2.0**-stops)
        camera = size_camera(world)
        world.add_studio(camera, key=False, exposure=stops)
        images.append(raycam.render(world, camera, integrator="path", samples=2)["color"] * 2.0**stops)
    np.testing.assert_allclose(images[1], images[0], rtol=1e-5)


def test_metal_in_the_studio_reflects_lights_and_floor() -> None:
    world = raycam.World()
    world.add_object(sphere={"level": 5}, type="metal", metal="gold", roughness=0.1)
    frame = raycam.render(world)
    seen = frame["color"][frame["instance"] == 0].mean(axis=1)
    assert np.quantile(seen, 0.05) > 0.03
    assert seen.max() > 4 * np.median(seen)


def test_studio_is_used_only_for_worlds_without_lights_and_cameras(tmp_path: Any) -> None:
    world = bare()
    camera = size_camera(world)

    def in_studio(world: raycam.World, *camera: raycam.Camera, **options: Any) -> bool:
        frame = raycam.render(world, *camera, samples=1, **options)
        return any(notice.code == "studio" for notice in frame.notices)

    assert in_studio(world)
    assert not in_studio(world, camera)
    assert not in_studio(world, integrator="flat")
    assert not in_studio(world, channels="depth")
    lit = bare()
    lit.add_light("sky", radiance=1)
    assert not in_studio(lit)
    seen = bare()
    seen.add_camera(camera)
    assert not in_studio(seen)
    shining = bare()
    shining.add_object(box={}, location=[0, 0, 2], emission=5)
    assert not in_studio(shining)


def test_given_settings_override_those_of_the_studio() -> None:
    frame = raycam.render(bare(), view="standard", samples=1, max_depth=2, exposure=1)
    assert (frame.view, frame.exposure) == ("standard", 1)
    clear = raycam.render(bare(), transparent_background=True, samples=2)
    assert (clear["alpha"] == 0).any()
    assert clear["alpha"][clear["instance"] == 0].mean() > 0.95
    left = raycam.render(bare(), region=(0, 0, 320, 480), samples=2, channels=["color", "depth"])
    right = raycam.render(bare(), region=(320, 0, 320, 480), samples=2, channels=["color", "depth"])
    whole = raycam.render(bare(), samples=2, channels=["color", "depth"])
    for name in ("color", "depth"):
        np.testing.assert_array_equal(raycam.Frame.merge([left, right])[name], whole[name])


def test_studio_seen_from_below_has_no_floor() -> None:
    world = bare()
    world.add_studio(world.view_from("bottom"))
    assert len(world.objects) == 1
    assert len(world.lights) == 2


@pytest.mark.parametrize("up", ["z", "y"])
def test_add_ground_places_a_plane_below_the_objects(up: Literal["z", "y"]) -> None:
    world = bare(up)
    axis = 2 if up == "z" else 1
    first, second = world.add_ground(), world.add_ground(height=-3, size=4, color="green")
    assert [world.objects[item].name for item in (first, second)] == ["ground", "ground1"]
    corners = world.triangles(first).reshape(-1, 3)
    assert corners[:, axis].max() < -1
    np.testing.assert_allclose(corners[:, axis], -1, atol=1e-3)
    corners = world.triangles(second).reshape(-1, 3)
    np.testing.assert_allclose(corners[:, axis], -3)
    np.testing.assert_allclose(np.ptp(np.delete(corners, axis, 1), axis=0), 4)
    normal = np.cross(*np.diff(world.triangles(second)[0], axis=0))
    assert normal[axis] > 0
    with raises(raycam.WorldError, code="missing_value"):
        raycam.World().add_ground()


@pytest.mark.parametrize("up", ["z", "y"])
def test_lights_accept_a_target(up: Literal["z", "y"]) -> None:
    world = raycam.World(up=up)
    world.add_object(box={"size": 2}, location=[1, 2, 3], name="crate")
    place = np.array([4.0, -2, 7])
    for kind, keys in (
        ("spot", {"power": 5}),
        ("disk", {"radius": 1, "radiance": 2}),
        ("sun", {"irradiance": 2}),
    ):
        world.add_light(kind, position=place, target=[1, 2, 3], **keys)  # type: ignore[misc]
        np.testing.assert_allclose(world.lights[-1]["direction"], [-3, 4, -4])
        world.add_light(kind, position=place, target="crate", **keys)  # type: ignore[misc]
        np.testing.assert_allclose(world.lights[-1]["direction"], [-3, 4, -4])
    world.add_light("area", position=place, target="crate", size=[2, 1], radiance=3)
    u, v = np.array(world.lights[-1]["u"]), np.array(world.lights[-1]["v"])
    way = np.array([-3, 4, -4]) / np.sqrt(41)
    np.testing.assert_allclose(np.cross(u, v), 2 * way, atol=1e-12)
    assert (np.linalg.norm(u), np.linalg.norm(v)) == (pytest.approx(2), pytest.approx(1))
    for keys, said in (
        ({"type": "point", "power": 1}, fault("invalid_value", "'point'")),
        ({"type": "spot", "power": 1, "direction": [0, 0, 1]}, fault("conflicting_values")),
        ({"type": "spot", "power": 1, "position": [1, 2, 3]}, fault("invalid_value", "[1.0, 2.0, 3.0]")),
        ({"type": "sun", "irradiance": 1, "position": None}, fault("missing_value")),
    ):
        given = {"position": place, "target": [1, 2, 3], **keys}
        given = {key: value for key, value in given.items() if value is not None}
        with raises(raycam.WorldError, **said):
            world.add_light(given)
    with raises(raycam.WorldError, code="unknown_name", mentions=["'crate'"]):
        world.add_light("spot", position=place, target="crat", power=1)
