"""Renders a toy car on its cloth, lit by two soft boxes.

The glTF file contains clear coat, glass and sheen.
"""

from __future__ import annotations

from pathlib import Path

import raycam
from common import Picture, Quality, softbox


def picture(assets: Path, quality: Quality) -> Picture:
    """Renders the image; returns sRGB bytes [h, w, 3]."""
    world = raycam.World()
    world.add_object(mesh=assets / "gltf/ToyCar/ToyCar.gltf", scale=20, name="car")
    world.add_object(plane=40, location=[0, 0, -0.32], color="#2a2320", type="principled", roughness=0.35)
    softbox(world, (-1.0, -0.6, 2.2), (0, 0, 0), (2.0, 0.9), [26, 24.5, 22])
    softbox(world, (2.2, 1.6, 1.0), (0, 0, 0.1), (0.5, 1.6), [22, 30, 42])
    world.add_light("sky", zenith=[0.3, 0.28, 0.3], horizon=[0.10, 0.08, 0.075])
    camera = raycam.Camera.look_at([1.35, -1.8, 0.5], [0.03, 0, -0.02], size=(960, 540), fov=24)
    return quality.shot(world, camera.with_aperture(0.02, focus=2.05), samples=20)
