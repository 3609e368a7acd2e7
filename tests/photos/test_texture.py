"""Textures from photographs: round trips, seen texels by brute force, and bad input."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
import raycam
from raycam.cli import main
from support.raises import raises

LENSES = [
    {},
    {"model": "fisheye", "distortion": [0.02, -0.01, 0.003, -0.001]},
    {"model": "opencv", "distortion": [-0.1, 0.02, 0.001, 0.0005]},
    {"model": "division", "distortion": [-0.05]},
    {"model": "fov", "distortion": [0.4]},
]


def pattern(size: int = 64) -> np.ndarray:
    """A smooth sRGB pattern that every lens resolves."""
    x, y = np.meshgrid(np.arange(size) / size, np.arange(size) / size)
    waves = np.stack([np.sin(6 * x + 2 * y), np.cos(5 * y - x), np.sin(4 * x * y + 1)], axis=2)
    return np.rint(128 + 90 * waves).astype(np.uint8)


def panel(wall: bool = False, up: str = "z") -> raycam.World:
    world = raycam.World(up)
    world.add_mesh(
        [[-1, 1, 0], [-1, -1, 0], [1, -1, 0], [1, 1, 0]],
        [[0, 1, 2], [0, 2, 3]],
        uvs=[[0, 0], [0, 1], [1, 1], [1, 0]],
        name="panel",
        material={"type": "unlit", "texture": raycam.Texture(pattern(), wrap="clamp")},
    )
    if wall:
        world.add_object(box={"size": [0.5, 0.5, 0.6]}, location=[0.2, 0, 0.35], color="red", type="unlit")
    return world


def shots(world: raycam.World, places: list, **lens: object) -> tuple[dict, dict]:
    cameras = {
        f"{i}.png": raycam.Camera.look_at(place, [0, 0, 0], up=[0, 1, 0], fov=60, size=(400, 400), **lens)
        for i, place in enumerate(places)
    }
    return cameras, {
        name: raycam.render(world, camera, samples=16).to_srgb8() for name, camera in cameras.items()
    }


def psnr(a: np.ndarray, b: np.ndarray) -> float:
    return float(10 * np.log10(255**2 / ((a.astype(float) - b) ** 2).mean()))


def inner(texture: np.ndarray) -> np.ndarray:
    """The texels away from the panel's edge, where pixels of the photographs mix it with the background."""
    return texture[3:-3, 3:-3]


@pytest.mark.parametrize("lens", LENSES)
def test_round_trip_reaches_40_decibels(lens: dict) -> None:
    world = panel()
    cameras, photos = shots(world, [[0.3, 0.2, 2.4], [-0.5, 0.1, 2.4]], **lens)
    result = raycam.texture_from_photos(world, cameras, photos, size=64)
    assert result.seen.all()
    assert psnr(inner(result.texture), inner(pattern())) > 40
    frame = raycam.render(result.world, cameras["0.png"], samples=16).to_srgb8()
    assert psnr(frame[100:300, 100:300], photos["0.png"][100:300, 100:300]) > 38


def test_only_texels_that_a_camera_sees_are_coloured() -> None:
    world = panel(wall=True)
    cameras, photos = shots(world, [[2, 0.1, 1.5]])
    result = raycam.texture_from_photos(world, cameras, photos, size=32, show_unseen=True)
    camera = cameras["0.png"]
    # By brute force: a segment from the camera meets the box, or not (slabs).
    grid = (np.arange(32) + 0.5) / 16 - 1
    points = np.stack([*np.meshgrid(grid, -grid), np.zeros((32, 32))], axis=2)
    low, high = np.array([-0.05, -0.25, 0.05]), np.array([0.45, 0.25, 0.65])
    with np.errstate(divide="ignore"):
        a, b = (low - camera.C) / (points - camera.C), (high - camera.C) / (points - camera.C)
    enter, leave = np.minimum(a, b).max(axis=2), np.maximum(a, b).min(axis=2)
    hidden = (enter <= leave) & (leave >= 0) & (enter <= 1)
    assert 20 < hidden.sum() < 600
    pixels, _ = camera.project(points.reshape(-1, 3))
    inside = ((pixels >= -0.5) & (pixels < 399.5)).all(axis=1).reshape(32, 32)
    ways = camera.C - points
    steep = ways[..., 2] / np.linalg.norm(ways, axis=2) > np.cos(np.radians(80))
    np.testing.assert_array_equal(result.seen, ~hidden & inside & steep)
    assert (result.texture[~result.seen] == [255, 0, 255]).all()
    # Without show_unseen, an unseen texel has the colour of one of the seen texels nearest to it.
    filled = raycam.texture_from_photos(world, cameras, photos, size=32).texture
    known, colors = points[result.seen], filled[result.seen].astype(int)
    for place, color in zip(points[~result.seen], filled[~result.seen].astype(int), strict=True):
        distance = np.linalg.norm(known - place, axis=1)
        assert (colors[distance <= distance.min() + 1e-9] == color).all(axis=1).any()


