"""Renders two foxes on a hill at dawn: fog in closed form over a landscape made of noise."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import raycam
from common import Picture, Quality, fractal


def picture(assets: Path, quality: Quality) -> Picture:
    """Renders the image; returns sRGB bytes [h, w, 3]."""
    world = raycam.World()
    steps, side = 256, 400.0
    height = 34 * fractal((steps, steps), 2.2, seed=9)
    x, y = np.meshgrid(np.linspace(-side / 2, side / 2, steps), np.linspace(-20, side - 20, steps))
    hill = 17 * np.exp(-((x + 3) ** 2 + (y - 4) ** 2) / 250)
    height = np.maximum(height * np.clip((y - 8) / 90, 0, 1), 0) + hill
    corners = np.stack([x, y, height], axis=2).reshape(-1, 3)
    first = (np.arange(steps - 1)[:, None] * steps + np.arange(steps - 1)).ravel()
    faces = np.concatenate([
        np.stack([first, first + 1, first + steps + 1], 1), np.stack([first, first + steps + 1, first + steps], 1)
    ])  # fmt: skip
    world.add_mesh(corners, faces, name="land", material={"color": "#5a6339"})
    for place, yaw, scale in (((-3.2, 3.2), 35, 0.016), ((-1.6, 4.6), -60, 0.012)):
        ground = world.cast_rays([[*place, 100]], [[0, 0, -1]])["t"][0]
        world.add_object(
            mesh=assets / "gltf/Fox/Fox.glb", scale=scale, location=[*place, 100 - float(ground)], yaw=yaw
        )
    world.add_object(cone={"radius": 1.3, "height": 5}, name="tree", color="#26351f", visible=False)
    random = np.random.default_rng(3)
    for across, away in zip(random.uniform(-90, 90, 420), random.uniform(30, 200, 420), strict=True):
        ground = 100 - float(world.cast_rays([[across, away, 100]], [[0, 0, -1]])["t"][0])
        tall = random.uniform(0.8, 1.7)
        world.add_object(
            instance_of="tree", scale=tall, location=[across, away, ground + 2.3 * tall], visible=True
        )
    world.add_light("sun", direction=[0.35, -1, -0.2], irradiance=[9, 5.2, 2.4], angular_diameter=2)
    world.add_light("sky", zenith=[0.25, 0.42, 0.8], horizon=[1.5, 0.95, 0.62])
    world.set_fog(extinction=0.012, albedo=0.96, g=0.7, height=16)
    camera = raycam.Camera.look_at([0.5, -8, 18.2], [0.3, 30, 16.5], size=(960, 540), fov=34)
    return quality.shot(world, camera, samples=20)
