"""Fog in closed form, compared with NumPy, and its settings.

NumPy evaluates Koschmieder's formula and Beer's law.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raycam
from support.raises import raises

SIGMA = np.array([0.05, 0.1, 0.2])
ALBEDO = np.array([0.9, 0.6, 0.3])


def scene(**fog: Any) -> raycam.World:
    """A wall at different distances, a ball, and background around them."""
    world = raycam.World()
    world.add_object(box=[30, 1, 12], location=[6, 20, 0], yaw=35, color=[0.8, 0.3, 0.1])
    world.add_object(sphere={"radius": 1, "level": 3}, location=[-2, 6, 0], color=[0.2, 0.5, 0.9])
    if fog:
        world.set_fog(**fog)
    return world


def camera(**keys: Any) -> raycam.Camera:
    return raycam.Camera.look_at([0, 0, 0.5], [0, 10, 0.5], size=(48, 32), fov=60, **keys)


def hyperbola(cosine: np.ndarray | float, g: float) -> np.ndarray | float:
    """The phase function of Henyey and Greenstein."""
    return (1 - g * g) / (4 * math.pi * (1 + g * g - 2 * g * cosine) ** 1.5)


def passed(distance: np.ndarray, sigma: np.ndarray = SIGMA) -> np.ndarray:
    return np.exp(-sigma * distance[..., None].astype(float))


def test_flat_with_fog_equals_koschmieders_formula() -> None:
    channels = ["color", "albedo", "distance", "transmittance"]
    fog = {"extinction": SIGMA, "albedo": ALBEDO}
    frame = raycam.render(scene(**fog), camera(), integrator="flat", samples=1, channels=channels)
    t = passed(frame["distance"])
    assert 0.2 < np.isinf(frame["distance"]).mean() < 0.9
    np.testing.assert_allclose(frame["transmittance"], t, atol=1e-6)
    np.testing.assert_allclose(frame["color"], frame["albedo"] * t + ALBEDO * (1 - t), atol=2e-6)


@pytest.mark.parametrize("g", [0.0, 0.7, -0.5])
def test_direct_with_fog_equals_koschmieders_formula(g: float) -> None:
    sun, sky = np.array([3.0, 2.0, 1.0]), np.array([0.3, 0.4, 0.5])
    colors = []
    for fog in ({}, {"extinction": SIGMA, "albedo": ALBEDO, "g": g}):
        world = scene(**fog)
        world.add_light("sun", direction=[0.3, 1, -1], irradiance=sun)
        world.add_light("sky", radiance=sky)
        frame = raycam.render(world, camera(), integrator="direct", samples=1, channels=["color", "distance"])
        colors.append(frame["color"].astype(float))
    clear, foggy = colors
    rows, columns = np.mgrid[:32, :48]
    _, rays = camera().rays(np.stack([columns, rows], -1).reshape(-1, 2))
    cosine = rays.reshape(32, 48, 3) @ -np.array([0.3, 1, -1]) / math.sqrt(2.09)
    air = ALBEDO * (sky + sun * np.asarray(hyperbola(cosine, g))[..., None])
    t = passed(frame["distance"])
    np.testing.assert_allclose(foggy, clear * t + air * (1 - t), rtol=3e-5, atol=3e-6)


def test_air_light_of_a_gradient_sky_is_its_mean() -> None:
    world = scene(visibility=1.0)
    world.add_light("sky", zenith=[0, 0, 4], horizon=[2, 0, 0], ground=[0, 1, 0])
    color = raycam.render(world, camera(), integrator="direct", samples=1)["color"]
    # Half of the sphere of directions is ground; in the other half, the mean of the sine is 1/2.
    np.testing.assert_allclose(color[0, 0], [0.5, 0.5, 1.0], rtol=2e-3)


def test_fog_dims_each_part_of_a_mirrored_path() -> None:
    world = raycam.World()
    world.add_object(plane=40, location=[0, 10, 0], pitch=90, yaw=-90, type="metal", metal="silver")
    world.add_object(plane=40, location=[0, -5, 0], pitch=90, yaw=90, color=[1, 1, 1])
    world.add_light("sky", radiance=1)
    view = raycam.Camera.look_at([0, 0, 0], [0, 10, 0], size=(3, 3), fov=20)
    clear = raycam.render(world, view, integrator="direct", samples=1)["color"][1, 1]
    world.set_fog(extinction=0.04, albedo=0)
    foggy = raycam.render(world, view, integrator="direct", samples=1)["color"][1, 1]
    np.testing.assert_allclose(foggy / clear, math.exp(-0.04 * 25), rtol=1e-4)


def test_transparent_surfaces_do_not_apply_fog_twice() -> None:
    world = raycam.World()
    for distance in (2, 3, 4):
        world.add_object(plane=40, location=[0, distance, 0], pitch=90, yaw=-90, color=0.5, opacity=0.0)
    world.add_object(plane=40, location=[0, 8, 0], pitch=90, yaw=-90, color=1)
    world.add_light("sky", radiance=1)
    view = raycam.Camera.look_at([0, 0, 0], [0, 10, 0], size=(3, 3), fov=20)
    clear = raycam.render(world, view, integrator="direct", samples=4)["color"][1, 1]
    world.set_fog(extinction=0.1, albedo=0)
    foggy = raycam.render(world, view, integrator="direct", samples=4)["color"][1, 1]
    np.testing.assert_allclose(foggy / clear, math.exp(-0.8), rtol=2e-2)


def test_visibility_leaves_five_percent_of_the_contrast() -> None:
    view = raycam.Camera.look_at([0, 0, 0], [0, 10, 0], size=(3, 3), fov=20)
    world = raycam.World()
    world.add_object(plane=400, location=[0, 80, 0], pitch=90, yaw=-90)
    world.set_fog(visibility=80)
    kept = raycam.render(world, view, channels=["transmittance"])["transmittance"][1, 1]
    np.testing.assert_allclose(kept, 0.05, rtol=1e-5)
    assert world.fog is not None
    np.testing.assert_allclose(world.fog["extinction"], math.log(20) / 80, rtol=1e-6)


def test_fog_below_a_height_attenuates_only_the_part_of_the_ray_below_it() -> None:
    world = raycam.World()
    world.add_object(plane=400, color=1)
    world.set_fog(extinction=0.3, height=1.0)
    view = raycam.Camera.look_at([0, 0, 5], [0, 8, 0], size=(24, 40), fov=70)
    frame = raycam.render(world, view, channels=["transmittance", "distance", "position"], samples=1)
    sky = np.isinf(frame["distance"])
    assert 0 < sky.sum() < sky.size / 2
    kept = np.exp(-0.3 * frame["distance"][~sky] / 5)
    np.testing.assert_allclose(frame["transmittance"][~sky][:, 0], kept, rtol=1e-5, atol=1e-30)
    rays = view.rays(np.argwhere(sky)[:, ::-1].astype(float))[1]
    upward = rays[:, 2] >= 0
    assert upward.any()
    assert (frame["transmittance"][sky][upward] == 1).all()


def test_fog_of_a_camera_at_infinity_begins_at_its_plane() -> None:
    world = raycam.World()
    world.add_object(plane=40, location=[0, 8, 0], pitch=90, yaw=-90, color=1)
    world.set_fog(extinction=0.1)
    matrix = np.array([[10.0, 0, 0, 8], [0, 0, -10, 8], [0, 0, 0, 1]])
    view = raycam.Camera.from_matrix(matrix, (16, 16))
    frame = raycam.render(
        world, view, integrator="flat", channels=["color", "transmittance", "distance"], samples=1
    )
    expected = passed(frame["distance"], np.full(3, 0.1))
    np.testing.assert_allclose(frame["transmittance"], expected, rtol=1e-5)
    np.testing.assert_allclose(frame["color"], 1.0, atol=1e-6)


def test_fog_is_hidden_in_front_of_a_transparent_background() -> None:
    world = scene(extinction=SIGMA)
    world.add_light("sky", radiance=1)
    for integrator in ("flat", "direct"):
        frame = raycam.render(
            world,
            camera(),
            integrator=integrator,
            samples=1,
            transparent_background=True,
            channels=["color", "alpha"],
        )
        outside = frame["alpha"] == 0
        assert outside.any()
        assert (frame["color"][outside] == 0).all()


def test_world_without_fog_has_a_transmittance_of_one() -> None:
    assert (raycam.render(scene(), camera(), channels=["transmittance"])["transmittance"] == 1).all()


def test_removed_fog_restores_the_image() -> None:
    world = scene()
    before = raycam.render(world, camera(), integrator="flat", channels=["color", "distance"])
    world.set_fog(visibility=10)
    foggy = raycam.render(world, camera(), integrator="flat")
    world.set_fog()
    after = raycam.render(world, camera(), integrator="flat", channels=["color", "distance"])
    assert world.fog is None
    assert not np.array_equal(foggy["color"], after["color"])
    for name in before:
        np.testing.assert_array_equal(before[name], after[name])


def test_world_files_dicts_and_bytes_keep_the_fog(tmp_path: Path) -> None:
    path = tmp_path / "fog.toml"
    path.write_text(
        "[fog]\nvisibility = 50\nalbedo = [0.9, 0.95, 1]\ng = 0.8\nheight = 12\n"
        "[[object]]\nbox = { size = [1, 1, 1] }\n"
    )
    world = raycam.load(path)
    for other in (world, raycam.World.from_bytes(world.to_bytes()), world.copy()):
        fog = other.fog
        assert fog is not None
        np.testing.assert_allclose(fog["extinction"], math.log(20) / 50, rtol=1e-6)
        np.testing.assert_allclose(fog["albedo"], [0.9, 0.95, 1], rtol=1e-6)
        assert (round(fog["g"], 6), fog["height"]) == (0.8, 12)
    world.set_fog(dict(fog), g=0.0)
    assert world.fog is not None
    assert world.fog["g"] == 0


@pytest.mark.parametrize(
    ("keys", "key", "code"),
    [
        ({"visibility": 0}, "visibility", "out_of_range"),
        ({"visibility": -3.0}, "visibility", "out_of_range"),
        ({"visibility": math.inf}, "visibility", "out_of_range"),
        ({"visibility": math.nan}, "visibility", "out_of_range"),
        ({"visibility": 1e-60}, "visibility", "out_of_range"),
        ({"extinction": -0.1}, "extinction", "out_of_range"),
        ({"extinction": [0.1, math.inf, 0]}, "extinction", "out_of_range"),
        ({"extinction": 1e60}, "extinction", "out_of_range"),
        ({"extinction": 0.1, "albedo": 1.1}, "albedo", "out_of_range"),
        ({"extinction": 0.1, "albedo": [0, -0.1, 0]}, "albedo", "out_of_range"),
        ({"extinction": 0.1, "albedo": math.nan}, "albedo", "out_of_range"),
        ({"extinction": 0.1, "g": 1}, "g", "out_of_range"),
        ({"extinction": 0.1, "g": -1.0}, "g", "out_of_range"),
        ({"extinction": 0.1, "g": math.nan}, "g", "out_of_range"),
        ({"extinction": 0.1, "height": math.inf}, "height", "out_of_range"),
        ({"extinction": 0.1, "visibility": 5}, "extinction", "conflicting_values"),
        ({"g": 0.5}, "visibility", "missing_value"),
        ({"visibility": 5, "density": 3}, "density", "unknown_key"),
    ],
)
def test_invalid_fog_is_refused(keys: dict[str, Any], key: str, code: str) -> None:
    world = scene(visibility=7)
    with raises(raycam.WorldError, mentions=[key]) as caught:
        world.set_fog(**keys)
    assert caught.value.code == code
    assert world.fog == scene(visibility=7).fog


def test_invalid_fog_of_a_world_file_names_its_line(tmp_path: Path) -> None:
    path = tmp_path / "fog.toml"
    path.write_text("[fog]\nvisibility = 50\ng = 2\n")
    with raises(raycam.WorldError, mentions=["fog.toml:3"]) as caught:
        raycam.load(path)
    assert caught.value.code == "out_of_range"
