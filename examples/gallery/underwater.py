"""Renders an underwater scene: a school of fish, a sword, and shafts of sunlight.

The sunlight is a projector with an image of waves.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import raycam
from common import Picture, Quality, fractal, mix, stand


def waves(size: int = 768) -> np.ndarray:
    """Returns an image of sunlight that has passed through a rippled water surface.

    Between its bright lines are dark gaps, so that the light forms shafts.
    """
    lines = sum(np.abs(fractal((size, size), 2.6, seed=seed) - 0.5) for seed in (1, 2))
    gaps = np.clip(fractal((size, size), 1.5, seed=5) * 5 - 4, 0, 1)
    light = 0.004 + 0.35 * np.exp(-lines * 16) + 8 * gaps
    return np.repeat(light[..., None], 3, axis=2).astype(np.float32)


def picture(assets: Path, quality: Quality) -> Picture:
    """Renders the image; returns sRGB bytes [h, w, 3]."""
    world = raycam.World()
    sand = mix("#8f7d5c", "#d9c79c", fractal((512, 512), 1.1, seed=2))
    world.add_object(plane=60, texture=raycam.Texture(sand, repeat=12), name="sand")
    stand(world, assets / "meshes/fish.obj", 0.42, (0.3, 0.2, 1.0), roll=90, yaw=100, color="#e8742a",
          type="principled", roughness=0.35, clearcoat=0.6, name="fish")  # fmt: skip
    random = np.random.default_rng(11)
    for number in range(26):
        across, along, up = random.uniform((-3.2, 0.8, 0.55), (3.6, 8, 2.6))
        stand(world, assets / "meshes/fish.obj", random.uniform(0.22, 0.34), (across, along, up), roll=90,
              yaw=100 + random.normal(0, 9), color=("#e8742a", "#f0b429", "#3f83c9")[number % 3], type="principled",
              roughness=0.4)  # fmt: skip
    stand(
        world,
        assets / "meshes/skull.obj",
        0.5,
        (-1.15, 0.9, -0.06),
        roll=80,
        yaw=30,
        color="#cfc6a8",
        name="skull",
    )
    stand(world, assets / "meshes/sword-quad-dominant.obj", 1.3, (1.25, 0.9, -0.25), pitch=18, yaw=40, type="metal",
          metal="gold", roughness=0.35, name="sword")  # fmt: skip
    sun = raycam.Camera.look_at([2.5, 6.0, 26], [0, 3.2, 0], size=(768, 768), fov=27)
    world.add_light("projector", image=waves(), camera=sun, irradiance=[11000, 11000, 10500])
    world.add_light("sky", zenith=[0.1, 0.2, 0.26], horizon=[0.002, 0.02, 0.04])
    world.set_fog(extinction=[0.1, 0.035, 0.026], albedo=[0.08, 0.42, 0.62], g=0.5, height=4.5)
    camera = raycam.Camera.look_at([0.2, -2.9, 0.75], [0.2, 2, 1.15], size=(960, 540), fov=44)
    return quality.shot(world, camera, samples=20)
