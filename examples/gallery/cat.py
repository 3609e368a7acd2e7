"""A scanned statue in a museum at night: a warm spot from above, a cool rim, shallow depth of field."""

from __future__ import annotations

from pathlib import Path

import raycam
from common import Picture, Quality, fractal, mix, softbox, stand


def picture(assets: Path, quality: Quality) -> Picture:
    """Returns the image."""
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
    softbox(world, (-1.8, -1.8, 3.6), (0, 0, 1.5), (0.9, 0.9), [70, 56, 40])
    softbox(world, (1.9, 1.6, 2.2), (0, 0, 1.5), (0.35, 1.4), [36, 60, 96])
    camera = raycam.Camera.look_at([-0.35, -3.6, 1.72], [0.42, 0, 1.47], size=(1280, 720), fov=22)
    return quality.shot(world, camera.with_aperture(0.05, focus=3.4), samples=96)
