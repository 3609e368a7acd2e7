"""Shadow catchers, compared with closed forms and real grounds; masks and files."""

from __future__ import annotations

import copy
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raycam
from PIL import Image
from support.raises import has_notice, raises

SIZE = (36, 24)
HEIGHT, HALF = 1.0, 1.0
"""The box on the ground: its height, and half of its side."""


def camera_above() -> raycam.Camera:
    """A camera with parallel rays from above: 0.25 m per pixel, image centre at x = 2."""
    scale, (width, height) = 4.0, SIZE
    matrix = [[scale, 0, 0, (width - 1) / 2 - 2 * scale], [0, -scale, 0, (height - 1) / 2], [0, 0, 0, 1]]
    return raycam.Camera.from_matrix(matrix, SIZE)


def scene(*, catcher: bool = True, box: bool = True, color: Any = 0.6, box_color: Any = 0.0) -> raycam.World:
    world = raycam.World()
    world.add_object(
        plane={"size": [400, 400]},
        color=[color] * 3 if isinstance(color, float) else color,
        shadow_catcher=catcher,
        name="ground",
    )
    if box:
        world.add_object(
            box={"size": [2 * HALF, 2 * HALF, HEIGHT]},
            location=[0, 0, HEIGHT / 2],
            color=[box_color] * 3 if isinstance(box_color, float) else box_color,
            name="box",
        )
    return world


def caught(world: raycam.World, camera: raycam.Camera, **options: Any) -> raycam.Frame:
    return raycam.render(world, camera, transparent_background=True, **options)


