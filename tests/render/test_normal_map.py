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


MATERIALS: dict[str, dict[str, Any]] = {
    "metal": {"type": "principled", "metallic": 1, "roughness": 0},
    "brushed": {"type": "principled", "metallic": 1, "roughness": 0.2},
    "glass": {"type": "glass", "ior": 1.5},
    "frosted": {"type": "glass", "ior": 1.5, "roughness": 0.2},
}


@pytest.mark.parametrize("elevation", [3, 10, 30])
@pytest.mark.parametrize("kind", ["waves", "dents"])
@pytest.mark.parametrize("material", MATERIALS)
def test_mirrors_with_normal_maps_keep_their_energy_at_grazing_angles(
    material: str, kind: str, elevation: float
) -> None:
    """White metal and clear glass under a white sky are white: directions into the surface must not be lost."""
    world = raycam.World()
    world.add_object(
        plane={"size": 40},
        color=[1, 1, 1],
        textures={"normal": raycam.Texture(normal_map(kind), repeat=10)},
        **MATERIALS[material],
    )
    world.add_light("sky", radiance=1)
    height, across = np.sin(np.radians(elevation)), np.cos(np.radians(elevation))
    camera = raycam.Camera.look_at([-8 * across, 0, 8 * height], [0, 0, 0], size=(16, 16), fov=4)
    frame = raycam.render(world, camera, integrator="path", samples=256, channels="color")
    assert frame["color"].mean() > 0.95
