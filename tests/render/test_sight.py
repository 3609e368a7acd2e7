"""Notices about images that show nothing, are black, or are almost entirely white."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raycam
from support.raises import raises

CAMERA = raycam.Camera.look_at([3, -4, 2], [0, 0, 0], [0, 0, 1], size=(64, 48), fov=40)
AWAY = raycam.Camera.look_at([3, -4, 2], [6, -8, 4], [0, 0, 1], size=(64, 48), fov=40)


def lit_world(**keys: Any) -> raycam.World:
    world = raycam.World()
    world.add_object(sphere={}, **keys)
    world.add_light("sun", direction=[-1, 1, -1], irradiance=1)
    return world


def codes_of(world: raycam.World, camera: raycam.Camera = CAMERA, **options: Any) -> list[str]:
    return [notice.code for notice in raycam.render(world, camera, samples=4, **options).notices]


def said(world: raycam.World, camera: raycam.Camera = CAMERA, **options: Any) -> str:
    return "\n".join(map(str, raycam.render(world, camera, samples=4, **options).notices))


@pytest.mark.parametrize("channels", ["color", "depth", "instance", ["color", "triangle"], "normal"])
@pytest.mark.parametrize("integrator", ["flat", "direct", "path"])
def test_camera_that_shows_nothing_gives_a_notice(channels: Any, integrator: str) -> None:
    assert "nothing_visible" in codes_of(lit_world(), AWAY, channels=channels, integrator=integrator)
    assert said(lit_world(), CAMERA, channels=channels, integrator=integrator) == ""


def test_empty_world_with_a_sky_gives_a_notice() -> None:
    world = raycam.World()
    world.add_light("sky", radiance=0.5)
    assert "nothing_visible" in codes_of(world, channels="color")


def test_single_visible_pixel_prevents_the_notice() -> None:
    world = raycam.World()
    world.add_object(sphere={"radius": 0.09})
    world.add_light("sky", radiance=0.5)
    counted = raycam.render(world, CAMERA, samples=1, channels="instance")["instance"] >= 0
    assert 0 < counted.sum() < 12
    assert said(world, channels="color") == ""


@pytest.mark.parametrize("integrator", ["direct", "path"])
def test_scene_without_lit_surfaces_gives_a_notice(integrator: str, tmp_path: Path) -> None:
    dark: list[raycam.World] = []
    below = raycam.World()
    below.add_object(plane={"size": 8})
    below.add_light("sun", direction=[0, 0, 1], irradiance=3)  # this sun shines from below
    dark.append(below)
    turned = raycam.World()
    turned.add_object(sphere={})
    # This light emits upwards.
    turned.add_light("area", position=[0, 0, 3], u=[1, 0, 0], v=[0, 1, 0], radiance=4)
    dark.append(turned)
    dark.append(lit_world(color=[0, 0, 0]))
    for world in dark:
        assert "nothing_lit" in codes_of(world, integrator=integrator)
        assert "nothing_lit" in codes_of(world, integrator=integrator, channels="color")
    assert "nothing_lit" not in codes_of(lit_world(color="black", specular=0.5), integrator=integrator)
    assert said(lit_world(color="black"), integrator="flat") == ""


def test_partly_lit_object_gives_no_notice() -> None:
    world = raycam.World()
    world.add_object(sphere={})
    # The sun is behind the sphere, so that only a thin crescent is lit.
    world.add_light("sun", direction=[3, -4, 0.4], irradiance=3)
    assert said(world, integrator="direct", channels="color") == ""


@pytest.mark.parametrize("power", [3, 7, 10])
def test_overexposed_image_gives_a_notice_with_an_exposure(power: int) -> None:
    world = raycam.World()
    world.add_object(plane={"size": 80})
    world.add_light("sky", radiance=0.5 * 2.0**power)
    camera = raycam.Camera.look_at([0.1, 0, 5], [0, 0, 0], [0, 0, 1], size=(32, 24), fov=40)
    notice = said(world, camera)
    assert str(notice).startswith("100 %")
    stops = float(str(notice).split("exposure=")[1].split()[0])
    shown = raycam.render(world, camera, samples=4, exposure=stops)
    assert not shown.notices
    assert 60 < np.median(shown.to_srgb8()) < 250
    displayed = raycam.render(world, camera, samples=4).to_srgb8(view="agx")
    assert (said(world, camera, view="agx") != "") == (displayed.min() >= 254)


def shaded_world(radiance: float) -> raycam.World:
    """A sphere that covers a small part of a view, with a dark background, lit from the side."""
    world = raycam.World()
    world.add_object(sphere={"radius": 0.5})
    world.add_light("sun", direction=[-1, 1, -1], irradiance=radiance)
    world.add_light("sky", radiance=0.05 * radiance)
    return world


@pytest.mark.parametrize(("power", "word"), [(8, "white"), (12, "white"), (-14, "colour"), (-11, "colour")])
@pytest.mark.parametrize("channels", ["color", ["color", "instance"]])
def test_overexposed_objects_give_a_notice_with_an_exposure(power: int, word: str, channels: Any) -> None:
    world = shaded_world(2.0**power)
    dark_sky = {"background": [0.1, 0.1, 0.1]}
    notice = said(world, channels=channels, **dark_sky)
    assert word in notice
    assert "exposure=" in notice
    stops = float(notice.split("exposure=")[1].split()[0])
    frame = raycam.render(
        world, CAMERA, samples=4, exposure=stops, channels=["color", "instance"], **dark_sky
    )
    assert not frame.notices
    assert len(np.unique(frame.to_srgb8()[frame["instance"] >= 0])) > 20


def test_object_of_one_color_gives_no_notice() -> None:
    world = raycam.World()
    world.add_object(plane={"size": 80})
    world.add_light("sky", radiance=0.5)
    camera = raycam.Camera.look_at([0.1, 0, 5], [0, 0, 0], [0, 0, 1], size=(32, 24), fov=40)
    assert said(world, camera) == ""


def test_white_objects_give_no_overexposure_notice() -> None:
    world = lit_world()
    world.add_light("sky", radiance=1.0)
    assert said(world) == ""


def test_empty_region_gives_no_notice() -> None:
    assert said(lit_world(), region=(0, 0, 4, 4)) == ""


@pytest.mark.parametrize("up", ["z", "y"])
def test_default_view_shows_slanted_planes(up: str) -> None:
    """Planes with all small integer normals: none is seen edge-on."""
    for normal in np.ndindex(7, 7, 4):
        n = np.array(normal, dtype=float) - [3, 3, 0]
        if not n.any():
            continue
        n /= np.linalg.norm(n)
        u = np.cross(n, [0.3, 0.5, 0.8])
        u /= np.linalg.norm(u)
        v = np.cross(n, u)
        world = raycam.World(up)  # type: ignore[arg-type]
        world.add_mesh([u + v, v - u, -u - v, u - v], [[0, 1, 2], [0, 2, 3]])
        camera = world.default_camera((96, 72))
        seen = (
            raycam.render(world, camera, integrator="flat", samples=1, channels="instance")["instance"] >= 0
        )
        assert seen.sum() > 4, normal


@pytest.mark.parametrize("solid", [{"type": "glass"}, {"type": "glass", "roughness": 0.01, "ior": 1.3}])
@pytest.mark.parametrize(
    ("light", "sized"),
    [
        ({"type": "point", "position": [0, 0, 3], "power": 100}, {"radius": 0.05}),
        ({"type": "sun", "direction": [0, 0, -1], "irradiance": 1}, {"angular_diameter": 0.53}),
    ],
)
def test_solid_glass_with_a_light_without_size_gives_a_notice(solid: Any, light: Any, sized: Any) -> None:
    def spoken(light: Any, **glass: Any) -> bool:
        world = raycam.World()
        world.add_object(plane={"size": 9})
        world.add_object(sphere={}, location=[0, 0, 1.5], **glass)
        world.add_light(light)
        return "solid glass" in said(world, integrator="path")

    assert spoken(light, **solid)
    assert not spoken(light | sized, **solid)
    assert not spoken(light)
    assert not spoken(light, type="glass", thin=True)


def test_unknown_camera_words_raise_with_the_alternative() -> None:
    world = lit_world()
    with raises(raycam.WorldError, code="unknown_name", mentions=["world.view_from", "'top'"]):
        raycam.render(world, "top")
    with raises(FileNotFoundError, code="file_not_found"):
        raycam.render(world, "nothing.yaml")


@pytest.mark.parametrize("channels", ["color", ["color", "instance"]])
def test_notice_about_a_black_image_names_the_object_around_the_camera(channels: Any) -> None:
    world = raycam.World()
    world.add_object(sphere={"radius": 0.4}, name="bulb")
    world.add_object(plane={"size": 9}, location=[0, 0, -1])
    world.add_light("sun", direction=[-1, 1, -1], irradiance=1)
    inside = raycam.Camera.look_at([0, 0.1, 0], [1, 0, 0], [0, 0, 1], size=(16, 12), fov=40)
    for integrator in ("direct", "path"):
        assert "'bulb'" in said(world, inside, integrator=integrator, channels=channels)
        assert "bulb" not in said(world, integrator=integrator, channels=channels)


@pytest.mark.parametrize("integrator", ["flat", "direct", "path"])
def test_visible_medium_without_surfaces_gives_no_notice(integrator: str) -> None:
    world = raycam.World()
    cloud = world.add_object(sphere=1, type="boundary", medium={"absorption": 1, "scattering": 2})
    world.add_light("sky", radiance=1)
    camera = raycam.Camera.look_at([0, -4, 0], [0, 0, 0], size=(24, 24), fov=60)
    frame = raycam.render(world, camera, integrator=integrator, samples=4)
    assert "nothing_visible" not in [notice.code for notice in frame.notices]
    assert float(np.ptp(frame["color"])) > 0.1
    assert "nothing_visible" in codes_of(world, camera, integrator="ao")
    away = raycam.Camera.look_at([0, -4, 0], [0, -8, 0], size=(24, 24), fov=60)
    assert "nothing_visible" in codes_of(world, away, integrator=integrator)
    world.set_object(cloud, visible=False)
    assert "nothing_visible" in codes_of(world, camera, integrator=integrator)
