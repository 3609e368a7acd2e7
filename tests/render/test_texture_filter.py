"""Texture filtering, compared with closed forms.

The tests cover alpha, exact footprints, wide angles, and unlit and emissive surfaces.
"""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
import numpy.typing as npt
import pytest
import raycam

BLACK_SKY = {"type": "sky", "radiance": [0, 0, 0]}


def from_above(size: int, width: float = 2.0, turn: float = 0.0) -> raycam.Camera:
    """A camera far above the origin whose image shows `width` metres.

    It is turned about the viewing direction by an angle in degrees.
    """
    height = 100.0
    fov = float(np.degrees(2 * np.arctan(width / 2 / height)))
    up = [float(np.sin(np.radians(turn))), float(np.cos(np.radians(turn))), 0.0]
    return raycam.Camera.look_at([0, 0, height], [0, 0, 0], size=(size, size), fov=fov, up=up)


def plane(texture: npt.NDArray[np.uint8], size: float = 2.0, **style: Any) -> raycam.World:
    world = raycam.World()
    world.add_object(plane={"size": [size, size]}, texture=texture, **style)
    world.add_light(**BLACK_SKY)
    return world


def linear(values: npt.NDArray[np.uint8]) -> npt.NDArray[np.float64]:
    """Linear values of 8-bit sRGB (IEC 61966-2-1)."""
    v = values / 255.0
    return np.where(v <= 0.04045, v / 12.92, ((v + 0.055) / 1.055) ** 2.4)


@pytest.mark.parametrize("texels", [8, 64, 256])
def test_transparent_texels_do_not_show_their_color(texels: int) -> None:
    rng = np.random.default_rng(texels)
    opaque = rng.random((texels, texels)) < 0.4
    texture = np.where(opaque[..., None], [200, 0, 0, 255], [0, 255, 255, 0]).astype(np.uint8)
    world = plane(texture, type="unlit", alpha="blend")
    frame = raycam.render(world, from_above(16), integrator="path", samples=64, channels="color")
    assert frame["color"][..., 1:].max() < 1e-5
    assert frame["color"][..., 0].max() > 0.1


def test_minified_alpha_textures_show_the_mean_of_color_times_alpha() -> None:
    rng = np.random.default_rng(3)
    texture = rng.integers(0, 256, (128, 128, 4)).astype(np.uint8)
    frame = raycam.render(
        plane(texture, type="unlit", alpha="blend"),
        from_above(16),
        integrator="path",
        samples=1024,
        channels="color",
    )
    premultiplied = linear(texture[..., :3]) * texture[..., 3:] / 255.0
    # OpenCV's area interpolation is the exact mean of 8 x 8 texels. Rows of a texture run from v = 0 at its top.
    expected = cv2.resize(premultiplied, (16, 16), interpolation=cv2.INTER_AREA)
    error = frame["color"][1:-1, 1:-1] - expected[1:-1, 1:-1]
    assert abs(float(error.mean())) < 0.003
    assert float(np.sqrt((error**2).mean())) < 0.03


@pytest.mark.parametrize("turn", [0.0, 30.0, 45.0, 100.0])
@pytest.mark.parametrize("dense", ["u", "v"])
def test_textures_dense_along_one_axis_stay_sharp_along_the_other(dense: str, turn: float) -> None:
    stripes = 16
    row = np.repeat(np.arange(stripes) % 2 * 255, 1)
    texture = np.repeat(row[:, None], 2048, axis=1) if dense == "u" else np.repeat(row[None], 2048, axis=0)
    texture = np.repeat(texture[..., None], 3, axis=2).astype(np.uint8)
    camera = from_above(64, 2.0, turn)
    frame = raycam.render(
        plane(texture, type="unlit"), camera, integrator="path", samples=64, channels=["color", "uv"]
    )
    uv = frame["uv"][..., 1 if dense == "u" else 0] * stripes
    # The pixels whose whole area is on the plane.
    known = ((frame["uv"] > 0.03) & (frame["uv"] < 0.97)).all(axis=2)
    # Pixels in the middle of a stripe, which is 4 pixels wide and bilinearly interpolated.
    middle = known & (np.abs(uv - np.floor(uv) - 0.5) < 0.15)
    expected = np.floor(uv[middle]).astype(int) % 2
    found = frame["color"][..., 0][middle]
    assert middle.sum() > 100
    assert np.abs(found - expected).max() < 0.3


@pytest.mark.parametrize("fov", [60, 120, 150])
def test_wide_angles_keep_the_contrast_at_the_border(fov: float) -> None:
    """A plane parallel to the image plane has the same scale and contrast everywhere."""
    pixels, stripe = 128, 4
    width = 2 * np.tan(np.radians(fov / 2))
    column = np.arange(2 * pixels) // stripe % 2 * 255
    texture = np.repeat(np.repeat(column[None], 8, axis=0)[..., None], 3, axis=2).astype(np.uint8)
    world = plane(texture, size=2 * float(width), type="unlit")
    camera = raycam.Camera.look_at([0, 0, 1], [0, 0, 0], size=(pixels, pixels), fov=fov, up=[0, 1, 0])
    for samples in (1, 16):
        frame = raycam.render(world, camera, integrator="path", samples=samples, channels="color")
        line = frame["color"][pixels // 2, :, 0]
        center, border = line[pixels // 2 - 16 : pixels // 2 + 16], line[:16]
        # At 150 degrees, the cone of the image centre would lose 28 % of the contrast, and a round cone 17 %.
        assert border.std() == pytest.approx(center.std(), rel=0.03), samples


@pytest.mark.parametrize("style", [{"type": "unlit"}, {"emission": 1.0, "color": [0, 0, 0]}, {}])
def test_fine_patterns_are_averaged_without_light(style: dict[str, Any]) -> None:
    """A checkerboard of 16 texels per pixel has the linear mean 0.5 everywhere: no moire."""
    board = ((np.indices((1024, 1024)).sum(axis=0) % 2) * 255).astype(np.uint8)
    texture = np.repeat(board[..., None], 3, axis=2)
    world = raycam.World()
    emissive = "emission" in style
    textures: dict[str, Any] = {"textures": {"emission": texture}} if emissive else {"texture": texture}
    world.add_object(plane={"size": [2, 2]}, **textures, **style)
    world.add_light(**BLACK_SKY)
    integrator = "path" if style else "flat"
    frame = raycam.render(world, from_above(64, 1.9), integrator=integrator, samples=1, channels="color")
    assert np.abs(frame["color"][2:-2, 2:-2] - 0.5).max() < 0.05
