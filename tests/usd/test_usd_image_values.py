"""Scale, bias, channel and colour space of UsdUVTexture, as in the specification."""

from __future__ import annotations

import io
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raycam
from PIL import Image
from pxr import Gf, Sdf, UsdShade
from raycam.usd.image_values import level_values, look_up
from support.raises import has_notice
from support.usd_stages import bind, image, material, square, stage, uvs, write_image


def linear(srgb: Any) -> Any:
    values = np.asarray(srgb, float)
    return np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)


def painted(folder: Path, pixel: Any, outputs: dict[str, str], **inputs: Any) -> raycam.World:
    """A square with a one-pixel image and an otherwise matte white material."""
    write_image(folder / "image.png", np.tile(np.asarray(pixel, np.uint8), (4, 4, 1)))
    made = stage(folder / "a.usda")
    mesh, paint = square(made), material(made, "/paint", diffuseColor=(1.0, 1.0, 1.0), roughness=1.0)
    uvs(mesh)
    image(made, paint, "image.png", outputs, **inputs)
    bind(mesh, paint)
    made.Save()
    return raycam.load(folder / "a.usda")


def seen(world: raycam.World, channel: str, **options: Any) -> Any:
    camera = raycam.Camera.look_at((0, 0, 5), (0, 0, 0), (0, 1, 0), size=(4, 4), fov=10)
    return raycam.render(world, camera, channels=[channel], **options)[channel].reshape(16, 3).mean(axis=0)


@pytest.mark.parametrize("space", ["auto", "sRGB", "raw"])
@pytest.mark.parametrize(
    ("scale", "bias"),
    [
        ((1, 1, 1, 1), (0, 0, 0, 0)),
        ((0.5, 0.25, 1, 1), (0.1, 0.2, -0.05, 0)),
        ((1.5, -1, 2, 1), (0, 0.75, 0, 0)),
        ((0, 0, 0, 1), (0.2, 0.3, 0.4, 0)),
    ],
)
def test_image_scale_bias_and_color_space_are_applied(
    tmp_path: Path, space: str, scale: Any, bias: Any
) -> None:
    pixel = [200, 90, 30]
    world = painted(
        tmp_path,
        pixel,
        {"diffuseColor": "rgb"},
        scale=Gf.Vec4f(*scale),
        bias=Gf.Vec4f(*bias),
        sourceColorSpace=space,
    )
    values = np.array(pixel) / 255 if space == "raw" else linear(np.array(pixel) / 255)
    expected = np.clip(values * scale[:3] + bias[:3], 0, 1)
    np.testing.assert_allclose(seen(world, "albedo"), expected, atol=3e-4)
    assert not world.notices


@pytest.mark.parametrize("output", "rgb")
def test_single_image_channel_is_used_as_a_grey_color(tmp_path: Path, output: str) -> None:
    world = painted(tmp_path, [200, 90, 30], {"diffuseColor": output})
    value = linear([200, 90, 30]["rgb".index(output)] / 255)
    np.testing.assert_allclose(seen(world, "albedo"), [value] * 3, atol=3e-4)


@pytest.mark.parametrize("output", "rgb")
@pytest.mark.parametrize(("scale", "bias", "space"), [(1, 0, "raw"), (1.25, -0.1, "raw"), (1, 0, "sRGB")])
def test_connected_image_channel_is_used(
    tmp_path: Path, output: str, scale: float, bias: float, space: str
) -> None:
    pixel = [40, 120, 200]
    inputs = {"scale": Gf.Vec4f(scale), "bias": Gf.Vec4f(bias), "sourceColorSpace": space}
    world = painted(tmp_path, pixel, {"roughness": output, "metallic": output}, **inputs)
    assert not world.notices
    value = pixel["rgb".index(output)] / 255
    expected = np.clip((linear(value) if space == "sRGB" else value) * scale + bias, 0, 1)
    # The expected value is read from raycam's glTF file: roughness is green, metalness blue.
    world.to_gltf(tmp_path / "a.glb")
    data = (tmp_path / "a.glb").read_bytes()
    size = int.from_bytes(data[12:16], "little")
    document, binary = json.loads(data[20 : 20 + size]), data[28 + size :]
    surface = document["materials"][0]["pbrMetallicRoughness"]
    source = document["textures"][surface["metallicRoughnessTexture"]["index"]]["source"]
    view = document["bufferViews"][document["images"][source]["bufferView"]]
    start = view.get("byteOffset", 0)
    found = np.asarray(Image.open(io.BytesIO(binary[start : start + view["byteLength"]])))[0, 0] / 255
    assert found[1] * surface.get("roughnessFactor", 1.0) == pytest.approx(expected, abs=3e-3)
    assert found[2] * surface.get("metallicFactor", 1.0) == pytest.approx(expected, abs=3e-3)


