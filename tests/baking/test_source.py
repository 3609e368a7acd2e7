"""Maps of a detailed model on a simple object, compared with closed forms and shading."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
import raycam
from raycam.baking.tangents import corner_tangents, tangent_space_normals
from raycam.cli import main
from raycam.notices import collected
from support.raises import notice_codes, raises
from support.textured_panel import panel, pattern


def waves(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Height and unit normal of a wavy surface."""
    height = 0.02 * np.sin(5 * x) * np.cos(4 * y)
    slope = np.stack(
        [-0.1 * np.cos(5 * x) * np.cos(4 * y), 0.08 * np.sin(5 * x) * np.sin(4 * y), np.ones_like(x)], axis=-1
    )
    return height, slope / np.linalg.norm(slope, axis=-1, keepdims=True)


def wavy(cells: int = 120, thin: bool = False) -> raycam.World:
    """The wavy surface; with `thin`, also a parallel surface 5 mm below that faces down."""
    side = np.linspace(-1.1, 1.1, cells + 1)
    x, y = (each.ravel() for each in np.meshgrid(side, side))
    corner = (np.arange(cells)[:, None] * (cells + 1) + np.arange(cells)).ravel()
    a, b, c, d = corner, corner + 1, corner + cells + 2, corner + cells + 1
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    height, normals = waves(x, y)
    world = raycam.World()
    world.add_mesh(
        np.stack([x, y, height], axis=1), faces, normals=normals, name="waves", color=[0.2, 0.5, 0.1]
    )
    if thin:
        world.add_mesh(np.stack([x, y, height - 0.005], axis=1), faces[:, ::-1], name="below", color="red")
    return world


def grid(size: int) -> tuple[np.ndarray, np.ndarray]:
    """x and y of the panel at the texel centres."""
    place = (np.arange(size) + 0.5) * 2 / size - 1
    return np.meshgrid(place, -place)


@pytest.mark.parametrize("thin", [False, True])
def test_source_maps_contain_the_nearest_source_surface(thin: bool) -> None:
    names = ["position", "shading_normal", "tangent_normal", "albedo"]
    maps = raycam.bake(panel(), names, size=32, source=wavy(thin=thin), cage=0.05)
    height, normal = waves(*grid(32))
    np.testing.assert_allclose(maps["position"][..., 2], height, atol=2e-4)
    np.testing.assert_allclose(maps["shading_normal"], normal, atol=2e-3)
    # On this panel, the x and y axes of tangent space are those of the world: texture coordinates run downwards.
    np.testing.assert_allclose(maps["tangent_normal"], normal, atol=2e-3)
    expected = raycam.World()
    expected.add_object(plane={"size": [4, 4]}, color=[0.2, 0.5, 0.1])
    albedo = expected.cast_rays([[0, 0, 1]], [[0, 0, -1]], fields=("albedo",))["albedo"][0]
    np.testing.assert_allclose(maps["albedo"], np.broadcast_to(albedo, (32, 32, 3)), atol=1e-6)
    assert not maps.missed.any()


def test_source_equal_to_the_object_gives_the_same_maps() -> None:
    world = panel()
    maps = raycam.bake(world, ["position", "tangent_normal", "ao"], size=16, source=world, samples=8)
    own = raycam.bake(world, ["position", "tangent_normal", "ao"], size=16, samples=8)
    for name in maps:
        np.testing.assert_allclose(maps[name], own[name], atol=1e-6)
    np.testing.assert_allclose(own["tangent_normal"], np.broadcast_to([0, 0, 1], (16, 16, 3)), atol=1e-6)


def test_texels_beyond_the_cage_are_marked_and_reported() -> None:
    source = raycam.World()
    square = [[-1, 1, 0.01], [-1, -1, 0.01], [0, -1, 0.01], [0, 1, 0.01]]
    source.add_mesh(square, [[0, 1, 2], [0, 2, 3]])
    with collected() as notices:
        maps = raycam.bake(panel(), ["position"], size=16, source=source)
    assert notice_codes(notices) == ["missed_source"]
    assert "128 of 256" in str(notices[0])
    np.testing.assert_array_equal(maps.missed, grid(16)[0] > 0)
    np.testing.assert_allclose(maps["position"][..., 2], np.where(maps.missed, 0, 0.01), atol=1e-7)
    with collected() as notices:
        assert raycam.bake(panel(), ["position"], size=16, source=source, cage=0.005).missed.all()


