"""Renders one head in six materials: gold, velvet, glass, thin film, copper, car paint."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import raycam
from common import Picture, Quality

MATERIALS: list[dict[str, Any]] = [
    {"type": "metal", "metal": "gold", "roughness": 0.15},
    {"type": "principled", "color": "#5a0d22", "sheen_color": [1, 0.3, 0.45], "sheen_roughness": 0.3, "roughness": 1},
    {"type": "glass", "ior": 1.5, "attenuation_color": [0.55, 0.93, 0.82], "attenuation_distance": 0.8},
    {"type": "principled", "color": [0.6, 0.6, 0.62], "metallic": 1, "roughness": 0.12, "iridescence": 1,
     "iridescence_ior": 1.8, "iridescence_thickness": 420},
    {"type": "metal", "metal": "copper", "roughness": 0.3},
    {"type": "principled", "color": "#0d3f9a", "roughness": 0.5, "clearcoat": 1, "clearcoat_roughness": 0.02},
]  # fmt: skip


def picture(assets: Path, quality: Quality) -> Picture:
    """Renders the image; returns sRGB bytes [h, w, 3]."""
    world = raycam.load(assets / "gltf/IridescenceSuzanne/IridescenceSuzanne.glb")
    while world.lights:
        world.remove_light(0)
    head = world.objects[0]
    upright = np.eye(4)
    upright[:3] = np.asarray(head.matrix)[:3]
    upright[:3, 3] = 0
    for item in world.objects:
        world.set_object(item.id, visible=False)
    for number, material in enumerate(MATERIALS):
        column, row = number % 3, number // 3
        angle = np.deg2rad((18, 0, -18)[column])
        place = np.eye(4)
        place[:3, :3] = [[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]]
        place[:3, 3] = [2.7 * (column - 1) + 1.35 * row, 0, -2.6 * row]
        world.add_object(instance_of=head.name, matrix=(place @ upright).tolist(), **material)
    world.add_object(
        box=[900, 0.2, 900], location=[0, -1.07, 0], color="#4a4642", type="principled", roughness=0.25
    )
    world.add_light("environment", image=assets / "hdri/warehouse.hdr", yaw=60, visible={"camera": False})
    world.add_light("sky", radiance=[0.2, 0.19, 0.18], visible={"light": False, "reflection": False})
    camera = raycam.Camera.look_at([-0.85, 2.9, 9.6], [0.05, -0.25, -1.2], "y", size=(960, 540), fov=27)
    return quality.shot(world, camera.with_aperture(0.05, focus=9.4), samples=20)
