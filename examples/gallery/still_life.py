"""The scene of several images of the gallery: seven models on a table under a window."""

from __future__ import annotations

from pathlib import Path

import raycam
from common import Picture, Quality, planks, softbox, stand


def still_life(assets: Path) -> tuple[raycam.World, raycam.Camera]:
    """Returns the world and its camera."""
    world = raycam.World()
    model = {"category": "model"}
    stand(world, assets / "gltf/cat/cat.glb", 0.42, (-0.05, 0.22, 0), yaw=-30, name="cat", **model)
    stand(
        world,
        assets / "gltf/StainedGlassLamp-KTX2/StainedGlassLamp.gltf",
        0.55,
        (-0.48, 0.22, 0),
        name="lamp",
        **model,
    )
    stand(world, assets / "meshes/skull.obj", 0.19, (0.30, 0.1, 0), roll=90, yaw=-25, name="skull", color="#d8cbb0",
          type="principled", roughness=0.55, **model)  # fmt: skip
    stand(world, assets / "meshes/boot.obj", 0.2, (0.62, 0.2, 0), roll=90, yaw=-60, name="boot", color="#7a4a22",
          type="principled", roughness=0.6, sheen_color=[0.2, 0.15, 0.1], **model)  # fmt: skip
    stand(world, assets / "meshes/fish.obj", 0.13, (0.28, -0.22, 0), roll=90, yaw=60, name="fish", type="glass",
          ior=1.5, attenuation_color=[0.4, 0.8, 0.95], attenuation_distance=0.1, **model)  # fmt: skip
    stand(world, assets / "gltf/Fox/Fox.glb", 0.2, (-0.28, -0.16, 0), yaw=70, name="fox", **model)
    stand(world, assets / "meshes/cycloidal.ply", 0.13, (0.0, -0.12, 0), name="gearbox", type="metal",
          metal="copper", roughness=0.25, **model)  # fmt: skip
    world.add_object(box=[2.2, 1.3, 0.06], location=[0, 0, -0.03], texture=planks(), type="principled", roughness=0.3,
                     name="table")  # fmt: skip
    world.add_object(box=[6, 0.1, 4], location=[0, 1.6, 0.5], color="#5f7f80", name="wall")
    world.add_object(plane=8, location=[0, 0, -0.75], color="#6b5a4c", name="floor")
    softbox(world, (-2.2, -0.9, 1.9), (0, 0, 0.1), (0.8, 0.8), [52, 45, 36])
    world.add_light("sky", radiance=[0.14, 0.17, 0.22])
    camera = raycam.Camera.look_at([0.25, -1.75, 0.75], [0.06, 0.06, 0.15], size=(960, 540), fov=24)
    return world, camera


def picture(assets: Path, quality: Quality) -> Picture:
    """Renders the image; returns sRGB bytes [h, w, 3]."""
    world, camera = still_life(assets)
    return quality.shot(world, camera, samples=20)
