"""Light shafts: the low sun shines through five tall windows into a dusty hall with a fox."""

from __future__ import annotations

from pathlib import Path

import raycam
from common import Picture, Quality, fractal, mix, stand


def picture(assets: Path, quality: Quality) -> Picture:
    """Returns the image."""
    world = raycam.World()
    stone = mix("#2b2621", "#5d564c", fractal((512, 512), 1.2, seed=6))
    plain = {"texture": stone, "type": "principled", "roughness": 0.8}
    world.add_object(
        box=[8, 16, 0.4], location=[0, 6, -0.2], texture=stone, type="principled", roughness=0.35
    )
    world.add_object(box=[8, 16, 0.4], location=[0, 6, 6.2], **plain)
    world.add_object(box=[0.4, 16, 6], location=[-4, 6, 3], **plain)
    world.add_object(box=[8, 0.4, 6], location=[0, 14, 3], **plain)
    world.add_object(box=[8, 0.4, 6], location=[0, -3, 3], **plain)
    world.add_object(box=[0.6, 16, 1.4], location=[4, 6, 0.7], **plain)
    world.add_object(box=[0.6, 16, 0.9], location=[4, 6, 5.6], **plain)
    for row in range(6):
        world.add_object(box=[0.6, 1.7, 3.8], location=[4, -1.6 + 3 * row, 3.25], **plain)
        world.add_object(cylinder={"radius": 0.28, "height": 6}, location=[-2.4, -0.1 + 3 * row, 3], **plain)
    stand(world, assets / "gltf/Fox/Fox.glb", 1.0, (-0.35, 4.2, 0), yaw=20, name="fox")
    world.add_light("sun", direction=[-1, 0.12, -0.62], irradiance=[66, 47, 25], angular_diameter=1.5)
    world.add_light("sky", radiance=[0.25, 0.34, 0.5])
    world.set_fog(extinction=0.035, albedo=0.95, g=0.6, height=5.9)
    camera = raycam.Camera.look_at([-1.2, -2.4, 1.25], [0.25, 5, 1.7], size=(960, 540), fov=46)
    return quality.shot(world, camera, samples=20)
