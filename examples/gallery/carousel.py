"""Renders motion blur: foxes ride on a carousel at dusk.

The bulbs of the carousel leave trails while the shutter is open for 0.07 s.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import raycam
from common import Picture, Quality, fractal, mix, stand
from ride import carousel


def picture(assets: Path, quality: Quality) -> Picture:
    """Renders the image; returns sRGB bytes [h, w, 3]."""
    world = carousel(assets)
    gravel = mix("#2e2c2b", "#5c5650", fractal((512, 512), 0.7, seed=3))
    world.add_object(plane=120, texture=raycam.Texture(gravel, repeat=24), type="principled", roughness=0.22)
    for place, yaw, height in (((2.3, -4.6, 0), 150, 0.9), ((-3.4, -3.9, 0), 215, 0.75)):
        stand(world, assets / "gltf/Fox/Fox.glb", height, place, yaw=yaw)
    for number, (x, y) in enumerate(((-8.2, -0.5), (-7.5, 9), (7.5, 9), (8.2, -0.5))):
        world.add_object(cylinder={"radius": 0.07, "height": 5.2}, location=[x, y, 2.6], color="#2d2a2c")
        for step in np.linspace(0.06, 1, 17):
            place = [x * step, y * step, 4.9 + 0.3 * step - 4 * (step - step**2)]
            color = ([30, 13, 4], [26, 3, 2], [5, 16, 20], [24, 17, 3])[(number + round(17 * step)) % 4]
            world.add_object(
                sphere={"radius": 0.09, "level": 2}, location=place, color="#000000", emission=color
            )
    random = np.random.default_rng(5)
    for x in np.arange(-40, 41, 5.0):
        wide, tall = random.uniform(4, 6), random.uniform(3, 8)
        world.add_object(box=[wide, 4, tall], location=[x, 52, tall / 2], color="#1a1a20")
        for _ in range(3):
            place = [x + random.uniform(-0.4, 0.4) * wide, 50, random.uniform(1, tall - 0.6)]
            world.add_object(box=[0.7, 0.1, 0.9], location=place, color="#000000", emission=[2.6, 1.5, 0.6])
    world.add_light("sky", zenith=[0.006, 0.014, 0.05], horizon=[0.16, 0.1, 0.12])
    camera = raycam.Camera.look_at([0.9, -10.4, 1.5], [0.1, 0, 2.0], size=(960, 540), fov=36)
    return quality.shot(world.at(0.1), camera.exposing(0.07), samples=20, max_depth=5)
