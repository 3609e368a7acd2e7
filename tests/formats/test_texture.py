"""Textures of materials: arrays, files, all keys, and invalid textures."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import OpenEXR
import pytest
import raycam
from PIL import Image
from support.raises import fault, raises


def floor(**style: object) -> np.ndarray:
    """The colours [2, 2, 3] of a plane of 2 x 2 m under a white sky, seen from above."""
    world = raycam.World()
    world.add_object(plane={"size": 2}, **style)
    world.add_light(type="sky", radiance=[1, 1, 1])
    fov = np.degrees(2 * np.arctan(1e-3))
    camera = raycam.Camera.look_at([0, 0, 1e3], [0, 0, 0], up=[0, 1, 0], size=(2, 2), fov=fov)
    return raycam.render(world, camera, integrator="path", samples=64, max_depth=2)["color"]


def test_byte_arrays_are_srgb_and_float_arrays_are_linear() -> None:
    quarters = np.array([[0.1, 0.2], [0.4, 0.8]])
    texture = raycam.Texture(quarters, filter="nearest")
    assert floor(type="matte", texture=texture)[..., 0] == pytest.approx(quarters, abs=2e-3)
    grey = np.full((2, 2), 188, np.uint8)
    linear = ((188 / 255 + 0.055) / 1.055) ** 2.4
    assert floor(type="matte", texture=grey) == pytest.approx(linear, abs=2e-3)


def test_texture_is_repeated_and_rotated() -> None:
    stripes = raycam.Texture(np.array([[0.0, 1.0]]), filter="nearest", rotation=90)
    top, bottom = floor(type="matte", texture=stripes)[..., 0]
    assert sorted([top[0], bottom[0]]) == pytest.approx([0, 1], abs=1e-2)
    assert top[0] == pytest.approx(top[1], abs=1e-2)
    fine = raycam.Texture(np.array([[0.0, 1.0]]), filter="nearest", repeat=[8, 1])
    assert floor(type="matte", texture=fine) == pytest.approx(0.5, abs=0.05)


def test_data_textures_are_not_converted_from_srgb(tmp_path: Path) -> None:
    Image.fromarray(np.full((2, 2), 128, np.uint8)).save(tmp_path / "half.png")
    world = raycam.World.from_dict(
        {
            "object": {
                "plane": {},
                "type": "principled",
                "color": [1, 1, 1],
                "emission": [2, 2, 2],
                "textures": {"emission": "half.png", "metallic": "half.png", "roughness": "half.png"},
            },
            "light": {"type": "sky", "radiance": [0, 0, 0]},
        },
        folder=tmp_path,
    )
    camera = raycam.Camera.look_at([0, 0, 3], [0, 0, 0], up=[0, 1, 0], size=(1, 1), fov=1)
    seen = raycam.render(world, camera, integrator="path", samples=4)["color"]
    assert seen == pytest.approx(2 * ((128 / 255 + 0.055) / 1.055) ** 2.4, rel=1e-3)
    assert world.counts["textures"] == 3


@pytest.mark.parametrize("tile", [0, 7])
@pytest.mark.parametrize("compression", ["DWAA", "DWAB", "PIZ", "PXR24", "B44A", "ZIPS", "RLE"])
def test_incompressible_exr_blocks_are_read(tmp_path: Path, compression: str, tile: int) -> None:
    """EXR stores a block uncompressed if compression would not make it smaller."""
    stored = np.random.default_rng(5).random((12, 12, 3)).astype(np.float16)
    header: dict[str, object] = {"compression": getattr(OpenEXR, f"{compression}_COMPRESSION")}
    if tile:
        header["tiles"] = OpenEXR.TileDescription()
        header["tiles"].xSize = header["tiles"].ySize = tile
    header["type"] = OpenEXR.tiledimage if tile else OpenEXR.scanlineimage
    OpenEXR.File(header, {"RGB": stored}).write(str(tmp_path / "a.exr"))
    with OpenEXR.File(str(tmp_path / "a.exr")) as file:
        expected = (
            file.channels()["RGB"].pixels.astype(np.float32).clip(0)
        )  # lossy compression makes a value negative
    table = {"plane": {"size": 2}, "texture": {"image": "a.exr", "filter": "nearest"}}
    world = raycam.World.from_dict({"object": table}, folder=tmp_path)
    fov = np.degrees(2 * np.arctan(1e-3))
    camera = raycam.Camera.look_at([0, 0, 1e3], [0, 0, 0], up=[0, 1, 0], size=(12, 12), fov=fov)
    seen = raycam.render(world, camera, channels=["albedo"], samples=1)["albedo"]
    assert seen == pytest.approx(expected, abs=1e-6)


def test_normal_map_changes_the_lighting() -> None:
    tilted = np.array([[[128, 255, 128]]], np.uint8)
    flat = np.array([[[128, 128, 255]]], np.uint8)
    found = []
    for image in (flat, tilted):
        world = raycam.World()
        world.add_object(plane={"size": 2}, type="matte", color=[1, 1, 1], textures={"normal": image})
        world.add_light(type="sun", direction=[0, 0, -1], irradiance=[np.pi] * 3)
        camera = raycam.Camera.look_at([0, 0, 3], [0, 0, 0], up=[0, 1, 0], size=(1, 1), fov=1)
        found.append(float(raycam.render(world, camera, integrator="direct")["color"][0, 0, 0]))
    assert found[0] == pytest.approx(1, abs=0.01)
    assert found[1] < 0.2


def test_invalid_textures_are_refused() -> None:
    world = raycam.World()
    for image, words in [
        (np.zeros((2, 2, 5)), fault("wrong_shape", "1..4")),
        (np.zeros(3), fault("wrong_shape", "[3]")),
        (np.zeros((2, 2), np.int64), fault("wrong_type", "int64")),
    ]:
        with raises(raycam.WorldError, **words):
            world.add_object(plane={}, texture=raycam.Texture(image))
    with raises(raycam.WorldError, code="conflicting_values"):
        world.add_object(plane={}, textures={"roughness": raycam.Texture(np.zeros((2, 2)))})


def test_distant_texture_is_averaged_and_near_texture_sharp_at_one_sample() -> None:
    world = raycam.World()
    checks = raycam.Texture(np.array([[0.0, 1.0], [1.0, 0.0]]), filter="nearest", repeat=500)
    world.add_object(plane={"size": 1000}, type="matte", texture=checks)
    world.add_light(type="sky", radiance=[1, 1, 1])
    camera = raycam.Camera.look_at([0.1, 0, 1], [0.1, 10, 0.6], up=[0, 0, 1], size=(160, 120), fov=40)
    channels = ["color", "depth"]
    frame = raycam.render(world, camera, integrator="path", samples=1, max_depth=2, channels=channels)
    seen, depth = frame["color"][..., 0], frame["depth"]
    far = seen[(depth > 40) & np.isfinite(depth)]
    near = seen[depth < 4]
    assert far.size > 500
    assert far.mean() == pytest.approx(0.5, abs=0.01)
    assert far.std() < 0.03
    # A checkerboard with squares of 1 m, in which almost all values are black or white.
    assert ((near < 0.02) | (near > 0.98)).mean() > 0.85


def test_image_reader_notices_reach_the_world(tmp_path: Path) -> None:
    Image.fromarray(np.full((2, 2, 4), 100, np.uint8), "RGBA").save(tmp_path / "glass.png")
    world = raycam.World(folder=tmp_path)
    (tmp_path / "a.mtl").write_text("newmtl m\nmap_Kd glass.png\n")
    (tmp_path / "a.obj").write_text("mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl m\nf 1 2 3\n")
    world.add_object(mesh="a.obj")
    assert any(notice.code == "unused_alpha" for notice in world.notices), world.notices
