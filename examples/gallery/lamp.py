"""Renders a desk in the evening.

A stained-glass lamp with bulbs inside lights a skull, a sword and a statue.
"""

from __future__ import annotations

from pathlib import Path

import raycam
from common import Picture, Quality, planks, softbox, stand


def picture(assets: Path, quality: Quality) -> Picture:
    """Renders the image; returns sRGB bytes [h, w, 3]."""
    world = raycam.World()
    stand(
        world, assets / "gltf/StainedGlassLamp-KTX2/StainedGlassLamp.gltf", 0.69, (0.18, 0.1, 0), name="lamp"
    )
    stand(world, assets / "meshes/skull.obj", 0.2, (-0.26, -0.02, 0), roll=90, yaw=25, color="#cbb994",
          type="principled", roughness=0.5, name="skull")  # fmt: skip
    stand(world, assets / "gltf/cat/cat.glb", 0.34, (0.62, 0.14, 0), yaw=-70, name="cat")
    stand(world, assets / "meshes/sword-quad-dominant.obj", 0.036, (0.16, -0.24, 0), pitch=90, yaw=12, type="metal",
          metal="iron", roughness=0.25, name="sword")  # fmt: skip
    world.add_object(
        box=[2.4, 1.2, 0.05], location=[0, 0, -0.025], texture=planks(), type="principled", roughness=0.28
    )
    world.add_object(box=[8, 0.1, 4], location=[0, 1.0, 0.8], color="#39513f", name="wall")
    for x, y in ((0.06, 0.0), (-0.06, 0.05), (0, -0.07)):
        world.add_light("bulb", position=[0.18 + x, 0.1 + y, 0.47], radius=0.018, power=[20, 12.7, 6.4],
                        visible={"camera": False})  # fmt: skip
    softbox(world, (-2.5, -1.0, 1.6), (0, 0, 0.2), (1.2, 1.6), [1.6, 2.4, 3.8])
    camera = raycam.Camera.look_at([-0.25, -1.75, 0.5], [0.14, 0.05, 0.29], size=(960, 540), fov=26)
    return quality.shot(world, camera.with_aperture(0.01, focus=1.75), samples=24, max_depth=10)