def test_umbra_keeps_the_light_of_the_sky() -> None:
    # The sky is not occluded: E = pi L, plus the sun's irradiance times the cosine.
    sun, sky = 2.0, 0.3
    for elevation in (30.0, 50.0):
        world = scene()
        rise = math.radians(elevation)
        world.add_light(
            "sun", direction=[math.cos(rise), 0, -math.sin(rise)], irradiance=sun, angular_diameter=0
        )
        world.add_light("sky", radiance=sky)
        frame = caught(world, camera_above(), integrator="direct", samples=1)
        share = math.pi * sky / (math.pi * sky + sun * math.sin(rise))
        tip = HALF + HEIGHT / math.tan(rise)
        x = 2 + (np.arange(SIZE[0]) - (SIZE[0] - 1) / 2) / 4
        middle = frame["shadow"][SIZE[1] // 2]
        dark, light = (x > HALF + 0.1) & (x < tip - 0.1), x > tip + 0.1
        assert dark.any()
        assert light.any()
        np.testing.assert_allclose(middle[dark], share, rtol=1e-5)
        np.testing.assert_array_equal(middle[light], 1)
        assert (frame["alpha"][SIZE[1] // 2] == (np.abs(x) < HALF)).all()


def wall_factor(distance: Any, along: Any) -> Any:
    """The share of the cosine-weighted sky that a side of the box hides from a ground point.

    The point is in front of the side. J. R. Howell, A Catalog of Radiation Heat Transfer Configuration
    Factors, B-4, gives the factor from a surface element to a rectangle that stands on the element's plane
    and has a corner in front of it; the rectangles to the left and to the right of the point are added.
    """
    far = np.hypot(distance, HEIGHT)

    def to(side: Any) -> Any:
        return (np.arctan(side / distance) - distance / far * np.arctan(side / far)) / (2 * np.pi)

    return to(HALF - along) + to(HALF + along)


@pytest.mark.parametrize("integrator", ["path", "ao"])
def test_shadows_under_a_uniform_sky_equal_configuration_factors(integrator: Any) -> None:
    world = scene()
    world.add_light("sky", radiance=1.0)
    # These pixels show the ground in front of the box's side at x = 1.
    camera = camera_above().cropped(14, 9, 16, 6)
    runs = np.stack(
        [
            caught(world, camera, integrator=integrator, max_depth=2, samples=64, seed=seed)["shadow"].mean(
                axis=2
            )
            for seed in range(12)
        ]
    )
    within = (np.arange(16) + 0.5) / 16 - 0.5  # a pixel's value is the mean over its area
    x = 2 + (np.arange(14, 30)[:, None] + within - (SIZE[0] - 1) / 2) / 4
    y = -(np.arange(9, 15)[:, None] + within - (SIZE[1] - 1) / 2) / 4
    expected = 1 - wall_factor(x[None, None] - HALF, y[:, :, None, None]).mean(axis=(1, 3))
    # The tolerance is large, because few rays hit distant objects.
    seen = np.maximum(runs.var(axis=0, ddof=1), expected * (1 - expected) / 64)
    z = (runs.mean(axis=0) - expected) / np.sqrt(seen / len(runs))
    assert np.abs(z).max() < 6, np.abs(z).max()
    assert abs(z.mean()) < 0.4
    assert expected.min() < 0.75


def lit() -> raycam.World:
    """Coloured light, and interreflection between a red box and a green ground."""
    world = scene(color=[0.2, 0.6, 0.3], box_color=[0.9, 0.1, 0.1])
    world.add_light("sun", direction=[1, 0.4, -1], irradiance=[3, 2.5, 2], angular_diameter=5)
    world.add_light("sky", radiance=[0.2, 0.3, 0.5])
    return world


def test_shadow_over_its_own_ground_equals_a_render_of_the_ground() -> None:
    world, camera = lit(), raycam.Camera.look_at([7, -6, 5], [1, 0, 0], fov=35, size=(48, 36))
    bare = lit()
    bare.remove_object("box")
    bare.set_object("ground", shadow_catcher=False)
    real = lit()
    real.set_object("ground", shadow_catcher=False)
    settings: dict[str, Any] = {"integrator": "path", "samples": 64, "max_depth": 5}
    photo = raycam.render(bare, camera, **settings | {"samples": 256}, seed=77)["color"]
    runs = np.stack([caught(world, camera, **settings, seed=seed).over(photo)["color"] for seed in range(6)])
    truth = np.stack([raycam.render(real, camera, **settings, seed=100 + seed)["color"] for seed in range(6)])
    noise = np.sqrt((runs.var(axis=0, ddof=1) + truth.var(axis=0, ddof=1)) / 6) + 0.004
    z = (runs.mean(axis=0) - truth.mean(axis=0)) / noise
    assert np.abs(z).max() < 7, np.abs(z).max()
    assert np.abs(z.mean(axis=(0, 1))).max() < 0.25
    shadow = caught(world, camera, **settings)["shadow"]
    assert shadow.min() < 0.4
    assert (shadow[..., 0] > shadow[..., 2] + 0.02).any(), "red light of the box on the ground"


def test_glossy_shadow_catcher_shows_reflections() -> None:
    # Only a glossy material of the catcher reflects objects; a material with only a `color` does not.
    camera = raycam.Camera.look_at([5, -4, 2.5], [0.5, 0, 0], fov=35, size=(32, 24))
    settings: dict[str, Any] = {"integrator": "path", "samples": 96, "max_depth": 4}
    shown = {}
    for gloss in (True, False):
        world = raycam.World()
        material: dict[str, Any] = {"type": "metal", "roughness": 0.15} if gloss else {}
        world.add_object(
            plane={"size": 60}, color=[0.6, 0.6, 0.6], shadow_catcher=True, name="ground", **material
        )
        world.add_object(
            box={"size": 2}, location=[0, 0, 1], color=[0.9, 0.05, 0.05], emission=[0.6, 0.0, 0.0], name="box"
        )
        world.add_light("sky", radiance=0.5)
        bare = copy.copy(world)
        bare.remove_object("box")
        bare.set_object("ground", shadow_catcher=False)
        real = copy.copy(world)
        real.set_object("ground", shadow_catcher=False)
        photo = raycam.render(bare, camera, **settings | {"samples": 512}, seed=77)["color"]
        runs = np.stack(
            [caught(world, camera, **settings, seed=seed).over(photo)["color"] for seed in range(5)]
        )
        truth = np.stack(
            [raycam.render(real, camera, **settings, seed=90 + seed)["color"] for seed in range(5)]
        )
        noise = np.sqrt((runs.var(axis=0, ddof=1) + truth.var(axis=0, ddof=1)) / 5) + 0.006
        z = (runs.mean(axis=0) - truth.mean(axis=0)) / noise
        assert np.abs(z).max() < 8, np.abs(z).max()
        assert np.abs(z.mean(axis=(0, 1))).max() < 0.4
        shown[gloss] = caught(world, camera, **settings)["shadow"]
    assert shown[True][..., 0].max() > 1.3
    assert shown[True][..., 2].min() < 0.2


def test_shadow_catcher_in_an_opaque_image_gives_a_notice() -> None:
    world = lit()
    frame = raycam.render(world, camera_above(), samples=1)
    assert any(notice.code == "shadow_catchers_visible" for notice in frame.notices)
    assert set(np.unique(frame["instance"])) == {0, 1}
    assert "shadow" not in frame
    world.set_object("ground", shadow_catcher=False)
    same = raycam.render(world, camera_above(), samples=1)
    np.testing.assert_array_equal(frame["color"], same["color"])
    assert not same.notices


def test_ground_truth_omits_shadow_catchers_unless_requested() -> None:
    world, camera = lit(), raycam.Camera.look_at([7, -6, 5], [1, 0, 0], fov=35, size=(48, 36))
    world.set_object("box", location=[0, 0, 0])  # the lower half is below the ground
    shown = raycam.render(world, camera, samples=1, channels="all")
    frame = caught(world, camera, samples=4, channels="all")
    box = shown["instance"] == 1
    np.testing.assert_array_equal(frame["instance"], np.where(box, 1, -1))
    np.testing.assert_array_equal(frame["depth"], np.where(box, shown["depth"], np.inf))
    np.testing.assert_array_equal(frame["triangle"] >= 0, box)
    np.testing.assert_array_equal(frame["normal"], np.where(box[..., None], shown["normal"], 0))
    pure = frame["coverage"] == 1
    np.testing.assert_array_equal(frame["alpha"][pure], box[pure])
    both = caught(world, camera, samples=4, channels="all", catcher_truth=True)
    for name in ("instance", "depth", "normal", "position"):
        np.testing.assert_array_equal(both[name], shown[name])
    np.testing.assert_array_equal(both["color"], frame["color"])
    labels = raycam.label(world, camera, instance=frame["instance"])
    assert [one.name for one in labels] == ["box"]
    assert labels[0].visible_pixels == np.count_nonzero(box)


def test_translucent_object_shows_the_shadow_catcher_behind_it() -> None:
    world = scene(box=False)
    world.add_object(plane={"size": [4, 4]}, location=[2, 0, 2], opacity=0.5, color=[0, 0, 0], name="veil")
    world.add_light("sun", direction=[0, 0, -1], irradiance=2, angular_diameter=0)
    frame = caught(world, camera_above(), integrator="path", samples=256)
    alpha, shadow = frame["alpha"][12, 18], frame["shadow"][12, 18]
    np.testing.assert_allclose(alpha, 0.5, atol=0.1)
    np.testing.assert_allclose(shadow, 0.5, atol=0.1)  # half of the sunlight is transmitted
    np.testing.assert_array_equal(frame["shadow"][0, 0], 1)


def test_lights_in_front_of_a_shadow_catcher_are_visible() -> None:
    world = scene()
    world.add_light("area", position=[4, 0, 1], u=[1, 0, 0], v=[0, -1, 0], radiance=3.0)
    frame = caught(world, camera_above(), integrator="path", samples=4)
    real = raycam.render(world, camera_above(), integrator="path", samples=4)
    bright = (real["color"] > 2.5).all(axis=2)
    if bright.any():
        np.testing.assert_allclose(frame["color"][bright], 3.0, rtol=1e-4)
    assert np.isfinite(frame["shadow"]).all()


def test_shadow_catcher_without_lights_gives_a_notice() -> None:
    world = scene()
    world.add_object(sphere={"radius": 0.3}, location=[3, 0, 2], emission=5.0, name="bulb")
    frame = caught(world, camera_above(), integrator="path", samples=2)
    np.testing.assert_array_equal(frame["shadow"], 1)
    assert any(notice.code == "no_caught_shadows" for notice in frame.notices)


@pytest.mark.parametrize("integrator", ["direct", "path", "ao", "flat"])
def test_shadows_do_not_depend_on_threads_or_regions(integrator: Any) -> None:
    world, camera = lit(), camera_above()
    one, many = (
        caught(world, camera, integrator=integrator, samples=3, threads=threads, channels="all")
        for threads in (1, 3)
    )
    part = caught(world, camera, integrator=integrator, samples=3, channels="all", region=(5, 4, 20, 11))
    for name in one:
        np.testing.assert_array_equal(one[name], many[name])
        np.testing.assert_array_equal(one[name][4:15, 5:25], part[name])
    seen = (one["shadow"] < 0.9).any()
    assert seen == (integrator != "flat")


def test_image_files_contain_the_shadow(tmp_path: Path) -> None:
    world = scene()
    world.add_light("sun", direction=[1, 0, -1], irradiance=2, angular_diameter=0)
    frame = caught(world, camera_above(), samples=1)
    frame.save(tmp_path / "a.png")
    rgba = np.asarray(Image.open(tmp_path / "a.png"))
    dark = (frame["shadow"] == 0).all(axis=2) & (frame["alpha"] == 0)
    clear = (frame["shadow"] == 1).all(axis=2) & (frame["alpha"] == 0)
    assert dark.any()
    assert (rgba[dark] == [0, 0, 0, 255]).all()
    assert (rgba[clear] == 0).all()
    frame.save(tmp_path / "a.exr")
    frame.save(tmp_path / "a.npz")
    with np.load(tmp_path / "a.npz") as arrays:
        np.testing.assert_array_equal(arrays["shadow"], frame["shadow"])
    photo = np.full((*SIZE[::-1], 3), 200, np.uint8)
    seen = frame.over(photo).to_srgb8()
    np.testing.assert_array_equal(seen[clear], 200)
    np.testing.assert_array_equal(seen[dark], 0)


def test_copies_of_a_world_keep_the_shadow_catcher_flag(tmp_path: Path) -> None:
    (tmp_path / "a.toml").write_text("[[object]]\nplane = {}\nshadow_catcher = true\n[[object]]\nbox = {}\n")
    world = raycam.load(tmp_path / "a.toml")
    assert [item.shadow_catcher for item in world.objects] == [True, False]
    again = raycam.World.from_bytes(world.to_bytes())
    assert [item.shadow_catcher for item in again.objects] == [True, False]
    assert [item.shadow_catcher for item in world.at(1.0).objects] == [True, False]
    world.set_object(1, shadow_catcher=True)
    world.set_object(0, shadow_catcher=False, color="red")
    assert [item.shadow_catcher for item in world.objects] == [False, True]
    mesh = raycam.World()
    mesh.add_mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], shadow_catcher=True)
    assert mesh.objects[0].shadow_catcher
    with raises(raycam.WorldError, code="wrong_type", mentions=["shadow_catcher"]):
        world.set_object(0, shadow_catcher="yes")


def test_gltf_omits_shadow_catchers_and_backgrounds_with_a_notice(tmp_path: Path) -> None:
    Image.new("RGB", SIZE).save(tmp_path / "a.png")
    world = lit()
    world.add_camera(camera_above().with_background(tmp_path / "a.png"))
    said = world.to_gltf(tmp_path / "a.glb")
    assert has_notice(said, "not_written", 1, "shadow catcher")
    assert has_notice(said, "not_written", "background", 1)
