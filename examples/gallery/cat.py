"""Renders a scanned statue in a museum at night, with a shallow depth of field.

A warm light from above and a cool light from behind illuminate the statue.
"""

from __future__ import annotations

from pathlib import Path

import raycam
from common import Picture, Quality, fractal, mix, softbox, stand


def picture(assets: Path, quality: Quality) -> Picture:
    """Renders the image; returns sRGB bytes [h, w, 3]."""
    world = raycam.World()
    stand(world, assets / "gltf/cat/cat.glb", 1.0, (0, 0, 1), yaw=-40, name="cat")
    marble = mix("#20211f", "#8d8a80", fractal((512, 512), 1.5, seed=3) ** 1.5)
    world.add_object(
        box=[0.75, 0.75, 1], location=[0, 0, 0.5], texture=marble, type="principled", roughness=0.3
    )
    world.add_object(plane=30, type="principled", roughness=0.25, color="#241c18")
    world.add_object(box=[30, 0.2, 8], location=[0, 5, 4], color="#5a4038")
    for x in (-3.2, 0.9, 4.6):
        world.add_light("spot", position=[x, 4.2, 4.6], target=[x, 5, 1.2], inner=8, outer=34, radius=0.08,
                        power=[90, 55, 28], visible={"camera": False})  # fmt: skip
    softbox(world, (-1.8, -1.8, 3.6), (0, 0, 1.5), (0.9, 0.9), [110, 88, 62])
    softbox(world, (1.9, 1.6, 2.2), (0, 0, 1.5), (0.35, 1.4), [36, 60, 96])
    camera = raycam.Camera.look_at([-0.35, -3.3, 1.7], [0.36, 0, 1.5], size=(960, 540), fov=22)
    return quality.shot(world, camera.with_aperture(0.05, focus=3.15), samples=20)
