"""Images of UsdPreviewSurface.

Wrapping, transforms and opacity are compared with values computed from the images' pixels.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import raycam
from pxr import Gf, UsdShade
from support.raises import has_notice, notice_codes
from support.usd_stages import bind, image, material, square, stage, uvs, write_image

PIXELS = np.random.default_rng(7).integers(0, 256, (4, 8, 3), dtype=np.uint8)


def linear(srgb: npt.ArrayLike) -> npt.NDArray[np.float64]:
    values = np.asarray(srgb, float) / 255
    return np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)


def index(place: npt.NDArray[np.int64], size: int, wrap: str) -> npt.NDArray[np.int64]:
    """The index of the texel at a position outside of the image; -1 for black."""
    if wrap == "clamp":
        return np.clip(place, 0, size - 1)
    if wrap == "mirror":
        turn = place % (2 * size)
        return np.minimum(turn, 2 * size - 1 - turn)
    if wrap == "black":
        return np.where((place >= 0) & (place < size), place, -1)
    return place % size


def looked_up(
    pixels: npt.NDArray[np.uint8], u: Any, v: Any, wraps: tuple[str, str]
) -> npt.NDArray[np.float64]:
    """The bilinear value at texture coordinates with v upwards, as in UsdPreviewSurface."""
    height, width = pixels.shape[:2]
    x, y = u * width - 0.5, (1 - v) * height - 0.5
    left, top = np.floor(x).astype(int), np.floor(y).astype(int)
    total = np.zeros((*np.shape(u), 3))
    for dx in (0, 1):
        for dy in (0, 1):
            column, row = index(left + dx, width, wraps[0]), index(top + dy, height, wraps[1])
            weight = np.abs(1 - dx - (x - left)) * np.abs(1 - dy - (y - top))
            color = linear(pixels[row, column])
            color[(column < 0) | (row < 0)] = 0
            total += weight[..., None] * color
    return total


def seen(
    folder: Path,
    wraps: tuple[str, str] = ("repeat", "repeat"),
    transform: dict[str, Any] | None = None,
    corners: tuple[float, float] = (-1.5, 2.5),
    size: int = 48,
) -> tuple[npt.NDArray[np.float64], Any, Any, raycam.World]:
    """The colours of a square seen from above, and the coordinates of its pixels.

    The coordinates range between `corners`.
    """
    write_image(folder / "image.png", PIXELS)
    made = stage(folder / "a.usda")
    mesh, paint = square(made), material(made, "/paint")
    low, high = corners
    uvs(mesh, [(low, low), (high, low), (high, high), (low, high)])
    image(made, paint, "image.png", {"diffuseColor": "rgb"}, transform, wrapS=wraps[0], wrapT=wraps[1])
    bind(mesh, paint)
    made.Save()
    world = raycam.load(folder / "a.usda")
    camera = raycam.Camera.look_at((0, 0, 5), (0, 0, 0), (0, 1, 0), size=(size, size), fov=20)
    frame = raycam.render(world, camera, channels=["albedo", "position"])
    assert np.isfinite(frame["position"]).all()
    s = (frame["position"][..., :2] + 1) / 2 * (high - low) + low
    return frame["albedo"], s[..., 0], s[..., 1], world


MODES = ("repeat", "mirror", "clamp", "black")


@pytest.mark.parametrize("wrap_t", MODES)
@pytest.mark.parametrize("wrap_s", MODES)
def test_image_wrap_modes_apply_per_axis(tmp_path: Path, wrap_s: str, wrap_t: str) -> None:
    shown, u, v, world = seen(tmp_path, (wrap_s, wrap_t))
    assert not world.notices
    np.testing.assert_allclose(shown, looked_up(PIXELS, u, v, (wrap_s, wrap_t)), atol=2e-3)


TRANSFORMS: list[dict[str, Any]] = [
    {"rotation": 90.0},
    {"rotation": -30.0, "scale": Gf.Vec2f(2, 0.5), "translation": Gf.Vec2f(0.25, -0.5)},
    {"scale": Gf.Vec2f(1, -2), "translation": Gf.Vec2f(0.1, 0.2)},
    {"rotation": 200.0, "scale": Gf.Vec2f(-1, 1)},
]


@pytest.mark.parametrize("number", range(len(TRANSFORMS)))
@pytest.mark.parametrize("wraps", [("repeat", "repeat"), ("mirror", "clamp"), ("black", "black")])
def test_image_transforms_follow_usdtransform2d(tmp_path: Path, number: int, wraps: tuple[str, str]) -> None:
    given = TRANSFORMS[number]
    shown, s, t, world = seen(tmp_path, wraps, given)
    assert not world.notices
    # "Scale, then rotate counter-clockwise, then translate": UsdPreviewSurface Specification, UsdTransform2d.
    scale, angle = given.get("scale", (1, 1)), np.radians(given.get("rotation", 0.0))
    s, t = s * scale[0], t * scale[1]
    s, t = np.cos(angle) * s - np.sin(angle) * t, np.sin(angle) * s + np.cos(angle) * t
    offset = given.get("translation", (0, 0))
    np.testing.assert_allclose(shown, looked_up(PIXELS, s + offset[0], t + offset[1], wraps), atol=2e-3)


@pytest.mark.parametrize("place", [None, (0.0, 0.0), (0.3, 0.6), (0.9, 0.1)])
@pytest.mark.parametrize("kind", ["unread", "missing", "misfit"])
def test_image_without_texture_coordinates_is_one_color(tmp_path: Path, kind: str, place: Any) -> None:
    # The fallback of UsdUVTexture's st and of UsdPrimvarReader is (0, 0): UsdPreviewSurface Specification.
    write_image(tmp_path / "image.png", PIXELS)
    made = stage(tmp_path / "a.usda")
    mesh, paint = square(made), material(made, "/paint")
    if kind != "missing":
        uvs(mesh, [(0.5, 0.5)] * (4 if kind == "unread" else 3))
    fallback = None if place is None or kind == "unread" else Gf.Vec2f(*place)
    image(made, paint, "image.png", {"diffuseColor": "rgb"}, fallback=fallback, wrapS="clamp", wrapT="clamp")
    if kind == "unread":
        coordinates = UsdShade.Shader(made.GetPrimAtPath("/paint/image")).GetInput("st")
        coordinates.ClearSources()
        if place is not None:
            coordinates.Set(Gf.Vec2f(*place))
    bind(mesh, paint)
    made.Save()
    world = raycam.load(tmp_path / "a.usda")
    camera = raycam.Camera.look_at((0, 0, 5), (0, 0, 0), (0, 1, 0), size=(4, 4), fov=10)
    found = raycam.render(world, camera, channels=["albedo"])["albedo"]
    u, v = place or (0.0, 0.0)
    expected = looked_up(PIXELS, np.full((4, 4), u), np.full((4, 4), v), ("clamp", "clamp"))
    np.testing.assert_allclose(found, expected, atol=2e-3)
    assert has_notice(world.notices, "missing_value", "/world/square") == (kind != "unread")


def test_unconnected_image_alpha_gives_no_notice(tmp_path: Path) -> None:
    # In the asset McUsd of usd-wg/assets, the colour comes from an image whose alpha channel is not connected
    alpha = np.full((4, 8, 1), 128, np.uint8)
    write_image(tmp_path / "image.png", np.concatenate([PIXELS, alpha], axis=2))
    made = stage(tmp_path / "a.usda")
    mesh, paint = square(made), material(made, "/paint")
    uvs(mesh)
    image(made, paint, "image.png", {"diffuseColor": "rgb"})
    bind(mesh, paint)
    made.Save()
    assert raycam.load(tmp_path / "a.usda").notices == []
    world = raycam.World()
    world.add_object(tmp_path / "a.usda")
    assert world.notices == []


def test_image_transform_that_differs_between_inputs_gives_a_notice(tmp_path: Path) -> None:
    for name in ("a", "b", "c"):
        write_image(tmp_path / f"{name}.png", PIXELS)
    made = stage(tmp_path / "a.usda")
    mesh, paint = square(made), material(made, "/paint")
    uvs(mesh)
    turn = {"rotation": 45.0}
    image(made, paint, "a.png", {"diffuseColor": "rgb"}, turn, name="a")
    image(made, paint, "b.png", {"emissiveColor": "rgb"}, turn, name="b")
    bind(mesh, paint)
    made.Save()
    assert not raycam.load(tmp_path / "a.usda").notices
    image(made, paint, "c.png", {"roughness": "r"}, {"rotation": 10.0}, name="c")
    made.Save()
    (notice,) = raycam.load(tmp_path / "a.usda").notices
    assert has_notice([notice], "ignored_feature", "rotation", "roughness")


LADDER = np.linspace(0, 255, 16).round().astype(np.uint8)


def coverage(folder: Path, pixels: npt.NDArray[np.uint8], output: str, **inputs: Any) -> Any:
    """The mean alpha of each of the 16 columns of the rendered image."""
    write_image(folder / "image.png", pixels)
    made = stage(folder / "a.usda")
    threshold = inputs.pop("opacityThreshold", None)
    surface = {} if threshold is None else {"opacityThreshold": threshold}
    mesh, paint = square(made), material(made, "/paint", **surface)
    uvs(mesh)
    image(made, paint, "image.png", {"opacity": output}, wrapS="clamp", wrapT="clamp", **inputs)
    bind(mesh, paint)
    made.Save()
    world = raycam.load(folder / "a.usda")
    camera = raycam.Camera.look_at((0, 0, 5), (0, 0, 0), (0, 1, 0), size=(64, 16), fov=22.6)
    frame = raycam.render(
        world,
        camera,
        samples=256,
        channels=["color", "alpha", "position"],
        integrator="path",
        max_depth=1,
        transparent_background=True,
    )
    middle = frame["alpha"][8]
    positions = np.linspace(-1, 1, 16, endpoint=False) + 1 / 16
    pixels_of, _ = camera.project(np.column_stack([positions, np.zeros(16), np.zeros(16)]))
    columns = np.round(pixels_of[:, 0]).astype(int)
    return middle[columns], world


@pytest.mark.parametrize(("threshold", "output"), [(0.3, "a"), (0.5, "r"), (0.85, "g"), (0.85, "a")])
def test_opacity_threshold_of_an_image_is_applied(tmp_path: Path, threshold: float, output: str) -> None:
    pixels = np.zeros((4, 16, 4), np.uint8)
    pixels[..., "rgba".index(output)] = LADDER
    if output != "a":
        pixels[..., 3] = 255
    found, world = coverage(tmp_path, pixels, output, opacityThreshold=threshold)
    expected = threshold <= LADDER / 255
    edge = np.abs(LADDER / 255 - threshold) < 1 / 15
    np.testing.assert_allclose(found[~edge], expected[~edge], atol=0.02)
    assert set(notice_codes(world.notices)) <= {"unused_alpha"}


@pytest.mark.parametrize(
    ("output", "scale", "bias"), [("a", 1.0, 0.0), ("r", 0.5, 0.25), ("b", -1.0, 1.0), ("a", 2.0, 0.0)]
)
def test_connected_channel_is_used_as_opacity(tmp_path: Path, output: str, scale: float, bias: float) -> None:
    pixels = np.full((4, 16, 4), 90, np.uint8)
    pixels[..., "rgba".index(output)] = LADDER
    found, _ = coverage(tmp_path, pixels, output, scale=Gf.Vec4f(*[scale] * 4), bias=Gf.Vec4f(*[bias] * 4))
    expected = np.clip(LADDER / 255 * scale + bias, 0, 1)
    np.testing.assert_allclose(found, expected, atol=0.12)
    assert np.abs(found - expected).mean() < 0.04


@pytest.mark.parametrize(
    ("opacity", "threshold", "shown"), [(0.4, 0.5, False), (0.6, 0.5, True), (0.5, 0.5, True)]
)
def test_opacity_threshold_of_a_constant_is_applied(
    tmp_path: Path, opacity: float, threshold: float, shown: bool
) -> None:
    made = stage(tmp_path / "a.usda")
    mesh = square(made)
    bind(mesh, material(made, "/paint", opacity=opacity, opacityThreshold=threshold))
    made.Save()
    world = raycam.load(tmp_path / "a.usda")
    camera = raycam.Camera.look_at((0, 0, 5), (0, 0, 0), (0, 1, 0), size=(4, 4), fov=10)
    frame = raycam.render(world, camera, samples=16, channels=["color", "alpha"], transparent_background=True)
    np.testing.assert_allclose(frame["alpha"], float(shown))


@pytest.mark.parametrize("bits", [8, 16])
def test_opaque_opacity_image_leaves_the_object_opaque(tmp_path: Path, bits: int) -> None:
    made = stage(tmp_path / "a.usda")
    mesh, paint = square(made), material(made, "/paint")
    uvs(mesh)
    if bits == 8:
        write_image(tmp_path / "x.png", np.dstack([PIXELS, np.full((4, 8), 255, np.uint8)]))
    else:
        deep = np.full((4, 8, 4), 65535, np.uint16)
        (tmp_path / "x.png").write_bytes(raycam._core.encode_png(deep))
    image(made, paint, "x.png", {"diffuseColor": "rgb", "opacity": "a"})
    bind(mesh, paint)
    made.Save()
    world = raycam.load(tmp_path / "a.usda")
    assert world.textures == ["x.png"] or len(world.textures) == 1
    camera = raycam.Camera.look_at((0, 0, 5), (0, 0, 0), (0, 1, 0), size=(8, 8), fov=10)
    frame = raycam.render(world, camera, samples=1, channels=["color", "alpha"], transparent_background=True)
    assert (frame["alpha"] == 1).all()


@pytest.mark.parametrize("kind", [np.uint8, np.uint16])
@pytest.mark.parametrize("channels", [1, 3, 4])
def test_fast_png_contains_the_pixels(tmp_path: Path, kind: Any, channels: int) -> None:
    pixels = np.random.default_rng(0).integers(0, np.iinfo(kind).max, (9, 7, channels), kind)
    (tmp_path / "x.png").write_bytes(raycam._core.encode_png(pixels, fast=True))
    read = raycam._core.read_texels(tmp_path / "x.png")
    assert read.dtype == kind
    np.testing.assert_array_equal(read[..., :channels], pixels)


def test_undecodable_image_gives_a_notice(tmp_path: Path) -> None:
    made = stage(tmp_path / "a.usda")
    mesh, paint = square(made), material(made, "/paint", opacityThreshold=0.5)
    uvs(mesh)
    image(made, paint, "x.png", {"opacity": "r"})
    bind(mesh, paint)
    made.Save()
    for content in (b"no image", b"version https://git-lfs.github.com/spec/v1"):
        (tmp_path / "x.png").write_bytes(content)
        world = raycam.load(tmp_path / "a.usda")
        assert len(world.objects) == 1
        assert has_notice(world.notices, "unreadable_file", "x.png")


@pytest.mark.parametrize("file", ["gone.png", "../gone.png", "https://example.org/x.png"])
def test_missing_image_gives_a_notice(tmp_path: Path, file: str) -> None:
    made = stage(tmp_path / "a.usda")
    mesh, paint = square(made), material(made, "/paint")
    uvs(mesh)
    image(made, paint, file, {"diffuseColor": "rgb"})
    bind(mesh, paint)
    made.Save()
    (notice,) = raycam.load(tmp_path / "a.usda").notices
    assert has_notice([notice], "missing_file", repr(file))


def test_udim_tiles_give_a_notice(tmp_path: Path) -> None:
    made = stage(tmp_path / "a.usda")
    mesh, paint = square(made), material(made, "/paint")
    uvs(mesh)
    image(made, paint, "x.<UDIM>.png", {"diffuseColor": "rgb"})
    bind(mesh, paint)
    write_image(tmp_path / "x.1001.png", PIXELS)
    made.Save()
    (notice,) = raycam.load(tmp_path / "a.usda").notices
    assert has_notice([notice], "unreadable_file", "'x.<UDIM>.png'")


@pytest.mark.parametrize(
    "written",
    ["./Image.PNG", r"C:\me\textures\image.png", "../maps/image.png", "/home/me/textures/image.png"],
)
def test_image_in_another_place_is_found_inside_the_folder(tmp_path: Path, written: str) -> None:
    (tmp_path / "textures").mkdir()
    write_image(tmp_path / "textures" / "image.png", PIXELS)
    if written.startswith("./"):
        write_image(tmp_path / "image.png", PIXELS)
    made = stage(tmp_path / "a.usda")
    mesh, paint = square(made), material(made, "/paint")
    uvs(mesh, [(0, 0), (1, 0), (1, 1), (0, 1)])
    image(made, paint, written, {"diffuseColor": "rgb"}, None)
    bind(mesh, paint)
    made.Save()
    world = raycam.load(tmp_path / "a.usda")
    assert world.counts["textures"] == 1, world.notices
    assert has_notice(world.notices, "substituted_file", repr(written), "image.png"), world.notices
