"""Renders a night with many lights.

420 paper lanterns rise over a lake, whose ripples reflect them.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import raycam
from common import Picture, Quality, fractal, planks, ribbon, stand


def lantern() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Returns the vertices, faces and texture coordinates of a paper lantern.

    The lantern is 1 m high and open at the bottom.
    """
    rings, sides = np.array([[0.30, 0.0], [0.40, 0.45], [0.40, 0.8], [0.30, 0.96], [0.0, 1.0]]), 24
    angle = np.linspace(0, 2 * np.pi, sides + 1)
    corners = [[r * np.cos(a), r * np.sin(a), z] for r, z in rings for a in angle]
    uvs = [[a / (2 * np.pi), 1 - z] for r, z in rings for a in angle]
    first = (np.arange(len(rings) - 1)[:, None] * (sides + 1) + np.arange(sides)).ravel()
    over = first + sides + 1
    faces = np.concatenate([np.stack([first, first + 1, over + 1], 1), np.stack([first, over + 1, over], 1)])
    return np.array(corners), faces, np.array(uvs)


def picture(assets: Path, quality: Quality) -> Picture:
    """Renders the image; returns sRGB bytes [h, w, 3]."""
    world = raycam.World()
    ripples = raycam.Texture((0.5 * fractal((1024, 1024), 1.9, 0.35, seed=3)).astype(np.float32), repeat=10)
    world.add_object(plane=240, color="#04080d", type="principled", roughness=0.06, ior=1.33, name="lake",
                     textures={"height": ripples}, height_scale=0.16)  # fmt: skip
    corners, faces, uvs = lantern()
    glow = np.linspace(0.25, 1, 32)[:, None, None] ** 1.6 * np.array([0.9, 0.3, 0.055]) + [0.04, 0.008, 0]
    glow = np.repeat(glow, 2, axis=1).clip(0, 1).astype(np.float32)
    world.add_mesh(corners, faces, uvs=uvs, name="lantern", visible=False, material={"color": "#201008", "emission": 1,
                   "textures": {"emission": glow}})  # fmt: skip
    random = np.random.default_rng(12)
    for number in range(420):
        away = 5 + 75 * random.uniform() ** 1.3
        across = (0.25 * away + 1.5) * random.normal()
        up = 0.06 + (number % 6 > 0) * (0.8 + (0.34 * away + 2) * random.uniform() ** 1.2)
        world.add_object(instance_of="lantern", visible=True, location=[across, away, up], yaw=random.uniform(0, 360),
                         roll=random.normal(0, 5) if up > 1 else 0, scale=random.uniform(0.4, 0.62))  # fmt: skip
    hills = 9 * fractal((1, 256), 1.7, seed=8)[0] + 3
    x = np.linspace(-130, 130, 256)
    rim = np.concatenate([np.stack([x, 0 * x + 118, 0 * x], 1), np.stack([x, 0 * x + 118, hills], 1)])
    world.add_mesh(rim, ribbon(255), material={"color": "#0a1018"})
    for board in range(14):
        world.add_object(box=[2.4, 0.27, 0.05], location=[-1.5, 0.3 + 0.29 * board, 0.42],
                         texture=planks(256, 1, board), type="principled", roughness=0.4)  # fmt: skip
    for x in (-2.6, -0.4):
        for y in (1.4, 4.2):
            world.add_object(cylinder={"radius": 0.08, "height": 1.5}, location=[x, y, 0.1], color="#2a1c12")
    stand(world, assets / "gltf/Fox/Fox.glb", 0.8, (-1.35, 3.2, 0.45), yaw=35, name="fox")
    for place in ((-2.2, 3.9, 0.45), (-0.75, 4.05, 0.45), (-2.25, 2.6, 0.45)):
        world.add_object(instance_of="lantern", visible=True, location=place, scale=0.4)
    world.add_light("sky", zenith=[0.0015, 0.004, 0.012], horizon=[0.018, 0.022, 0.045])
    camera = raycam.Camera.look_at([0.2, -1.2, 1.55], [0.35, 10, 2.6], size=(960, 540), fov=46)
    return quality.shot(world, camera, samples=16, exposure=1.3)
