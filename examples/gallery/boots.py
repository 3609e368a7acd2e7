"""Renders three boots on seamless paper, as a product shot: suede, chrome, patent leather."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import raycam
from common import Picture, Quality, softbox, stand


def backdrop(world: raycam.World, color: str) -> None:
    """Adds a sheet of paper that bends from the floor up into a wall."""
    angle = np.linspace(0, np.pi / 2, 24)
    y = np.concatenate([[-6], 1.6 + 1.2 * np.sin(angle), [2.8]])
    z = np.concatenate([[0], 1.2 - 1.2 * np.cos(angle), [6]])
    corners = np.array([[x, b, c] for b, c in zip(y, z, strict=True) for x in (-8, 8)])
    first = np.arange(0, len(corners) - 2, 2)
    faces = np.concatenate(
        [np.stack([first, first + 1, first + 3], 1), np.stack([first, first + 3, first + 2], 1)]
    )
    world.add_mesh(corners, faces, name="paper", material={"color": color, "type": "matte"})


def picture(assets: Path, quality: Quality) -> Picture:
    """Renders the image; returns sRGB bytes [h, w, 3]."""
    world = raycam.World()
    backdrop(world, "#c8553d")
    looks = (
        {"color": "#d9a066", "sheen_color": [0.5, 0.4, 0.3], "sheen_roughness": 0.5, "roughness": 0.9},
        {"color": [0.9, 0.9, 0.92], "metallic": 1, "roughness": 0.06},
        {"color": "#0c0c10", "roughness": 0.5, "clearcoat": 1, "clearcoat_roughness": 0.03},
    )
    for number, look in enumerate(looks):
        stand(world, assets / "meshes/boot.obj", 0.62, (-0.85 + 0.85 * number, 0.35 * number, 0), roll=90, yaw=-122,
              type="principled", **look)  # fmt: skip
    softbox(world, (-2.2, -1.8, 2.8), (0, 0, 0.2), (1.8, 1.2), [13, 12.6, 12])
    softbox(world, (3.0, 0.2, 1.6), (0, 0.3, 0.3), (0.5, 1.8), [13, 14, 16])
    world.add_light("sky", radiance=[0.42, 0.4, 0.4])
    camera = raycam.Camera.look_at([-0.3, -4.6, 1.25], [-0.12, 0.3, 0.26], size=(960, 540), fov=16.5)
    return quality.shot(world, camera, samples=20)
