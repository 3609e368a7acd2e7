"""Renders `path_scenes.py` in raycam."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
from path_scenes import DEPTH, Array, Scene, behind


def picture(scene: Scene, size: tuple[int, int]) -> Any:
    """Returns a function that renders an image: (samples, seed) to (image, seconds)."""
    import raycam

    world = raycam.World()
    for path, material in scene["objects"]:
        data = np.load(path)
        style: dict[str, Any] = {"color": material.get("matte", [1, 1, 1])}
        if "gold" in material:
            style = {"type": "metal", "metal": "gold", "roughness": material.get("roughness", 0.0)}
        if "glass" in material:
            style = {"type": "glass", "ior": material["glass"], "roughness": material.get("roughness", 0.0)}
        if "principled" in material:
            style = {"type": "principled", "color": material["principled"]}
            style |= {name: material[name] for name in ("roughness", "metallic")}
        if "coat" in material:
            style |= {"clearcoat": material["coat"], "clearcoat_roughness": 0.1**0.5}
        if "shines" in material:
            style = {"color": [0, 0, 0], "emission": material["shines"]}
        if "pane" in material:
            style = {"type": "glass", "ior": material["pane"], "thin": True}
        world.add_mesh(data["vertices"], data["faces"], material=style)
    for light in scene["lights"]:
        if "area" in light:
            center, u, v = light["area"]
            world.add_light(
                {"type": "area", "position": center, "u": u, "v": v, "radiance": light["radiance"]}
            )
            world.add_mesh(*behind(center, u, v), material={"color": [0, 0, 0]})
        elif "image" in light:
            world.add_light({"type": "environment", "image": light["image"]})
        elif "bulb" in light:
            world.add_light({"type": "point", "position": light["bulb"], "intensity": light["intensity"]})
        elif "sun" in light:
            world.add_light({"type": "sun", "direction": light["sun"], "irradiance": light["irradiance"]})
        else:
            world.add_light({"type": "sky", "radiance": light["sky"]})
    view = scene["camera"]
    camera = raycam.Camera.look_at(view["eye"], view["target"], [0, 0, 1], size=size, fov=view["fov"])

    def render(samples: int, seed: int) -> tuple[Array, float]:
        start = time.perf_counter()
        frame = raycam.render(
            world,
            camera,
            integrator="path",
            samples=samples,
            max_depth=scene.get("depth", DEPTH),
            seed=seed,
            channels="color",
        )
        return frame["color"], time.perf_counter() - start

    return render
