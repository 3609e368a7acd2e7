"""Lights and objects that are hidden from camera, shadow or reflection rays."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raycam

TRUTH = ("depth", "instance", "position", "normal", "coverage")


def scene(light: dict[str, Any] | None = None, ball: dict[str, Any] | None = None) -> raycam.World:
    """A floor and a ball under an area light; `ball=None` omits the ball."""
    world = raycam.World()
    world.add_object(plane={"size": 8}, name="floor", color=[0.6, 0.6, 0.6])
    panel = {"type": "area", "position": [0, 0, 2.5], "u": [1, 0, 0], "v": [0, -1, 0], "radiance": 5}
    world.add_light(panel | (light or {}))
    if ball is not None:
        world.add_object(
            sphere={"radius": 0.4}, location=[0.2, 0, 0.9], name="ball", color=[0.9, 0.3, 0.2], **ball
        )
    return world


def camera() -> raycam.Camera:
    return raycam.Camera.look_at([0, -5, 1.4], [0, 0, 1.2], size=(64, 48), fov=45)


def color(world: raycam.World, view: raycam.Camera | None = None, **options: Any) -> np.ndarray:
    settings: dict[str, Any] = {"integrator": "path", "samples": 256, **options}
    return np.asarray(raycam.render(world, view or camera(), **settings)["color"])


def floor(world: raycam.World) -> np.ndarray:
    """Pixels that show only the floor, in a world with a ball."""
    frame = raycam.render(world, camera(), channels=["instance", "coverage"], samples=64)
    return np.asarray((frame["instance"] == 0) & (frame["coverage"] == 1))


def test_a_lamp_hidden_from_the_camera_illuminates_but_is_not_shown() -> None:
    shown, hidden = scene(), scene({"visible": {"camera": False}})
    images = color(shown), color(hidden)
    lamp = images[0].min(axis=2) > 4
    lamp[24:] = False
    assert lamp.sum() > 20
    assert (images[1][lamp] == 0).all()
    np.testing.assert_array_equal(images[0][30:], images[1][30:])
    assert images[1][30:].max() > 0.1


def test_a_lamp_without_reflection_is_missing_in_mirrors_only() -> None:
    def world(**light: Any) -> raycam.World:
        made = raycam.World()
        made.add_object(plane={"size": 8}, type="metal", metal="silver", roughness=0)
        made.add_object(plane={"size": 2}, location=[2.2, -0.5, 0.1], color=[1, 1, 1])
        panel = {"type": "area", "position": [0, 1.5, 1.2], "u": [2, 0, 0], "v": [0, 0, 1], "radiance": 5}
        made.add_light({**panel, "two_sided": True, **light})
        return made

    usual, hidden = color(world()), color(world(visible={"reflection": False}))
    matte = raycam.render(world(), camera(), channels="instance", samples=1)["instance"] == 1
    assert (usual != hidden).any()
    assert ((usual - hidden)[~matte].min(axis=1) >= 0).all()
    assert (usual - hidden).max() > 3
    np.testing.assert_array_equal(usual[:12], hidden[:12])
    # The matte plane receives less light from the mirror, but the same amount directly from the lamp.
    assert 0.9 * usual[matte].mean() < hidden[matte].mean() < usual[matte].mean()


def test_one_environment_illuminates_while_another_is_the_background() -> None:
    world = scene()
    world.remove_light(0)
    world.add_light(type="sky", zenith=[2, 1, 0.5], horizon=[1, 1, 1], visible={"camera": False})
    world.add_light(
        type="sky", radiance=[0.1, 0.2, 0.3], visible={"light": False, "reflection": False}, name="background"
    )
    lit = scene()
    lit.set_light(0, type="sky", zenith=[2, 1, 0.5], horizon=[1, 1, 1])
    split, usual = color(world), color(lit)
    sky = ~np.isfinite(raycam.render(lit, camera(), channels="depth", samples=1)["depth"])
    sky[:-1] &= sky[1:]
    np.testing.assert_allclose(split[sky], np.broadcast_to([0.1, 0.2, 0.3], split[sky].shape), rtol=1e-6)
    np.testing.assert_array_equal(split[40:], usual[40:])
    flat = color(world, integrator="flat", samples=1)
    np.testing.assert_allclose(flat[sky], np.broadcast_to([0.1, 0.2, 0.3], flat[sky].shape), rtol=1e-6)
    names = ["color", "light:sky", "light:background", "light:surfaces"]
    frame = raycam.render(world, camera(), integrator="path", samples=4, channels=names)
    np.testing.assert_allclose(sum(frame[name] for name in names[1:]), frame["color"], rtol=2e-6, atol=1e-6)
    assert (frame["light:background"][40:] == 0).all()


def test_visibility_is_part_of_the_description_of_a_light() -> None:
    world = scene({"visible": {"camera": False}, "name": "panel"})
    assert world.lights[0]["visible"] == {"camera": False, "reflection": True, "light": True}
    assert world.lights[0]["name"] == "panel"
    again = raycam.World()
    again.add_light(world.lights[0])
    assert again.lights == world.lights
    assert "visible" not in scene().lights[0]
    with pytest.raises(raycam.errors.Error, match="camara"):
        scene({"visible": {"camara": False}})


@pytest.mark.parametrize("samples", [1, 16])
@pytest.mark.parametrize("integrator", ["flat", "ao", "direct", "path"])
def test_an_object_hidden_from_the_camera_is_missing_in_images_and_ground_truth(
    integrator: str, samples: int
) -> None:
    options: dict[str, Any] = {
        "integrator": integrator,
        "samples": samples,
        "channels": ["color", "alpha", *TRUTH],
    }
    hidden = raycam.render(scene(ball={"visible": {"camera": False}}), camera(), **options)
    without = raycam.render(scene(), camera(), **options)
    for name in TRUTH:
        np.testing.assert_allclose(hidden[name], without[name], rtol=1e-12, atol=1e-12)
    np.testing.assert_array_equal(hidden["alpha"], without["alpha"])
    if integrator == "flat":
        np.testing.assert_allclose(hidden["color"], without["color"], rtol=1e-6)


def test_an_object_hidden_from_the_camera_casts_its_shadow() -> None:
    world = scene(ball={})
    shown = floor(world)
    usual, hidden = color(world), color(scene(ball={"visible": {"camera": False}}))
    np.testing.assert_allclose(hidden[shown].mean(), usual[shown].mean(), rtol=0.01)
    dark = usual[shown].sum(axis=1) < 0.5 * color(scene())[shown].sum(axis=1)
    assert dark.sum() > 20
    np.testing.assert_allclose(hidden[shown][dark].mean(), usual[shown][dark].mean(), rtol=0.05)


@pytest.mark.parametrize("light", ["area", "bulb", "point", "sky", "gradient", "sun", "mesh"])
@pytest.mark.parametrize("integrator", ["direct", "path"])
def test_an_object_without_a_shadow_does_not_darken_the_floor(light: str, integrator: str) -> None:
    lights: dict[str, dict[str, Any]] = {
        "area": {},
        "bulb": {"type": "bulb", "position": [0, 0, 2.5], "power": 100, "radius": 0.4},
        "point": {"type": "bulb", "position": [0, 0, 2.5], "power": 100},
        "sky": {"type": "sky", "radiance": 1},
        "gradient": {"type": "sky", "zenith": [1, 1, 1], "horizon": [0.2, 0.2, 0.2]},
        "sun": {"type": "sun", "direction": [0.1, 0.1, -1], "irradiance": 3, "angular_diameter": 20},
        "mesh": {"type": "sky", "radiance": 0},
    }

    def world(ball: dict[str, Any] | None) -> raycam.World:
        made = scene(ball=ball)
        if light != "area":
            made.set_light(0, **lights[light])
        if light == "mesh":
            made.add_object(box={"size": [1, 1, 0.1]}, location=[0, 0, 2.5], emission=5)
        return made

    options: dict[str, Any] = {"integrator": integrator, "samples": 1024}
    if integrator == "path":
        options["max_depth"] = 2
    else:
        options["ambient_occlusion"] = True
    shown = floor(world({}))
    without, shadowless, usual = (
        color(world(ball), **options)[shown] for ball in (None, {"visible": {"shadow": False}}, {})
    )
    np.testing.assert_allclose(shadowless.mean(), without.mean(), rtol=0.005)
    assert usual.mean() < 0.99 * without.mean()
    ids = raycam.render(world({"visible": {"shadow": False}}), camera(), channels="instance")["instance"]
    assert (ids == 1).any()


@pytest.mark.parametrize("light", ["area", "sky", "mesh"])
def test_an_object_without_reflection_keeps_its_shadow(light: str) -> None:
    def world(ball: dict[str, Any]) -> raycam.World:
        made = scene(ball=ball)
        if light != "area":
            made.set_light(0, type="sky", zenith=[1, 1, 1], horizon=[0.5, 0.5, 0.5])
        if light == "mesh":
            made.set_light(0, type="sky", radiance=0)
            made.add_object(box={"size": [1, 1, 0.1]}, location=[0, 0, 2.5], emission=5)
        return made

    shown = floor(world({}))
    options = {"samples": 1024, "max_depth": 2}
    usual = color(world({}), **options)[shown]
    hidden = color(world({"visible": {"reflection": False}}), **options)[shown]
    np.testing.assert_allclose(hidden.mean(), usual.mean(), rtol=0.005)


def test_an_emissive_object_without_reflection_illuminates_other_objects() -> None:
    def world(visible: Any) -> raycam.World:
        made = scene()
        made.set_light(0, type="sky", radiance=0)
        made.add_object(box={"size": [1, 1, 0.1]}, location=[0, 0, 2.5], emission=5, visible=visible)
        return made

    options = {"samples": 1024, "max_depth": 2}
    usual, hidden = (color(world(visible), **options)[30:] for visible in (True, {"reflection": False}))
    np.testing.assert_allclose(hidden.mean(), usual.mean(), rtol=0.005)


def test_a_mirror_shows_only_objects_with_reflection() -> None:
    def world(visible: Any) -> raycam.World:
        made = raycam.World()
        made.add_object(plane={"size": 8}, type="metal", metal="silver", roughness=0)
        made.add_object(sphere={"radius": 0.4}, location=[0, 0, 1.5], emission=3, visible=visible)
        made.add_light(type="sky", radiance=0.1)
        return made

    view = raycam.Camera.look_at([0, -4, 1.2], [0, 0, 0.4], size=(64, 48), fov=60)
    usual, hidden, unseen = (color(world(v), view) for v in (True, {"reflection": False}, {"camera": False}))
    ball = raycam.render(world(True), view, channels=["instance", "coverage"], samples=64)
    ball = (ball["instance"] == 1) & (ball["coverage"] == 1)
    assert (usual[30:] > 1).any()
    assert not (hidden[30:] > 1).any()
    assert (hidden[ball] > 1).all()
    np.testing.assert_allclose(unseen[30:].mean(), usual[30:].mean(), rtol=0.02)
    assert not (unseen[ball] > 1).any()


def test_media_are_visible_through_hidden_objects() -> None:
    def world(ball: dict[str, Any] | None) -> raycam.World:
        made = scene(ball=ball)
        made.set_fog(extinction=0.15, albedo=0.9, height=4)
        return made

    options = {"samples": 512, "max_depth": 2}
    shown = floor(world({}))
    without = color(world(None), **options)[shown]
    shadowless = color(world({"visible": {"shadow": False}}), **options)[shown]
    np.testing.assert_allclose(shadowless.mean(), without.mean(), rtol=0.01)
    hidden = color(world({"visible": {"camera": False}}), **options)[shown]
    usual = color(world({}), **options)[shown]
    np.testing.assert_allclose(hidden.mean(), usual.mean(), rtol=0.01)


def test_keypoints_ignore_objects_hidden_from_the_camera() -> None:
    for visible, is_seen in [(True, False), ({"camera": False}, True), ({"shadow": False}, False)]:
        world = scene()
        world.add_object(box={"size": 1}, location=[0, -2, 0.6], visible=visible)
        found = raycam.keypoints(world, camera(), [[0, 0, 0]], [0])
        assert bool(found.visible[0]) == is_seen


def test_world_files_define_the_visibility_of_objects_and_lights(tmp_path: Path) -> None:
    (tmp_path / "a.toml").write_text(
        """
[[object]]
plane = { size = 2 }
visible = { camera = false }

[[light]]
type = "sun"
name = "noon"
direction = [0, 0, -1]
lux = 100000
visible = { camera = false }
"""
    )
    world = raycam.load(tmp_path / "a.toml")
    frame = raycam.render(world, camera(), channels="instance")
    assert (frame["instance"] == -1).all()
    assert world.lights[0]["name"] == "noon"
    (tmp_path / "b.toml").write_text("[[object]]\nsphere = { radius = 1 }\nvisible = { shadows = false }\n")
    with pytest.raises(raycam.errors.Error, match=r"object\[0\].visible"):
        raycam.load(tmp_path / "b.toml")