def test_occlusion_considers_only_the_source() -> None:
    world = panel()
    world.add_object(box={"size": [1, 1, 1]}, location=[0, 0, 0.6])
    assert (raycam.bake(world, ["ao"], size=8, source=panel(), samples=16)["ao"] == 1).all()
    assert raycam.bake(world, ["ao"], size=8, samples=16)["ao"].min() < 0.2


def test_normals_of_a_fine_sphere_baked_on_a_coarse_sphere_are_radial() -> None:
    low, high = raycam.World("y"), raycam.World("y")
    low.add_object(sphere={"radius": 1, "level": 2}, name="ball")
    high.add_object(sphere={"radius": 1, "level": 6})
    maps = raycam.bake(low, ["tangent_normal", "shading_normal", "position"], size=128, source=high, cage=0.1)
    known = maps.covered & ~maps.missed
    assert known.sum() > 0.9 * maps.covered.sum()
    position = maps["position"][known]
    radial = position / np.linalg.norm(position, axis=1, keepdims=True)
    np.testing.assert_allclose(maps["shading_normal"][known], radial, atol=5e-3)
    # The coarse ball has smooth normals too, so its map is almost flat.
    assert maps["tangent_normal"][known][:, 2].min() > 0.9


def test_tangents_of_mirrored_texture_coordinates_have_the_opposite_sign() -> None:
    positions = np.array([[[0, 0, 0], [1, 0, 0], [0, 1, 0]]] * 2, float)
    positions[1] += [5, 0, 0]
    normals = np.zeros((2, 3, 3))
    normals[..., 2] = 1
    uvs = np.array([[[0, 1], [1, 1], [0, 0]], [[1, 1], [0, 1], [1, 0]]], float)
    found = corner_tangents(positions, normals, uvs)
    np.testing.assert_allclose(found[0], [[1, 0, 0, 1]] * 3, atol=1e-6)
    np.testing.assert_allclose(found[1], [[-1, 0, 0, -1]] * 3, atol=1e-6)


def test_tangent_space_normals_are_inverted_by_the_renderer() -> None:
    random = np.random.default_rng(0)

    def unit() -> np.ndarray:
        vectors = random.normal(size=(50, 3))
        return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)

    shading, tangent, normals = unit(), unit(), unit()
    signs = np.where(random.random(50) < 0.5, -1.0, 1.0)
    x, y, z = tangent_space_normals(normals, shading, tangent, signs).T[..., None]
    bitangent = np.cross(shading, tangent) * signs[:, None]
    bitangent /= np.linalg.norm(bitangent, axis=1, keepdims=True)
    total = tangent * x + bitangent * y + shading * z
    np.testing.assert_allclose(total / np.linalg.norm(total, axis=1, keepdims=True), normals, atol=1e-9)


def test_albedo_without_source_and_cage_without_source_are_refused() -> None:
    with raises(raycam.SettingsError, code="missing_value", mentions=["albedo", "source"]):
        raycam.bake(panel(), ["albedo"], size=8)
    with raises(raycam.SettingsError, mentions=["cage"]):
        raycam.bake(panel(), ["normal"], size=8, source=wavy(4), cage=-1)


