"""Renders `path_scenes.py` and `hard_scenes.py` in Cycles without any source of bias.

Cycles is installed by `pip install bpy`. Samples are not clamped, glossy bounces are not blurred, and no
light is omitted because of a threshold. Adaptive sampling and denoising are off, caustics are on, and the
pixel filter is a box of one pixel. Cycles' lamps do not block light, as in raycam.
"""

from __future__ import annotations

import math
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from path_scenes import DEPTH, GOLD, Array, Scene, behind

SETTINGS = {
    "device": "CPU",
    "pixel_filter_type": "BOX",
    "filter_width": 1.0,
    "use_adaptive_sampling": False,
    "use_denoising": False,
    "sample_clamp_direct": 0.0,
    "sample_clamp_indirect": 0.0,
    "light_sampling_threshold": 0.0,
    "blur_glossy": 0.0,
    "caustics_reflective": True,
    "caustics_refractive": True,
    "use_fast_gi": False,
    "min_light_bounces": 0,
    "min_transparent_bounces": 0,
    "transparent_max_bounces": 64,
    "sampling_pattern": "TABULATED_SOBOL",
    "use_auto_tile": False,
}
BOUNCES = ("max_bounces", "diffuse_bounces", "glossy_bounces", "transmission_bounces")


def material(bpy: Any, style: dict[str, Any]) -> Any:
    made = bpy.data.materials.new("m")
    made.use_nodes = True
    tree = made.node_tree
    tree.nodes.clear()
    output = tree.nodes.new("ShaderNodeOutputMaterial")

    def node(kind: str, **values: Any) -> Any:
        new = tree.nodes.new(f"ShaderNode{kind}")
        for name, value in values.items():
            target = new.inputs[name.replace("_", " ")]
            if hasattr(value, "is_output"):
                tree.links.new(value, target)
            else:
                target.default_value = value
        return new

    def math_node(operation: str, a: Any, b: Any) -> Any:
        new = tree.nodes.new("ShaderNodeMath")
        new.operation = operation
        for value, target in zip((a, b), new.inputs, strict=False):
            if hasattr(value, "is_output"):
                tree.links.new(value, target)
            else:
                target.default_value = value
        return new.outputs[0]

    if "gold" in style:
        surface = node("BsdfMetallic", Roughness=style.get("roughness", 0.0))
        surface.fresnel_type = "PHYSICAL_CONDUCTOR"
        surface.inputs["IOR"].default_value, surface.inputs["Extinction"].default_value = GOLD
    elif "glass" in style:
        rough = style.get("roughness", 0.0)
        surface = node("BsdfGlass", Roughness=rough, IOR=style["glass"], Color=[1, 1, 1, 1])
    elif "shines" in style:
        surface = node("Emission", Color=[*style["shines"], 1], Strength=1.0)
    elif "principled" in style:
        named = {"Roughness": style["roughness"], "Metallic": style["metallic"], "IOR": 1.5}
        surface = node("BsdfPrincipled", Base_Color=[*style["principled"], 1], **named)
    elif "pane" in style:
        # The reflections between both sides of a pane sum to 2 F / (1 + F). For rays from behind, the index of
        # refraction is inverted, because Cycles' node `Fresnel` would assume that they leave the glass.
        back = tree.nodes.new("ShaderNodeNewGeometry").outputs["Backfacing"]
        ior = math_node("POWER", style["pane"], math_node("SUBTRACT", 1.0, math_node("MULTIPLY", back, 2.0)))
        fresnel = node("Fresnel", IOR=ior).outputs[0]
        share = math_node("DIVIDE", math_node("MULTIPLY", fresnel, 2.0), math_node("ADD", fresnel, 1.0))
        mirror = node("BsdfAnisotropic", Roughness=0.0, Color=[1, 1, 1, 1])
        # Shadow rays pass transparent surfaces, but not refracting ones, and both renderers do not count the segment.
        through = node("BsdfTransparent", Color=[1, 1, 1, 1])
        surface = tree.nodes.new("ShaderNodeMixShader")
        tree.links.new(share, surface.inputs[0])
        tree.links.new(through.outputs[0], surface.inputs[1])
        tree.links.new(mirror.outputs[0], surface.inputs[2])
    else:
        surface = node("BsdfDiffuse", Color=[*style["matte"], 1], Roughness=0.0)
    tree.links.new(surface.outputs[0], output.inputs["Surface"])
    return made


def add_mesh(bpy: Any, vertices: Array, faces: Array, made: Any) -> None:
    mesh = bpy.data.meshes.new("mesh")
    mesh.vertices.add(len(vertices))
    mesh.vertices.foreach_set("co", np.ascontiguousarray(vertices, np.float32).ravel())
    mesh.loops.add(faces.size)
    mesh.loops.foreach_set("vertex_index", np.ascontiguousarray(faces, np.int32).ravel())
    mesh.polygons.add(len(faces))
    mesh.polygons.foreach_set("loop_start", np.arange(0, faces.size, 3, dtype=np.int32))
    mesh.update(calc_edges=True)
    mesh.shade_flat()
    mesh.materials.append(made)
    bpy.context.collection.objects.link(bpy.data.objects.new("object", mesh))


