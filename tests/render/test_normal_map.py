"""Normal maps: the energy of mirrors at grazing angles."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import raycam


def normal_map(kind: str) -> npt.NDArray[np.uint8]:
    """Normals of waves or dents whose slopes reach 0.5, in tangent space."""
    x, y = np.meshgrid(*2 * [np.arange(256) / 256 * 2 * np.pi * 4])
    if kind == "waves":
        slope = np.stack([0.5 * np.cos(x), np.zeros_like(x)], axis=-1)
    else:
        slope = np.stack([0.5 * np.cos(x) * np.sin(y), 0.5 * np.sin(x) * np.cos(y)], axis=-1)
    normal = np.concatenate([-slope, np.ones((*x.shape, 1))], axis=-1)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    return np.round((normal + 1) / 2 * 255).astype(np.uint8)


MIRROR = {"type": "principled", "metallic": 1, "roughness": 0}
COATED_MIRROR = {**MIRROR, "clearcoat": 1}
BRUSHED = {"type": "principled", "metallic": 1, "roughness": 0.2}
GLASS = {"type": "glass", "ior": 1.5}
CYCLES_BRUSHED = {
    ("waves", 3): 0.9811,
    ("waves", 10): 0.9117,
    ("waves", 30): 0.8488,
    ("dents", 3): 0.9806,
    ("dents", 10): 0.9146,
    ("dents", 30): 0.9128,
}
"""Mean radiance of the plane in Cycles (Blender 4.5, 64 samples), by kind of map and elevation in degrees."""


def mean_under_white_sky(
    kind: str, elevation: float, shape: dict[str, Any], material: dict[str, Any]
) -> float:
    """Mean radiance of a horizontal surface under a sky of radiance 1."""
    world = raycam.World()
    maps = {"normal": raycam.Texture(normal_map(kind), repeat=10)}
    world.add_object(**shape, color=[1, 1, 1], textures=maps, **material)
    world.add_light("sky", radiance=1)
    height, across = np.sin(np.radians(elevation)), np.cos(np.radians(elevation))
    camera = raycam.Camera.look_at([-8 * across, 0, 8 * height], [0, 0, 0], size=(16, 16), fov=4)
    frame = raycam.render(world, camera, integrator="path", samples=256, channels="color")
    return float(frame["color"].mean())


@pytest.mark.parametrize("elevation", [3, 10, 30])
@pytest.mark.parametrize("kind", ["waves", "dents"])
def test_mirrors_with_normal_maps_keep_all_light(kind: str, elevation: float) -> None:
    """A white mirror under a white sky is white.

    Mirror directions must not point into the surface.
    """
    assert mean_under_white_sky(kind, elevation, {"plane": {"size": 40}}, MIRROR) == pytest.approx(
        1, abs=1e-3
    )


@pytest.mark.parametrize("elevation", [4, 15])
@pytest.mark.parametrize("kind", ["waves", "dents"])
def test_coated_mirrors_with_normal_maps_equal_cycles(kind: str, elevation: float) -> None:
    """Cycles (Blender 5.0, 256 samples) renders 0.9926 and 0.9989 at 4 and 15 degrees, with both maps.

    The coat keeps the surface's own normal, and dims the mirror by its albedo for the viewing direction only.
    """
    found = mean_under_white_sky(kind, elevation, {"plane": {"size": 40}}, COATED_MIRROR)
    assert found == pytest.approx({4: 0.9926, 15: 0.9989}[elevation], rel=0.01)


@pytest.mark.parametrize(
    ("kind", "elevation", "expected"), [(*key, value) for key, value in CYCLES_BRUSHED.items()]
)
def test_brushed_metal_with_normal_maps_equals_cycles(kind: str, elevation: float, expected: float) -> None:
    found = mean_under_white_sky(kind, elevation, {"plane": {"size": 40}}, BRUSHED)
    assert found == pytest.approx(expected, rel=0.02)


@pytest.mark.parametrize("elevation", [3, 10, 30])
@pytest.mark.parametrize("kind", ["waves", "dents"])
def test_glass_slabs_with_normal_maps_keep_their_energy(kind: str, elevation: float) -> None:
    """A clear body under a white sky is invisible; refraction on its far side may lose a little."""
    slab = {"box": {"size": [40, 40, 1]}, "location": [0, 0, -0.5]}
    found = mean_under_white_sky(kind, elevation, slab, GLASS)
    assert found == pytest.approx(1, abs=0.04)


COATED = {"type": "principled", "metallic": 1, "roughness": 0.5, "clearcoat": 1, "clearcoat_roughness": 0.05}
CYCLES_COATED = {
    ("waves", 4): 1.0006,
    ("waves", 15): 0.9847,
    ("waves", 40): 0.9566,
    ("dents", 4): 0.9992,
    ("dents", 15): 0.9824,
    ("dents", 40): 0.9558,
}
"""Mean radiance of a smooth coat on rough metal with a normal map (Cycles in Blender 5.0)."""


@pytest.mark.parametrize(("kind", "elevation"), CYCLES_COATED)
def test_clearcoats_reflect_where_the_mapped_normal_faces_away(kind: str, elevation: float) -> None:
    found = mean_under_white_sky(kind, elevation, {"plane": {"size": 40}}, COATED)
    assert found == pytest.approx(CYCLES_COATED[kind, elevation], rel=0.01)
