"""Renders structured light: a projector casts a coloured code onto a skull.

The lines of the code follow the shape of the skull.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import raycam
from common import Picture, Quality, stand


def picture(assets: Path, quality: Quality) -> Picture:
    """Renders the image; returns sRGB bytes [h, w, 3]."""
    world = raycam.World()
    stand(world, assets / "meshes/skull.obj", 1.0, roll=90, yaw=-48, name="skull", color="#d9d2c4", type="principled",
          roughness=0.6)  # fmt: skip
    world.add_object(plane=20, color="#55504c")
    world.add_object(box=[20, 0.1, 6], location=[0, 2.2, 3], color="#55504c")
    columns = np.arange(1024)
    code = np.array(
        [[1, 0.05, 0.1], [0.1, 1, 0.2], [0.1, 0.2, 1], [1, 0.9, 0.05], [0.05, 0.9, 1], [1, 0.1, 0.9]]
    )
    order = np.random.default_rng(4).integers(0, 6, 43)
    stripes = code[order[columns // 24]] * (columns % 24 < 17)[:, None]
    image = np.repeat(stripes[None], 640, axis=0).astype(np.float32)
    beamer = raycam.Camera.look_at([1.6, -3.4, 1.3], [0, 0, 0.52], size=(1024, 640), fov=36)
    world.add_light("projector", image=image, camera=beamer, irradiance=110)
    world.add_light("sky", radiance=[0.03, 0.04, 0.075])
    camera = raycam.Camera.look_at([-0.9, -3.2, 0.85], [0.12, 0, 0.5], size=(960, 540), fov=25)
    return quality.shot(world, camera, samples=20)