def test_command_bakes_a_source_onto_an_atlas(tmp_path: Path) -> None:
    low = raycam.World("y")
    low.add_mesh([[-1, 1, 0], [-1, -1, 0], [1, -1, 0], [1, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    low.to_gltf(tmp_path / "low.glb")
    panel(pattern(), up="y").to_gltf(tmp_path / "high.glb")
    options = ["--from", str(tmp_path / "high.glb"), "--atlas", "cells", "--maps", "tangent_normal", "albedo"]
    common = ["--size", "32", "--cage", "0.1", "-o", str(tmp_path / "maps")]
    assert main(["bake", str(tmp_path / "low.glb"), *options, *common]) == 0
    normal = cv2.imread(str(tmp_path / "maps/tangent_normal.png"), cv2.IMREAD_UNCHANGED)
    assert normal.dtype == np.uint16
    np.testing.assert_allclose(normal[8, 8, ::-1] / 65535, [0.5, 0.5, 1], atol=1e-4)
    assert (tmp_path / "maps/albedo.exr").exists()


def test_green_down_reverses_y_of_tangent_normals(tmp_path: Path) -> None:
    up, down = (
        raycam.bake(panel(), ["tangent_normal"], size=16, source=wavy(), cage=0.05, green=green)
        for green in ("up", "down")
    )
    assert np.abs(up["tangent_normal"][..., 1]).max() > 0.05
    np.testing.assert_array_equal(down["tangent_normal"], up["tangent_normal"] * [1, -1, 1])
    # OpenGL's green grows with the slope towards the image's upper edge, which is +y here.
    _, normal = waves(*grid(16))
    np.testing.assert_allclose(up["tangent_normal"][..., 1], normal[..., 1], atol=2e-3)


def test_material_maps_show_the_source(tmp_path: Path) -> None:
    source = raycam.World()
    half = [[-1, 1, 0], [-1, -1, 0], [0, -1, 0], [0, 1, 0]]
    faces = [[0, 1, 2], [0, 2, 3]]
    glowing = {"type": "principled", "roughness": 0.3, "metallic": 0.8, "emission": [2.0, 1.0, 0.5]}
    source.add_mesh(half, faces, material=glowing)
    source.add_mesh(
        np.add(half, [1, 0, 0]), faces, material={"type": "metal", "metal": "gold", "roughness": 0.1}
    )
    maps = raycam.bake(panel(), ["roughness", "metallic", "emission"], size=16, source=source)
    left = (grid(16)[0] < 0)[..., None]
    np.testing.assert_allclose(maps["roughness"], np.where(left[..., 0], 0.3, 0.1), atol=1e-6)
    np.testing.assert_allclose(maps["metallic"], np.where(left[..., 0], 0.8, 1.0), atol=1e-6)
    np.testing.assert_allclose(maps["emission"], np.where(left, [2.0, 1.0, 0.5], 0.0), atol=1e-6)
    names = [path.name for path in maps.save(tmp_path)]
    assert names == ["roughness.png", "metallic.png", "emission.exr"]
    read = cv2.imread(str(tmp_path / "roughness.png"), cv2.IMREAD_UNCHANGED)
    np.testing.assert_allclose(read / 65535, maps["roughness"], atol=1e-4)
    for name in ("roughness", "metallic", "emission"):
        with raises(raycam.SettingsError, code="missing_value", mentions=[name, "source"]):
            raycam.bake(panel(), [name], size=8)


def test_textured_roughness_and_metallic_are_green_and_blue() -> None:
    random = np.random.default_rng(0)
    texels = random.integers(0, 256, (8, 8, 3)).astype(np.uint8)
    source = panel()
    textured = {
        "type": "principled",
        "roughness": 0.9,
        "metallic": 0.6,
        "textures": {name: raycam.Texture(texels, filter="nearest") for name in ("roughness", "metallic")},
    }
    corners = [[-1, 1, 0.01], [-1, -1, 0.01], [1, -1, 0.01], [1, 1, 0.01]]
    source = raycam.World()
    source.add_mesh(corners, [[0, 1, 2], [0, 2, 3]], uvs=[[0, 0], [0, 1], [1, 1], [1, 0]], material=textured)
    maps = raycam.bake(panel(), ["roughness", "metallic"], size=8, source=source, cage=0.05)
    np.testing.assert_allclose(maps["roughness"], 0.9 * texels[..., 1] / 255, atol=2e-3)
    np.testing.assert_allclose(maps["metallic"], 0.6 * texels[..., 2] / 255, atol=2e-3)
