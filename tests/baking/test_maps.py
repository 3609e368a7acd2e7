"""Baked maps compared with closed forms."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import cv2
import numpy as np
import pytest
import raycam
import trimesh
from raycam.baking.texels import find_texels
from raycam.cli import main
from support.raises import warns

SQUARE = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], float)
QUAD = [[0, 1, 2], [0, 2, 3]]


def plane(half: float = 1.0, center: tuple[float, float] = (0, 0)) -> raycam.World:
    """A square at z = 0 that faces up; u is x and v is -y."""
    world = raycam.World()
    x, y = center
    corners = [
        [x - half, y + half, 0],
        [x - half, y - half, 0],
        [x + half, y - half, 0],
        [x + half, y + half, 0],
    ]
    world.add_mesh(corners, QUAD, uvs=[[0, 0], [0, 1], [1, 1], [1, 0]], name="floor")
    return world


def test_covered_texels_of_random_triangles_equal_exact_point_tests() -> None:
    random = np.random.default_rng(3)
    uvs = random.random((6, 3, 2)).astype(np.float32)
    uvs[4:] = np.round(uvs[4:] * 8) / 8 + 1 / 32  # corners and edges through texel centres
    texels = find_texels(uvs, (16, 16))
    owner = np.full(256, -1)
    owner[texels.index] = texels.face
    for place in range(256):
        x, y = place % 16 + Fraction(1, 2), place // 16 + Fraction(1, 2)
        expected = -1
        for face in range(5, -1, -1):
            p = [(Fraction(float(u)) * 16, Fraction(float(v)) * 16) for u, v in uvs[face]]
            signs = [
                (p[(i + 1) % 3][0] - p[i][0]) * (y - p[i][1]) - (p[(i + 1) % 3][1] - p[i][1]) * (x - p[i][0])
                for i in range(3)
            ]
            if all(s >= 0 for s in signs) or all(s <= 0 for s in signs):
                expected = face
        assert owner[place] == expected


def test_position_and_normal_of_a_plane_are_exact() -> None:
    maps = raycam.bake(plane(), ["position", "normal", "triangle", "instance"], size=16)
    grid = (np.arange(16) + 0.5) / 8 - 1
    np.testing.assert_allclose(maps["position"][..., 0], np.broadcast_to(grid, (16, 16)), atol=1e-6)
    np.testing.assert_allclose(maps["position"][..., 1], np.broadcast_to(-grid[:, None], (16, 16)), atol=1e-6)
    assert (maps["normal"] == [0, 0, 1]).all()
    assert maps.covered.all()
    assert maps.overlapping == 0
    assert set(np.unique(maps["triangle"])) == {0, 1}


def test_ao_at_the_foot_of_an_endless_wall_is_one_half() -> None:
    world = plane(1e-3, (2e-3, 0))
    world.add_mesh([[0, -1e5, 0], [0, 1e5, 0], [0, 1e5, 1e5], [0, -1e5, 1e5]], QUAD, name="wall")
    ao = raycam.bake(world, ["ao"], size=8, samples=1024)["ao"]
    assert ao.mean() == pytest.approx(0.5, abs=0.002)
    assert ao == pytest.approx(0.5, abs=0.01)


def test_ao_inside_a_sphere_is_zero_and_ao_under_a_disk_equals_the_closed_form() -> None:
    world = plane(0.01)
    world.add_object(sphere={"radius": 3, "level": 3})
    assert (raycam.bake(world, ["ao"], size=4)["ao"] == 0).all()
    world = plane(1e-4)
    angles = np.linspace(0, 2 * np.pi, 257)[:-1]
    rim = np.stack([np.cos(angles), np.sin(angles), np.full(256, 0.7)], axis=1)
    faces = [[0, i, i + 1] for i in range(1, 255)]
    world.add_mesh(rim, faces)
    ao = raycam.bake(world, ["ao"], size=4, samples=4096)["ao"]
    assert ao.mean() == pytest.approx(1 - 1 / (1 + 0.7**2), abs=0.003)
    # No surface is within half a metre.
    assert (raycam.bake(world, ["ao"], size=4, distance=0.5)["ao"] == 1).all()


def test_bent_normal_leans_away_from_a_wall() -> None:
    world = plane(1e-3, (2e-3, 0))
    world.add_mesh([[0, -1e5, 0], [0, 1e5, 0], [0, 1e5, 1e5], [0, -1e5, 1e5]], QUAD)
    bent = raycam.bake(world, ["bent_normal"], size=4, samples=4096)["bent_normal"]
    # The means over a quarter sphere with density cosine / pi: x is 4 / (3 pi), z is 2 / 3.
    expected = np.array([4 / (3 * np.pi), 0, 2 / 3]) / np.hypot(4 / (3 * np.pi), 2 / 3)
    np.testing.assert_allclose(bent.reshape(-1, 3).mean(axis=0), expected, atol=0.01)


def test_thickness_of_a_slab_and_a_sphere_equals_closed_forms() -> None:
    ball = trimesh.creation.icosphere(subdivisions=4)
    world = raycam.World()
    world.add_mesh(ball.vertices, ball.faces, uvs=np.random.default_rng(0).random((len(ball.vertices), 2)))
    with warns(raycam.Notice, code="overlapping_islands"):
        thickness = raycam.bake(world, ["thickness"], size=16, samples=256)
    # Chords of a unit sphere have the length 2 cos, weighted by cosine: 2 * 2 / 3.
    assert thickness["thickness"][thickness.covered].mean() == pytest.approx(4 / 3, rel=0.01)


def test_gutters_repeat_the_texels_of_their_islands() -> None:
    world = raycam.World()
    uvs = SQUARE * 0.25 + 0.375
    world.add_mesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], QUAD, uvs=uvs)
    maps = raycam.bake(world, ["normal"], size=64)
    assert maps.covered.sum() == 16 * 16
    gutter = np.zeros((64, 64), bool)
    gutter[16:48, 16:48] = True
    assert (maps["normal"][gutter][:, 2] == 1).all()
    assert (maps["normal"][~gutter] == 0).all()


def test_baked_maps_do_not_depend_on_the_number_of_threads() -> None:
    world = raycam.data.spot()
    one, two = (raycam.bake(world, ["ao"], object="spot", size=64, samples=4, threads=n) for n in (1, 2))
    np.testing.assert_array_equal(one["ao"], two["ao"])
    assert one["ao"][one.covered].std() > 0.05


@pytest.mark.parametrize(
    ("options", "error"),
    [
        ({"maps": ["a0"]}, raycam.SettingsError),
        ({"size": 0}, raycam.SettingsError),
        ({"samples": 0}, raycam.SettingsError),
        ({"distance": -1.0}, raycam.SettingsError),
        ({"object": "roof"}, raycam.WorldError),
        ({"uv_set": 1}, raycam.WorldError),
    ],
)
def test_invalid_arguments_are_refused(options: dict, error: type[Exception]) -> None:
    with pytest.raises(error):
        raycam.bake(plane(), **options)


def test_command_bake_writes_the_maps(tmp_path: Path) -> None:
    plane().to_gltf(tmp_path / "floor.glb")
    options = ["--maps", "ao", "position", "--size", "16", "--samples", "4", "-o", str(tmp_path / "maps")]
    assert main(["bake", str(tmp_path / "floor.glb"), *options]) == 0
    assert (cv2.imread(str(tmp_path / "maps/ao.png"), cv2.IMREAD_UNCHANGED) == 65535).all()
    assert (tmp_path / "maps/position.exr").exists()


def slab(thickness: float) -> raycam.World:
    """A slab far wider than thick, whose upper side has texture coordinates around its middle."""
    world = plane(0.05)
    half = 1e3
    bottom = [[-half, -half, -thickness], [-half, half, -thickness], [half, half, -thickness]]
    world.add_mesh([*bottom, [half, -half, -thickness]], QUAD, name="bottom")
    return world


@pytest.mark.parametrize("cone", [30.0, 120.0])
def test_thickness_within_a_cone_equals_closed_forms(cone: float) -> None:
    cosine = np.cos(np.radians(cone / 2))
    # The mean of t / cos with the weight cos: t (1 - c) / ((1 - c^2) / 2).
    thin = raycam.bake(slab(0.3), ["thickness"], size=4, samples=1024, cone=cone)["thickness"]
    assert thin.mean() == pytest.approx(0.3 * 2 / (1 + cosine), rel=2e-3)
    ball = trimesh.creation.icosphere(subdivisions=4)
    world = raycam.World()
    world.add_mesh(ball.vertices, ball.faces, uvs=np.random.default_rng(0).random((len(ball.vertices), 2)))
    with warns(raycam.Notice, code="overlapping_islands"):
        thick = raycam.bake(world, ["thickness"], size=16, samples=256, cone=cone)
    # Chords have the length 2 cos and the weight cos.
    expected = (2 / 3) * (1 - cosine**3) / ((1 - cosine**2) / 2)
    assert thick["thickness"][thick.covered].mean() == pytest.approx(expected, rel=0.01)


def test_id_maps_are_png_files_that_store_id_plus_one(tmp_path: Path) -> None:
    world = raycam.World()
    world.add_object(box={"size": [1, 1, 1]}, color="red")
    uvs = SQUARE * 0.5 + 0.25
    world.add_mesh([[2, 0, 0], [3, 0, 0], [3, 1, 0], [2, 1, 0]], QUAD, uvs=uvs, name="floor", color="blue")
    maps = raycam.bake(world, ["instance", "material", "triangle"], object="floor", size=32)
    seen = world.cast_rays([[2.5, 0.4, 1]], [[0, 0, -1]], fields=("instance", "material", "triangle"))
    for name in maps:
        inside = maps[name][maps.covered]
        assert set(np.unique(inside)) == ({0, 1} if name == "triangle" else {int(seen[name][0])})
        assert (maps[name][~maps.covered] == -1).all()
    assert [path.name for path in maps.save(tmp_path)] == ["instance.png", "material.png", "triangle.png"]
    for name in maps:
        read = cv2.imread(str(tmp_path / f"{name}.png"), cv2.IMREAD_UNCHANGED)
        np.testing.assert_array_equal(read, maps[name] + 1)


@pytest.mark.parametrize("options", [{"cone": 0}, {"cone": 181}, {"green": "left"}, {"to": "faces"}])
def test_invalid_directions_and_targets_are_refused(options: dict) -> None:
    with pytest.raises(raycam.SettingsError):
        raycam.bake(plane(), **options)


def test_command_writes_one_map_to_a_file_and_refuses_two_maps(tmp_path: Path) -> None:
    plane().to_gltf(tmp_path / "floor.glb")
    common = ["bake", str(tmp_path / "floor.glb"), "--size", "8", "--samples", "4"]
    assert main([*common, "-o", str(tmp_path / "ao.png")]) == 0
    assert (cv2.imread(str(tmp_path / "ao.png"), cv2.IMREAD_UNCHANGED) == 65535).all()
    assert main([*common, "--maps", "ao", "normal", "-o", str(tmp_path / "two.png")]) != 0
    assert main([*common, "-o", str(tmp_path / "ao.exr")]) != 0
    assert not (tmp_path / "two.png").exists()
