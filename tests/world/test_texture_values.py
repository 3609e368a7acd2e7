"""Texture arrays of every dtype, and values outside of the valid range."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt
import pytest
import raycam
from support.raises import raises, warns

CAMERA = raycam.Camera.look_at([0, 0, 100], [0, 0, 0], size=(4, 4), fov=1.0, up=[0, 1, 0])
VALUES = np.array([[0, 300], [32768, 65535]], dtype=np.uint16)


def shown(texture: Any) -> npt.NDArray[Any]:
    """Base colours [4, 4, 3] of a textured plane."""
    world = raycam.World()
    world.add_object(plane={"size": 2}, texture=texture)
    color: npt.NDArray[Any] = raycam.render(world, CAMERA, integrator="flat", samples=1)["color"]
    return color


def lit(textures: Any, **keys: Any) -> npt.NDArray[Any]:
    """The image of a lit sphere with data textures."""
    world = raycam.World()
    world.add_object(sphere={"radius": 0.8}, type="principled", textures=textures, **keys)
    world.add_light("sky", zenith=[4, 2, 1], horizon=[0, 1, 2])
    frame = raycam.render(world, CAMERA, integrator="path", samples=16, channels="color")
    color: npt.NDArray[Any] = frame["color"]
    return color


def srgb(values: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """The linear values of sRGB values from 0 to 1 (IEC 61966-2-1)."""
    high = ((values + 0.055) / 1.055) ** 2.4
    return np.where(values <= 0.04045, values / 12.92, high)


def test_uint16_and_bool_colors_are_srgb() -> None:
    texture = raycam.Texture(np.repeat(VALUES[..., None], 3, axis=2), filter="nearest", wrap="clamp")
    # The plane is larger than the image, and each texel covers a quarter of the plane.
    found = np.unique(shown(texture))
    assert np.allclose(np.unique(srgb(VALUES / 65535)), found, atol=1e-5)
    mask = np.array([[True, False], [False, True]])
    found = shown(raycam.Texture(mask, filter="nearest"))
    assert np.array_equal(found, shown(raycam.Texture(mask.astype(np.uint8) * 255, filter="nearest")))
    assert sorted(np.unique(found)) == [0, 1]


@pytest.mark.parametrize("key", ["roughness", "metallic", "clearcoat"])
def test_uint16_data_are_linear_in_arrays_and_files(key: str, tmp_path: Path) -> None:
    values = np.full((2, 2), 32768, dtype=np.uint16)
    path = tmp_path / "values.png"
    cv2.imwrite(str(path), values)
    expected = lit({key: (values / 65535).astype(np.float32)}, color=[0.8, 0.4, 0.2])
    for given in (values, raycam.Texture(values), path):
        assert np.allclose(lit({key: given}, color=[0.8, 0.4, 0.2]), expected, rtol=1e-3, atol=1e-5), given


def test_unsupported_texture_dtypes_are_refused() -> None:
    with raises(raycam.WorldError, mentions=["int32"]):
        shown(np.zeros((2, 2, 3), dtype=np.int32))


@pytest.mark.parametrize("key", ["texture", "roughness", "metallic", "transmission", "normal"])
def test_values_outside_0_to_1_are_clamped_with_a_notice(key: str, tmp_path: Path) -> None:
    values = np.full((4, 4, 3), 0.5, dtype=np.float32)
    values[0] = 200
    values[1, :2] = -3
    path = tmp_path / "values.hdr"
    cv2.imwrite(str(path), np.maximum(values, 0))
    clamped = np.clip(values, 0, 1)
    with warns(raycam.Notice, mentions=["18 values"]):
        found = shown(values) if key == "texture" else lit({key: values})
    expected = shown(clamped) if key == "texture" else lit({key: clamped})
    assert np.array_equal(found, expected)
    with warns(raycam.Notice, mentions=["12 values"]):
        shown(path) if key == "texture" else lit({key: path})


def test_emission_may_exceed_1_but_not_fall_below_0() -> None:
    values = np.full((4, 4, 3), 7.0, dtype=np.float32)

    def glow(image: npt.NDArray[Any]) -> float:
        color = lit({"emission": image}, emission=[1, 1, 1], color=[0, 0, 0])
        return float(color.max())

    assert glow(values) > 7
    values[:2] = -1
    with warns(raycam.Notice, mentions=["24 values"]):
        glow(values)
