"""Materials: their appearance under a white sky, and invalid keys."""

from __future__ import annotations

import numpy as np
import pytest
import raycam
from support.raises import notice_codes, raises


def seen(**style: object) -> np.ndarray:
    """The mean colour of a ball under a white sky."""
    world = raycam.World()
    world.add_object(sphere={"radius": 1.0}, **style)
    world.add_light(type="sky", radiance=[1, 1, 1])
    camera = raycam.Camera.look_at([0, -5, 0], [0, 0, 0], size=(24, 24), fov=12)
    frame = raycam.render(world, camera, integrator="path", samples=64, channels="color")
    return frame["color"].mean(axis=(0, 1))


@pytest.mark.parametrize(
    "style",
    [
        {"type": "matte", "color": [1, 1, 1]},
        {"type": "metal", "color": [1, 1, 1], "roughness": 0.4},
        {"type": "glass"},
        {"type": "glass", "thin": True},
        {"type": "principled", "color": [1, 1, 1], "roughness": 0.3},
        {"type": "principled", "color": [1, 1, 1], "metallic": 1.0, "roughness": 0.7},
    ],
)
def test_lossless_materials_are_invisible_under_a_white_sky(style: dict[str, object]) -> None:
    assert seen(**style) == pytest.approx(np.ones(3), abs=0.01)


def test_gold_has_the_reflectance_of_gold() -> None:
    red, green, blue = seen(type="metal", metal="gold")
    assert red > 0.95
    assert 0.68 < green < 0.82
    assert 0.35 < blue < 0.5


def test_glass_absorption_follows_beers_law() -> None:
    # The path through the centre of a ball of radius 1 is 2 m long.
    world = raycam.World()
    world.add_object(
        sphere={"radius": 1.0, "level": 6},
        type="glass",
        ior=1.0001,
        attenuation_color=[0.9, 0.5, 0.1],
        attenuation_distance=1.0,
    )
    world.add_light(type="sky", radiance=[1, 1, 1])
    camera = raycam.Camera.look_at([0, -5, 0], [0, 0, 0], size=(4, 4), fov=0.5)
    color = raycam.render(world, camera, integrator="path", samples=32)["color"].mean(axis=(0, 1))
    assert color == pytest.approx(np.array([0.9, 0.5, 0.1]) ** 2, rel=0.01)


def test_dispersion_separates_colors() -> None:
    def spread(dispersion: float) -> float:
        world = raycam.World()
        world.add_object(sphere={"radius": 1.0, "level": 6}, type="glass", ior=1.5, dispersion=dispersion)
        world.add_object(plane={"size": 1}, location=[0, 3, 0], pitch=90, yaw=90, emission=4, color=[0, 0, 0])
        world.add_light(type="sky", radiance=[0, 0, 0])
        camera = raycam.Camera.look_at([0, -5, 0], [0, 0, 0], size=(48, 48), fov=24)
        color = raycam.render(world, camera, integrator="path", samples=64)["color"]
        return float(np.abs(color[..., 0] - color[..., 2]).mean())

    assert spread(0.0) < 1e-6
    assert spread(5.0) > 0.005


@pytest.mark.parametrize(
    ("style", "words"),
    [
        ({"type": "metal", "metal": "golt"}, ["golt", "'gold'"]),
        ({"type": "metal", "metal": "gold", "color": [1, 0, 0]}, ["color", "name"]),
        ({"type": "glass", "ior": 0.5}, ["ior", "0.5"]),
        ({"type": "glass", "diffuse": 0.5}, ["diffuse"]),
        ({"type": "principled", "metallic": 2.0}, ["metallic", "2"]),
        ({"metallic": 1.0}, ["metallic", "principled"]),
        ({"roughness": 0.5}, ["roughness", "principled"]),
        ({"type": "matte", "ior": 1.5}, ["ior", "glass"]),
    ],
)
def test_conflicting_material_keys_are_refused(style: dict[str, object], words: list[str]) -> None:
    world = raycam.World()
    with pytest.raises(raycam.Error) as refused:
        world.add_object(sphere={"radius": 1.0}, **style)
    for word in words:
        assert word.replace("'", "") in str(refused.value)


def test_noise_threshold_and_time_limit_end_rendering() -> None:
    world = raycam.World()
    world.add_object(sphere={"radius": 1.0})
    world.add_object(plane={"size": 6}, location=[0, 0, -1])
    world.add_light(type="sky", radiance=[1, 1, 1])
    camera = raycam.Camera.look_at([0, -5, 2], [0, 0, 0], size=(32, 24))
    frame = raycam.render(world, camera, integrator="path", noise_threshold=0.02, channels=["color", "error"])
    assert (frame["error"] <= 0.02).mean() > 0.99
    assert notice_codes(frame.notices) == ["samples_used"]
    timed = raycam.render(world, camera, integrator="path", time_limit=0.2, channels="color")
    samples = int(str(timed.notices[0]).split()[0])
    again = raycam.render(world, camera, integrator="path", samples=samples, channels="color")
    assert (timed["color"] == again["color"]).all()


@pytest.mark.parametrize("setting", ["noise_threshold", "time_limit", "clamp"])
def test_negative_settings_are_refused(setting: str) -> None:
    world = raycam.World()
    world.add_object(sphere={"radius": 1.0})
    with raises(raycam.SettingsError, code="invalid_settings", mentions=[setting]):
        raycam.render(world, integrator="path", **{setting: -1.0})
    with raises(raycam.SettingsError, code="invalid_settings", mentions=["max_depth"]):
        raycam.render(world, integrator="path", max_depth=0)


@pytest.mark.parametrize(("direction", "radiance"), [([1, 0, 0], 2.25), ([1, 1, 1], 0.0)])
def test_unlimited_paths_in_clear_glass_terminate(direction: list[int], radiance: float) -> None:
    """The camera is inside a glass cube under a white sky, and paths have no limit of segments.

    Towards a face the radiance is n², as inside every medium (pbrt, section 9.5.2). Along the diagonal every face
    reflects totally, so the path never leaves the cube: only Russian roulette ends it.
    """
    world = raycam.World()
    world.add_object(box={"size": [2, 2, 2]}, type="glass", ior=1.5)
    world.add_light("sky", radiance=1.0)
    eye = np.array([0.1, 0.05, 0.02])
    camera = raycam.Camera.look_at(eye, eye + direction, size=(8, 8), fov=8)
    with pytest.warns(raycam.Notice):  # the notice reports that all pixels are black or brighter than white
        color = raycam.render(world, camera, integrator="path", samples=16, channels="color")["color"]
    np.testing.assert_allclose(color, radiance, rtol=0.03)  # the tolerance for the noise of 16 samples