def test_outlier_is_left_out_and_disagrees() -> None:
    world = panel()
    cameras, photos = shots(world, [[0.3, 0.2, 2.4], [-0.5, 0.1, 2.4], [0.1, -0.4, 2.4]])
    clean = raycam.texture_from_photos(world, cameras, photos, size=64)
    photos["1.png"] = np.where(np.arange(400)[:, None, None] > 200, 255, photos["1.png"]).astype(np.uint8)
    result = raycam.texture_from_photos(world, cameras, photos, size=64)
    assert psnr(inner(result.texture), inner(pattern())) > 38
    assert result.disagreement[40:].mean() > 5 * clean.disagreement.mean()


def test_same_bytes_for_any_order_and_threads() -> None:
    world = panel()
    cameras, photos = shots(world, [[0.3, 0.2, 2.4], [-0.5, 0.1, 2.4], [0.1, -0.4, 2.4]])
    one = raycam.texture_from_photos(world, cameras, photos, size=32, threads=1)
    two = raycam.texture_from_photos(world, dict(reversed(cameras.items())), photos, size=32, threads=2)
    np.testing.assert_array_equal(one.texture, two.texture)


def test_photograph_of_another_size_is_refused() -> None:
    world = panel()
    cameras, photos = shots(world, [[0.3, 0.2, 2.4]])
    with raises(raycam.SettingsError, code="invalid_settings", mentions=["200 x 200", "400 x 400"]):
        raycam.texture_from_photos(world, cameras, {"0.png": photos["0.png"][::2, ::2]}, size=8)


def test_missing_photograph_and_coordinates_are_refused(tmp_path: Path) -> None:
    world = panel()
    cameras, photos = shots(world, [[0.3, 0.2, 2.4]])
    with pytest.raises(FileNotFoundError):
        raycam.texture_from_photos(world, cameras, tmp_path, size=8)
    bare = raycam.World()
    bare.add_mesh([[-1, -1, 0], [1, -1, 0], [0, 1, 0]], [[0, 1, 2]])
    with raises(raycam.WorldError, code="missing_value", mentions=["object 0"]):
        raycam.texture_from_photos(bare, cameras, photos, size=8)


def test_command_texture_writes_a_glb(tmp_path: Path) -> None:
    world = panel(up="y")  # as in glTF
    cameras, photos = shots(world, [[0.3, 0.2, 2.4], [-0.5, 0.1, 2.4]])
    for name, pixels in photos.items():
        cv2.imwrite(str(tmp_path / name), pixels[..., ::-1])
    world.to_gltf(tmp_path / "panel.glb")
    raycam.save_cameras(tmp_path / "sparse", cameras, "colmap", images={name: name for name in cameras})
    common = ["texture", str(tmp_path / "panel.glb"), "--cameras", str(tmp_path / "sparse")]
    assert (
        main([*common, "--photos", str(tmp_path), "-o", str(tmp_path / "out.glb"), "--texture-size", "64"])
        == 0
    )
    assert raycam.load(tmp_path / "out.glb").counts["triangles"] == 2
