"""Arrays as images of materials and environments.

Their texels equal those of a PNG file written by Pillow.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import raycam
from PIL import Image
from support.raises import warns

CAMERA = raycam.Camera.look_at([0, 0, 3], [0, 0, 0], [0, 1, 0], size=(48, 36), fov=30)


def picture(texture: Any, **keys: Any) -> bytes:
    world = raycam.World()
    world.add_object(plane={"size": 2}, type="unlit", texture=texture, **keys)
    return raycam.render(world, CAMERA, samples=4)["color"].tobytes()


@pytest.mark.parametrize("channels", [None, 1, 2, 3, 4])
@pytest.mark.parametrize("kind", ["plain", "strided", "fortran", "texture"])
def test_byte_arrays_equal_png_files(channels: int | None, kind: str, tmp_path: Path) -> None:
    shape = (13, 9) if channels is None else (13, 9, channels)
    texels = np.random.default_rng(5).integers(0, 256, shape, dtype=np.uint8)
    Image.fromarray(texels if channels != 1 else texels[..., 0]).save(tmp_path / "x.png")
    given: Any = {
        "plain": texels,
        "strided": np.repeat(texels, 2, axis=1)[:, ::2],
        "fortran": np.asfortranarray(texels),
        "texture": raycam.Texture(texels),
    }[kind]
    assert picture(given) == picture(str(tmp_path / "x.png"))


def test_float_arrays_are_linear() -> None:
    texels = np.random.default_rng(6).uniform(0, 1, (8, 8, 3))
    assert picture(texels) == picture(texels.astype(np.float32)) == picture(texels.tolist())


@pytest.mark.parametrize("shape", [(4,), (4, 4, 5), (0, 4, 3), (2, 2, 2, 3)])
def test_texture_arrays_of_wrong_shape_are_refused(shape: tuple[int, ...]) -> None:
    with pytest.raises(raycam.WorldError):
        raycam.World().add_object(plane={}, texture=np.zeros(shape, np.uint8))


def test_data_textures_are_linear_and_serialized_with_the_world() -> None:
    texels = np.full((4, 4), 128, np.uint8)
    world = raycam.World()
    world.add_object(plane={"size": 2}, type="principled", textures={"roughness": texels}, texture=texels)
    description = {"object": [{"plane": {"size": 2}, "type": "unlit", "texture": {"image": texels}}]}
    other = raycam.World.from_dict(description)
    assert description["object"][0]["texture"] == {"image": texels}  # the description is unchanged
    for each in (world, other):
        assert raycam.World.from_bytes(each.to_bytes()).to_bytes() == each.to_bytes()


@pytest.mark.parametrize("kind", ["float32", "float64", "uint8"])
def test_environment_light_accepts_an_array(kind: str, tmp_path: Path) -> None:
    texels = np.random.default_rng(7).uniform(0, 1, (8, 16, 3))
    array = (texels * 255).astype(np.uint8) if kind == "uint8" else texels.astype(kind)
    world = raycam.World()
    world.add_object(sphere={})
    world.add_light("environment", image=array)
    flat = raycam.World()
    flat.add_object(sphere={})
    if kind == "uint8":
        Image.fromarray(array).save(tmp_path / "sky.png")
        flat.add_light("environment", image=tmp_path / "sky.png")
    else:
        even = raycam.World()
        even.add_object(sphere={})
        even.add_light("environment", image=np.full((4, 8, 3), 0.25, kind))
        flat.add_light("sky", radiance=0.25)
        world = even
    seen, expected = (raycam.render(each, CAMERA, samples=64)["color"] for each in (world, flat))
    if kind == "uint8":
        assert np.array_equal(seen, expected)
    else:
        assert seen == pytest.approx(expected, abs=0.02)
    assert world.lights[0]["image"] == "array"


def test_negative_environment_values_give_a_notice_and_count_as_black() -> None:
    image = np.ones((4, 8, 3), np.float32)
    image[0, :3] = -1
    world, black = raycam.World(), raycam.World()
    with warns(raycam.Notice, code="clamped_value"):
        world.add_light("environment", image=image)
    black.add_light("environment", image=np.maximum(image, 0))
    assert black.notices == []
    camera = raycam.Camera.equirectangular([0, 0, 0], size=(16, 8))
    for one in (world, black):
        one.add_object(box={"size": 1}, location=[0, 0, -3])
    seen, expected = (
        raycam.render(one, camera, integrator="path", samples=8, seed=1) for one in (world, black)
    )
    lit = expected["instance"] == 0
    assert lit.any()
    assert np.array_equal(seen["color"][lit], expected["color"][lit])