@pytest.mark.parametrize(
    ("scale", "bias"), [((2, 2, 2), (-1, -1, -1)), ((-2, 2, 1), (1, -1, 0)), ((2, -2, 2), (-1, 1, -1))]
)
def test_normal_map_scale_and_bias_are_applied(tmp_path: Path, scale: Any, bias: Any) -> None:
    # usd-wg/assets, NormalsTextureBiasAndScale: three encodings of the same normals
    normal = np.array([0.48, 0.36, 0.8])
    stored = np.round((normal - bias) / scale * 255)
    world = painted(
        tmp_path,
        stored,
        {"normal": "rgb"},
        scale=Gf.Vec4f(*scale, 1),
        bias=Gf.Vec4f(*bias, 0),
        sourceColorSpace="raw",
    )
    assert not world.notices
    world.add_light("sun", direction=(-normal).tolist(), irradiance=np.pi)
    lit = seen(world, "color", samples=1, integrator="direct")
    world = painted(tmp_path / "flat", [128, 128, 255], {"normal": "rgb"})
    assert has_notice(world.notices, "assumed_convention", "/paint", "scale 2")
    world.add_light("sun", direction=(-normal).tolist(), irradiance=np.pi)
    flat = seen(world, "color", samples=1, integrator="direct")
    # Lambert's law: full light if the normal points to the sun, and 0.8 of the full light on the flat square.
    assert lit[0] / flat[0] == pytest.approx(1 / 0.8, rel=0.04)


@pytest.mark.parametrize("key", ["clearcoat", "ior", "occlusion", "displacement"])
def test_unused_images_give_notices(tmp_path: Path, key: str) -> None:
    world = painted(tmp_path, [9, 9, 9], {key: "r"})
    assert has_notice(world.notices, "ignored_feature", key, "UsdUVTexture")


def test_inputs_from_unknown_shaders_give_notices(tmp_path: Path) -> None:
    made = stage(tmp_path / "a.usda")
    mesh, paint = square(made), material(made, "/paint")
    noise = UsdShade.Shader.Define(made, "/paint/noise")
    noise.CreateIdAttr("ND_noise2d_color3")
    surface = UsdShade.Shader(made.GetPrimAtPath("/paint/surface"))
    color = surface.CreateInput("diffuseColor", Sdf.ValueTypeNames.Color3f)
    color.ConnectToSource(noise.ConnectableAPI(), "out")
    bind(mesh, paint)
    made.Save()
    (notice,) = raycam.load(tmp_path / "a.usda").notices
    assert has_notice([notice], "ignored_feature", "diffuseColor", "ND_noise2d_color3")


@pytest.mark.parametrize(
    ("values", "scale", "bits"),
    [
        (np.array([0, 128, 254], np.uint8), 0.5, 8),
        (np.array([0, 128, 255], np.uint8), 0.5, 16),
        (np.array([0, 257, 65535], np.uint16), 1.0, 8),
        (np.array([0, 1, 255], np.uint16), 1.0, 16),
    ],
)
def test_looked_up_values_have_the_bits_that_represent_them(values: Any, scale: float, bits: int) -> None:
    pixels = np.repeat(values[None, :, None], 4, axis=2)
    made = look_up(pixels, [2], level_values(pixels)[:, None] * np.float32(scale))
    assert made.shape == (1, 3, 1)
    assert made.dtype == f"uint{bits}"
    expected = values / np.iinfo(values.dtype).max * scale
    np.testing.assert_allclose(made[0, :, 0] / (2**bits - 1), expected, atol=0.5 / 65535)
