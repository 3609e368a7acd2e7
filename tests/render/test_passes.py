"""Parts of the colour, and the channels of materials and objects."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
import pytest
import raycam
from raycam.errors import SettingsError
from raycam.render.frame import CHANNELS, PASSES
from raycam.viewer.saved_frames import load_frame

WAYS = ("emission", "direct", "indirect")
LOBES = ("emission", "diffuse", "specular", "volume")
LIGHTS = ("light:key", "light:sky", "light:surfaces")


def scene() -> raycam.World:
    """A floor, a glossy ball, a glowing box and two lights."""
    world = raycam.World()
    world.add_object(plane={"size": 6}, name="floor", color=[0.6, 0.5, 0.4])
    world.add_object(
        sphere={"radius": 0.5},
        name="ball",
        location=[0, 0, 0.5],
        type="principled",
        color=[0.8, 0.2, 0.1],
        roughness=0.3,
        metallic=0.25,
    )
    world.add_object(box={"size": [0.2, 0.2, 0.4]}, name="glow", location=[1, 0, 0.2], emission=[1, 2, 3])
    world.add_light(type="bulb", name="key", position=[-1, -2, 3], power=[90, 80, 70], radius=0.1)
    world.add_light(type="sky", radiance=[0.2, 0.3, 0.5])
    return world


def camera() -> raycam.Camera:
    return raycam.Camera.look_at([1.5, -3, 2], [0.3, 0, 0.3], size=(40, 30), fov=45)


def picture(**options: Any) -> raycam.Frame:
    settings = {"integrator": "path", "samples": 16, "channels": ["color", *PASSES, *LIGHTS], **options}
    return raycam.render(scene(), camera(), **settings)


@pytest.mark.parametrize("integrator", ["path", "direct"])
@pytest.mark.parametrize("parts", [WAYS, LOBES, LIGHTS], ids=["ways", "lobes", "lights"])
def test_passes_of_each_kind_add_up_to_the_color(integrator: str, parts: tuple[str, ...]) -> None:
    frame = picture(integrator=integrator)
    total = np.sum([frame[name] for name in parts], axis=0)
    np.testing.assert_allclose(total, frame["color"], rtol=2e-6, atol=1e-6)
    for name in parts:
        assert frame[name].dtype == np.float32
        assert frame[name].shape == (30, 40, 3)
        is_dark = name == "volume" or (name == "indirect" and integrator == "direct")
        assert (frame[name].sum() > 0) != is_dark


def test_color_is_the_same_with_and_without_passes() -> None:
    np.testing.assert_array_equal(picture()["color"], picture(channels="color")["color"])


def test_light_images_can_be_relit() -> None:
    frame = picture(samples=1024)
    world = scene()
    world.set_light(0, power=[30, 80, 140])
    world.set_light(1, radiance=[0.4, 0.3, 0.1])
    again = raycam.render(world, camera(), integrator="path", samples=1024)
    relit = (
        frame["light:key"] * np.float32([30 / 90, 1, 2])
        + frame["light:sky"] * np.float32([2, 1, 0.2])
        + frame["light:surfaces"]
    )
    blocks = [each.reshape(3, 10, 4, 10, 3).mean(axis=(1, 3)) for each in (relit, again["color"])]
    np.testing.assert_allclose(*blocks, rtol=0.03, atol=1e-3)


def test_passes_are_the_same_on_any_number_of_threads_and_in_regions() -> None:
    whole = picture(threads=1)
    several = picture(threads=3)
    part = picture(region=[10, 5, 20, 15])
    for name in whole:
        np.testing.assert_array_equal(whole[name], several[name])
        np.testing.assert_array_equal(whole[name][5:20, 10:30], part[name])


def test_progressive_images_contain_passes() -> None:
    names = ["color", *WAYS, "light:key"]
    image = raycam.Progressive(scene(), camera(), channels=names, integrator="path", samples=16)
    while image.add(8) < 16:
        pass
    frame = image.frame()
    whole = picture(channels=names)
    for name in names:
        np.testing.assert_array_equal(frame[name], whole[name])


def test_light_names_that_do_not_exist_raise_an_error_with_all_names() -> None:
    with pytest.raises(SettingsError) as caught:
        picture(channels=["light:kee"])
    for name in ("kee", "key", "sky", "surfaces"):
        assert name in str(caught.value)
    with pytest.raises(SettingsError, match="integrator"):
        picture(channels=["light:key"], integrator="flat")
    for wrong in ("light:", "light", "lights:key"):
        with pytest.raises(SettingsError) as caught:
            picture(channels=[wrong])
        assert caught.value.code == "unknown_name"


def test_default_lights_have_names() -> None:
    world = raycam.World()
    world.add_object(sphere={"radius": 0.5})
    names = ["color", "light:sky", "light:sun"]
    with pytest.warns(raycam.Notice):
        frame = raycam.render(world, camera(), integrator="direct", channels=names)
    np.testing.assert_allclose(frame["light:sky"] + frame["light:sun"], frame["color"], rtol=1e-6)


def test_channels_all_includes_passes_but_no_single_lights() -> None:
    frame = raycam.render(scene(), camera(), integrator="path", samples=2, channels="all")
    assert set(frame) == set(CHANNELS)
    assert set(PASSES) <= set(frame)


@pytest.mark.parametrize("ending", ["exr", "npz"])
def test_saved_passes_are_read_again(tmp_path: Path, ending: str) -> None:
    frame = picture(channels=["color", "light:key", "diffuse", "roughness", "nocs"])
    path = tmp_path / f"a.{ending}"
    frame.save(path)
    again = load_frame(path)
    assert set(again) == set(frame)
    for name in frame:
        np.testing.assert_array_equal(again[name], frame[name])


def test_exr_layers_have_the_names_of_the_passes(tmp_path: Path) -> None:
    frame = picture(channels=["color", "light:key", "diffuse"])
    frame.save(tmp_path / "a.exr")
    with OpenEXR.File(str(tmp_path / "a.exr"), separate_channels=True) as file:
        layers = {name: channel.pixels for name, channel in file.channels().items()}
    wanted = ["R", "G", "B", *(f"{name}.{color}" for name in ("light:key", "diffuse") for color in "RGB")]
    assert set(layers) == set(wanted)
    np.testing.assert_array_equal(layers["light:key.G"], frame["light:key"][..., 1])


def test_passes_are_shown_as_srgb(tmp_path: Path) -> None:
    frame = picture(channels=["color", "light:key"])
    frame.save(tmp_path / "a.png", channel="light:key")
    as_color = raycam.Frame({"color": frame["light:key"]}, camera=None, size=frame.size)
    assert (tmp_path / "a.png").read_bytes() == as_color.to_png()
    frame.save(tmp_path / "a.html")


def test_passes_of_a_world_in_the_studio_show_the_studio() -> None:
    world = raycam.World()
    world.add_object(sphere={"radius": 0.5})
    world.add_studio()
    frame = raycam.render(world, integrator="path", samples=4, channels=["color", *WAYS])
    np.testing.assert_allclose(sum(frame[name] for name in WAYS), frame["color"], rtol=2e-6, atol=1e-6)


def test_roughness_and_metallic_channels_equal_the_material() -> None:
    frame = picture(channels=["instance", "roughness", "metallic"])
    expected = {0: (1, 0), 1: (0.3, 0.25), 2: (1, 0), -1: (0, 0)}
    for instance, (roughness, metallic) in expected.items():
        shown = frame["instance"] == instance
        assert shown.any()
        np.testing.assert_allclose(frame["roughness"][shown], roughness, rtol=1e-6)
        np.testing.assert_allclose(frame["metallic"][shown], metallic, rtol=1e-6)


def test_roughness_and_metallic_include_their_texture() -> None:
    texels = np.zeros((2, 2, 3), np.uint8)
    texels[..., 1], texels[..., 2] = [[0, 51], [102, 255]], [[255, 204], [153, 0]]
    world = raycam.World()
    world.add_object(
        plane={"size": 2},
        type="principled",
        metallic=1,
        roughness=1,
        textures={name: {"image": texels, "filter": "nearest"} for name in ("metallic", "roughness")},
    )
    above = raycam.Camera.look_at([0, 0, 3], [0, 0, 0], size=(4, 4), fov=20, up=[0, 1, 0])
    frame = raycam.render(world, above, channels=["roughness", "metallic", "uv"])
    column, row = (frame["uv"] * 2).astype(int).transpose(2, 0, 1)
    np.testing.assert_allclose(frame["roughness"], texels[row, column, 1] / 255, atol=1e-6)
    np.testing.assert_allclose(frame["metallic"], texels[row, column, 2] / 255, atol=1e-6)


@pytest.mark.parametrize("scale", [1.0, [1.0, 2.0, 0.5]])
def test_nocs_are_positions_in_the_box_of_the_object(scale: float | list[float]) -> None:
    size = np.array([0.6, 0.4, 0.2])
    world = raycam.World()
    box = world.add_object(box={"size": size}, location=[0.2, -0.1, 0.3], yaw=30, pitch=20, scale=scale)
    frame = raycam.render(world, camera(), channels=["nocs", "position", "instance"])
    shown = frame["instance"] == box
    assert np.isnan(frame["nocs"][~shown]).all()
    found = frame["nocs"][shown].astype(np.float64)
    # The object's pose without its scale is a rotation and a translation.
    matrix = np.asarray(world.objects[box].matrix)
    sides = size * np.linalg.norm(matrix[:3, :3], axis=0)
    rotation = matrix[:3, :3] / np.linalg.norm(matrix[:3, :3], axis=0)
    local = (frame["position"][shown] - matrix[:3, 3]) @ rotation
    np.testing.assert_allclose(found, local / np.linalg.norm(sides) + 0.5, atol=1e-6)
    assert found.min() >= 0
    assert found.max() <= 1
