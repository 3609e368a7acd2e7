"""Renders `path_scenes.py` in Mitsuba 3, whose area lights block light."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
from path_scenes import DEPTH, GOLD, Array, Scene


def rgb(value: list[float]) -> dict[str, Any]:
    return {"type": "rgb", "value": value}


def bsdf(material: dict[str, Any]) -> dict[str, Any]:
    if "principled" in material:
        shape = {name: material[name] for name in ("roughness", "metallic")}
        if "coat" in material:
            # Mitsuba's clear coat has a quarter of raycam's strength; without gloss, its roughness is 0.1.
            shape |= {"clearcoat": 4 * material["coat"], "clearcoat_gloss": 0.0}
        return {"type": "principled", "base_color": rgb(material["principled"]), "specular": 0.5, **shape}
    # Mitsuba's roughness is the square of raycam's.
    rough = {"distribution": "ggx", "alpha": material.get("roughness", 0.0) ** 2}
    if "gold" in material:
        metal = {"eta": rgb(GOLD[0]), "k": rgb(GOLD[1])}
        if rough["alpha"]:
            return {"type": "twosided", "bsdf": {"type": "roughconductor", **metal, **rough}}
        return {"type": "twosided", "bsdf": {"type": "conductor", **metal}}
    if "glass" in material:
        glass = {"int_ior": material["glass"], "ext_ior": 1.0}
        if rough["alpha"]:
            return {"type": "roughdielectric", **glass, **rough}
        return {"type": "dielectric", **glass}
    if "shines" in material:
        return {"type": "diffuse", "reflectance": rgb([0, 0, 0])}
    if "pane" in material:
        return {"type": "thindielectric", "int_ior": material["pane"], "ext_ior": 1.0}
    return {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": rgb(material["matte"])}}


def emitter(light: dict[str, Any], transform: Any) -> dict[str, Any]:
    if "area" in light:
        center, u, v = map(np.array, light["area"])
        matrix = np.eye(4)
        normal = np.cross(u, v) / np.linalg.norm(np.cross(u, v))
        matrix[:3] = np.stack([u / 2, v / 2, normal, center], axis=1)
        return {
            "type": "rectangle",
            "to_world": transform(matrix),
            "bsdf": {"type": "diffuse", "reflectance": rgb([0, 0, 0])},
            "emitter": {"type": "area", "radiance": rgb(light["radiance"])},
        }
    if "image" in light:
        # In Mitsuba's environments, y points up, and the middle of the image is the direction z.
        turned = np.array([[0, 0, 1, 0], [1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 1.0]])
        return {"type": "envmap", "filename": light["image"], "to_world": transform(turned)}
    if "bulb" in light:
        return {"type": "point", "position": light["bulb"], "intensity": rgb(light["intensity"])}
    if "sun" in light:
        return {"type": "directional", "direction": light["sun"], "irradiance": rgb(light["irradiance"])}
    return {"type": "constant", "radiance": rgb(light["sky"])}


def picture(
    scene: Scene, size: tuple[int, int], variant: str = "scalar_rgb", sampler: str = "independent"
) -> Any:
    """Returns a function that renders an image: (samples, seed) to (image, seconds)."""
    import mitsuba as mi

    mi.set_variant(variant)
    transform = mi.ScalarTransform4f
    view = scene["camera"]
    world: dict[str, Any] = {
        "type": "scene",
        # In Mitsuba, -1 means an unlimited number of segments.
        "integrator": {"type": "path", "max_depth": scene.get("depth", DEPTH) or -1},
        "sensor": {
            "type": "perspective",
            "fov": view["fov"],
            "fov_axis": "y",
            "to_world": transform().look_at(origin=view["eye"], target=view["target"], up=[0, 0, 1]),
            "film": {
                "type": "hdrfilm",
                "width": size[0],
                "height": size[1],
                "rfilter": {"type": "box"},
                "pixel_format": "rgb",
            },
            "sampler": {"type": sampler},
        },
    }
    for number, (path, material) in enumerate(scene["objects"]):
        data = np.load(path)
        properties = mi.Properties()
        properties["mesh_bsdf"] = mi.load_dict(bsdf(material))
        if "shines" in material:
            properties["mesh_emitter"] = mi.load_dict({"type": "area", "radiance": rgb(material["shines"])})
        mesh = mi.Mesh(f"m{number}", len(data["vertices"]), len(data["faces"]), props=properties)
        parameters = mi.traverse(mesh)
        parameters["vertex_positions"] = data["vertices"].ravel()
        parameters["faces"] = data["faces"].ravel()
        parameters.update()
        world[f"object{number}"] = mesh
    for number, light in enumerate(scene["lights"]):
        world[f"light{number}"] = emitter(light, transform)
    loaded = mi.load_dict(world)

    def render(samples: int, seed: int) -> tuple[Array, float]:
        start = time.perf_counter()
        image = np.array(mi.render(loaded, spp=samples, seed=seed))
        return image, time.perf_counter() - start

    return render
