"""Baked light against closed forms, and against rendered images."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import OpenEXR
import pytest
import raycam
from raycam.cli import main
from raycam.notices import collected
from support.raises import notice_codes, raises
from support.textured_panel import panel

GLOSSY = {"type": "metal", "metal": "gold", "roughness": 0.3}


def floor(half: float = 1.0, **material: object) -> raycam.World:
    """A square at z = 0 that faces up; u is x and v is -y."""
    world = raycam.World()
    square = [[-half, half, 0], [-half, -half, 0], [half, -half, 0], [half, half, 0]]
    uvs = [[0, 0], [0, 1], [1, 1], [1, 0]]
    world.add_mesh(square, [[0, 1, 2], [0, 2, 3]], uvs=uvs, name="floor", material=material)
    return world


def places(size: int, half: float = 1.0) -> np.ndarray:
    grid = (np.arange(size) + 0.5) * 2 * half / size - half
    return np.stack([*np.meshgrid(grid, -grid), np.zeros((size, size))], axis=2)


@pytest.mark.parametrize(
    "material", [{"color": [0.2, 0.5, 0.8]}, GLOSSY, {"type": "unlit"}, {"opacity": 0.3}]
)
def test_irradiance_of_a_bulb_equals_the_closed_form_for_any_material(material: dict) -> None:
    world = floor(**material)
    bulb = np.array([0.3, -0.2, 0.8])
    world.add_light(type="point", position=bulb.tolist(), intensity=[3.0, 2.0, 1.0])
    maps = raycam.bake(world, ["irradiance", "direct"], size=16, samples=4)
    way = bulb - places(16)
    squared = (way**2).sum(axis=2)
    expected = (way[..., 2] / np.sqrt(squared) / squared)[..., None] * [3.0, 2.0, 1.0]
    np.testing.assert_allclose(maps["irradiance"], expected, rtol=1e-4)
    np.testing.assert_allclose(maps["direct"], expected, rtol=1e-4)
    assert maps["irradiance_error"].max() < 1e-3


@pytest.mark.parametrize("material", [{}, GLOSSY])
def test_irradiance_under_a_white_sky_is_pi(material: dict) -> None:
    world = floor(**material)
    world.add_light(type="sky", radiance=[1.0, 0.5, 0.25])
    maps = raycam.bake(world, ["irradiance"], size=4, samples=256)
    np.testing.assert_allclose(
        maps["irradiance"].mean(axis=(0, 1)), np.pi * np.array([1, 0.5, 0.25]), rtol=1e-3
    )


def test_irradiance_in_a_glowing_ball_includes_all_bounces_and_direct_excludes_them() -> None:
    world = floor(0.01, color="white")
    ball = {"color": [0.6, 0.6, 0.6], "emission": [1.0, 1.0, 1.0]}
    world.add_object(sphere={"radius": 2, "level": 3}, **ball)
    maps = raycam.bake(world, ["irradiance", "direct"], size=4, samples=2048)
    # Radiance is emission / (1 - albedo) everywhere; the floor is too small to matter.
    assert maps["irradiance"].mean() == pytest.approx(np.pi / 0.4, rel=0.01)
    assert maps["direct"].mean() == pytest.approx(np.pi, rel=0.005)
    limited = raycam.bake(world, ["irradiance"], size=4, samples=512, max_depth=3)
    assert limited["irradiance"].mean() == pytest.approx(np.pi * 1.6, rel=0.01)


def test_radiance_of_a_matte_floor_is_irradiance_times_albedo_divided_by_pi() -> None:
    world = floor(color=[0.8, 0.4, 0.2])
    world.add_light(type="point", position=[0.3, -0.2, 0.8], intensity=[3.0, 3.0, 3.0])
    maps = raycam.bake(world, ["radiance", "irradiance"], size=8, samples=4)
    expected = maps["irradiance"] * np.array([0.8, 0.4, 0.2]) / np.pi
    np.testing.assert_allclose(maps["radiance"], expected, rtol=1e-4)


def test_radiance_equals_an_image_seen_along_the_normals() -> None:
    world = floor(**GLOSSY)
    world.add_light(type="sky", radiance=[0.3, 0.4, 0.5])
    world.add_object(box={"size": [0.2, 0.2, 0.2]}, location=[0.5, 0, 0.3], color="red")
    found = raycam.bake(world, ["radiance"], size=64, samples=64)["radiance"][28:36, 28:36]
    # From far above, all rays are along the normal.
    angle = 2 * np.degrees(np.arctan(0.125 / 1e4))
    camera = raycam.Camera.look_at([0, 0, 1e4], [0, 0, 0], up=[0, 1, 0], size=(8, 8), fov=angle)
    frame = raycam.render(world, camera, samples=64, integrator="path")["color"]
    np.testing.assert_allclose(found.mean(axis=(0, 1)), frame.mean(axis=(0, 1)), rtol=0.02)


def test_standard_error_is_the_scatter_of_independent_bakes() -> None:
    world = floor()
    world.add_light(type="sky", radiance=[1.0, 1.0, 1.0])
    world.add_object(box={"size": [1, 1, 1]}, location=[0, 0, 0.8], color="black")
    few = raycam.bake(world, ["irradiance"], size=32, samples=16)
    many = raycam.bake(world, ["irradiance"], size=32, samples=1024)
    off = np.abs(few["irradiance"] - many["irradiance"]).mean(axis=2)
    # Samples of a texel are better distributed than independent ones, so the estimate is an upper bound on average.
    assert 0.2 < np.sqrt((off**2).mean()) / np.sqrt((few["irradiance_error"] ** 2).mean()) < 1.2
    assert few["irradiance_error"].mean() > 4 * many["irradiance_error"].mean()


def test_baked_light_does_not_depend_on_threads_or_earlier_images() -> None:
    def world() -> raycam.World:
        made = floor()
        made.add_light(type="sky", radiance=[1.0, 1.0, 1.0])
        made.add_object(sphere={"radius": 0.3}, location=[0, 0, 0.4], type="glass")
        return made

    one = raycam.bake(world(), ["irradiance"], size=16, samples=8, threads=1)
    used = world()
    raycam.render(used, used.view_from("top", size=(16, 16)), samples=4, integrator="path")
    two = raycam.bake(used, ["irradiance"], size=16, samples=8, threads=2)
    np.testing.assert_array_equal(one["irradiance"], two["irradiance"])


def test_light_of_a_source_comes_from_the_lights_of_its_own_world() -> None:
    low, high = panel(), floor(1.2)
    high.add_light(type="point", position=[0, 0, 1], intensity=[1.0, 1.0, 1.0])
    low.add_light(type="point", position=[0, 0, 1], intensity=[9.0, 9.0, 9.0])
    maps = raycam.bake(low, ["irradiance"], size=8, source=high, samples=4, cage=0.01)
    expected = 1 / (1 + (places(8)[..., :2] ** 2).sum(axis=2)) ** 1.5
    np.testing.assert_allclose(maps["irradiance"][..., 0], expected, rtol=1e-3)


def test_world_without_lights_is_reported() -> None:
    with collected() as notices:
        raycam.bake(floor(), ["irradiance"], size=4, samples=1)
    assert notice_codes(notices) == ["default_lights"]


def test_denoising_without_the_library_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    world = floor()
    world.add_light(type="sky", radiance=[1.0, 1.0, 1.0])
    monkeypatch.setitem(__import__("sys").modules, "pyoidn", None)
    with raises(raycam.SettingsError, code="missing_dependency"):
        raycam.bake(world, ["irradiance"], size=4, samples=1, denoise=True)


def test_command_writes_a_lightmap_with_its_error(tmp_path: Path) -> None:
    world = raycam.World("y")
    square = [[-1, 0, -1], [-1, 0, 1], [1, 0, 1], [1, 0, -1]]
    world.add_mesh(square, [[0, 1, 2], [0, 2, 3]], uvs=[[0, 0], [0, 1], [1, 1], [1, 0]])
    world.add_light(type="point", position=[0, 1, 0], intensity=[2.0, 2.0, 2.0])
    world.to_gltf(tmp_path / "floor.glb")
    out = tmp_path / "lightmap.exr"
    options = ["--maps", "irradiance", "--size", "9", "--samples", "4", "-o", str(out)]
    assert main(["bake", str(tmp_path / "floor.glb"), *options]) == 0
    channels = OpenEXR.File(str(out), separate_channels=True).channels()
    assert {"R", "G", "B"} < set(channels)
    assert [name for name in channels if name.startswith("error")]
    red = channels["R"].pixels
    assert red[4, 4] == pytest.approx(2.0, rel=1e-4)