def add_light(bpy: Any, light: dict[str, Any], rotation: Any) -> None:
    if "sky" in light:
        world = bpy.data.worlds.new("world")
        world.use_nodes = True
        background = world.node_tree.nodes["Background"]
        background.inputs["Color"].default_value = [*light["sky"], 1]
        background.inputs["Strength"].default_value = 1.0
        bpy.context.scene.world = world
        return
    if "area" in light:
        center, u, v = map(np.array, light["area"])
        lamp = bpy.data.lights.new("lamp", "AREA")
        lamp.shape = "RECTANGLE"
        lamp.size, lamp.size_y = np.linalg.norm(u), np.linalg.norm(v)
        # The power in watts of a Lambertian emitter.
        lamp.energy = math.pi * lamp.size * lamp.size_y
        lamp.color = light["radiance"]
        axes = np.stack(
            [u / lamp.size, -v / lamp.size_y, -np.cross(u, v) / (lamp.size * lamp.size_y)], axis=1
        )
        add_mesh(bpy, *behind(*light["area"]), material(bpy, {"matte": [0, 0, 0]}))
    elif "bulb" in light:
        center = light["bulb"]
        lamp = bpy.data.lights.new("lamp", "POINT")
        lamp.shadow_soft_size = 0.0
        lamp.energy = 4 * math.pi
        lamp.color = light["intensity"]
        axes = np.eye(3)
    else:
        center = [0, 0, 10]
        lamp = bpy.data.lights.new("lamp", "SUN")
        lamp.angle = 0.0
        lamp.energy = 1.0
        lamp.color = light["irradiance"]
        axes = rotation(light["sun"])
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = axes, center
    bpy_object = bpy.data.objects.new("lamp", lamp)
    # mathutils interprets plain lists as columns.
    bpy_object.matrix_world = matrix.T.tolist()
    bpy.context.collection.objects.link(bpy_object)
    bpy_object.visible_camera = True


def along(direction: list[float]) -> Array:
    """Returns a rotation matrix whose -z axis points along `direction`, as in Blender's cameras.

    The world's z axis points up in the image.
    """
    back = -np.array(direction, float) / np.linalg.norm(direction)
    right = np.cross([0, 0, 1], back)
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(back, right), back], axis=1)


def picture(
    scene: Scene, size: tuple[int, int], clock: Callable[[], float] = time.perf_counter, **settings: Any
) -> Any:
    """Returns a function that renders an image: (samples, seed) to (image, seconds)."""
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    world = bpy.context.scene
    world.render.engine = "CYCLES"
    # Cycles counts bounces after the first hit, so a path has two more segments than bounces. The maximum is 1024.
    bounces = dict.fromkeys(BOUNCES, (scene.get("depth", DEPTH) or 1026) - 2)
    for name, value in (SETTINGS | bounces | settings).items():
        setattr(world.cycles, name, value)
    world.render.use_persistent_data = True
    world.render.resolution_x, world.render.resolution_y = size
    world.render.resolution_percentage = 100
    world.render.use_compositing = world.render.use_sequencer = False
    world.render.image_settings.file_format = "OPEN_EXR"
    world.render.image_settings.color_depth = "32"
    world.render.image_settings.color_mode = "RGB"
    world.render.image_settings.exr_codec = "NONE"
    for path, style in scene["objects"]:
        data = np.load(path)
        add_mesh(bpy, data["vertices"], data["faces"], material(bpy, style))
    for light in scene["lights"]:
        add_light(bpy, light, along)
    view = scene["camera"]
    lens = bpy.data.cameras.new("camera")
    lens.sensor_fit = "VERTICAL"
    lens.angle_y = math.radians(view["fov"])
    lens.clip_start, lens.clip_end = 1e-3, 1e5
    matrix = np.eye(4)
    matrix[:3, :3] = along(np.subtract(view["target"], view["eye"]).tolist())
    matrix[:3, 3] = view["eye"]
    camera = bpy.data.objects.new("camera", lens)
    camera.matrix_world = matrix.T.tolist()
    bpy.context.collection.objects.link(camera)
    world.camera = camera

    def once(samples: int, seed: int) -> tuple[Array, float]:
        world.cycles.samples, world.cycles.seed = samples, seed
        with tempfile.TemporaryDirectory() as folder:
            world.render.filepath = str(Path(folder) / "picture.exr")
            start = clock()
            bpy.ops.render.render(write_still=True)
            took = clock() - start
            image = bpy.data.images.load(world.render.filepath)
            image.colorspace_settings.name = "Non-Color"
            pixels = np.empty(size[0] * size[1] * image.channels, np.float32)
            image.pixels.foreach_get(pixels)
            bpy.data.images.remove(image)
        return pixels.reshape(size[1], size[0], -1)[::-1, :, :3].copy(), took

    once(1, 0)
    overheads = [once(1, seed)[1] for seed in range(5)]

    def render(samples: int, seed: int) -> tuple[Array, float]:
        overheads.append(once(1, seed)[1])
        image, took = once(samples, seed)
        return image, max(took - min(overheads), 1e-9) * samples / max(samples - 1, 1)

    return render
