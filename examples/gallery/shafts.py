"""Renders light shafts: the sun shines through small windows into a dusty hall with a fox."""

from __future__ import annotations

from pathlib import Path

import raycam
from common import Picture, Quality, fractal, mix, stand


def picture(assets: Path, quality: Quality) -> Picture:
    """Renders the image; returns sRGB bytes [h, w, 3]."""
    world = raycam.World()
    stone = mix("#1d1916", "#5a5044", fractal((512, 512), 1.2, seed=6))
    plain = {"texture": stone, "type": "principled", "roughness": 0.8}
    world.add_object(
        box=[8, 20, 0.4], location=[0, 4, -0.2], texture=stone, type="principled", roughness=0.35
    )
    world.add_object(box=[8, 20, 0.4], location=[0, 4, 6.2], **plain)
    world.add_object(box=[0.4, 20, 6], location=[-4, 4, 3], **plain)
    world.add_object(box=[8, 0.4, 6], location=[0, -6, 3], **plain)
    world.add_object(box=[8, 0.4, 6], location=[0, 14, 3], **plain)
    world.add_object(box=[0.4, 20, 4], location=[4, 4, 2], **plain)
    world.add_object(box=[0.4, 20, 1.1], location=[4, 4, 5.45], **plain)
    world.add_object(box=[0.4, 6.4, 0.9], location=[4, -2.8, 4.45], **plain)
    for row in range(6):
        world.add_object(box=[0.4, 1.6, 0.9], location=[4, 2 + 2.4 * row, 4.45], **plain)
        world.add_object(cylinder={"radius": 0.26, "height": 6}, location=[-2.7, 0.2 + 2.4 * row, 3], **plain)
    stand(world, assets / "gltf/Fox/Fox.glb", 1.0, (-0.3, 3.85, 0), yaw=75, name="fox")
    world.add_light("sun", direction=[-0.8, 0.12, -0.85], irradiance=[270, 184, 92], angular_diameter=0.6)
    world.add_light("sky", radiance=[0.4, 0.55, 0.8])
    world.set_fog(extinction=0.03, albedo=0.9, g=0.1, height=5.9)
    camera = raycam.Camera.look_at([-1.2, -1.9, 1.0], [0.35, 5, 1.85], size=(960, 540), fov=48)
    return quality.shot(world, camera, samples=20)
