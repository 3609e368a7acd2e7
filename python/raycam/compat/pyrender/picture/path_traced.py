"""Images of pyrender's scenes, path traced by raycam.

The images contain shadows, reflections and indirect light.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

import raycam
from raycam.srgb import srgb_from_linear

from ..camera import Camera
from ..constants import GLTF
from ..light import DirectionalLight, Light, SpotLight
from ..material import MetallicRoughnessMaterial
from ..primitive import Primitive
from ..scene import Scene
from ..texture import Texture

__all__ = ["path_traced_picture", "pinhole_camera", "world_of"]

Floats = npt.NDArray[Any]

SAMPLES, MAX_DEPTH = 64, 8
WRAPS = {GLTF.CLAMP_TO_EDGE: "clamp", GLTF.MIRRORED_REPEAT: "mirror", GLTF.REPEAT: "repeat"}


def path_traced_picture(
    scene: Scene, camera: Camera, pose: Floats, size: tuple[int, int]
) -> npt.NDArray[np.uint8]:
    """Returns the image [h, w, 4] in sRGB over the scene's background.

    The integrator "path" renders the image with 64 samples. The ambient light is a uniform sky. Raises
    `NotImplementedError` for parallel rays.
    """
    world = world_of(scene)
    frame = raycam.render(
        world,
        pinhole_camera(camera, pose, size),
        integrator="path",
        samples=SAMPLES,
        max_depth=MAX_DEPTH,
        channels=("color", "alpha"),
        transparent_background=True,
    )
    alpha = frame["alpha"][..., np.newaxis]
    color = np.divide(frame["color"], alpha, out=np.zeros_like(frame["color"]), where=alpha > 0)
    shown = srgb_from_linear(np.clip(color, 0, 1)) * alpha + scene.bg_color[:3] * (1 - alpha)
    opacity = alpha + scene.bg_color[3] * (1 - alpha)
    picture = np.clip(np.concatenate([shown, opacity], axis=2), 0, 1)
    return np.asarray(np.round(255 * picture), dtype=np.uint8)


def world_of(scene: Scene, lights: Sequence[tuple[Light, Floats]] = ()) -> raycam.World:
    """Returns a scene as a world, y up, with additional `lights` at their poses.

    The ambient light becomes a uniform sky.
    """
    world = raycam.World("y")
    for node in scene.mesh_nodes:
        if node.mesh is None or not node.mesh.is_visible:
            continue
        for primitive in node.mesh.primitives:
            if primitive.has_faces and len(primitive.faces) > 0:
                _add_primitive(world, primitive, scene.get_pose(node))
    world.add_light("sky", radiance=_finite(scene.ambient_light))
    for node in scene.light_nodes:
        if node.light is not None:
            _add_light(world, node.light, scene.get_pose(node))
    for light, pose in lights:
        _add_light(world, light, pose)
    return world


def _add_primitive(world: raycam.World, primitive: Primitive, pose: Floats) -> None:
    uvs = primitive.texcoord_0
    colors = primitive.color_0
    options: dict[str, Any] = {
        "material": _material(primitive.material, uvs is not None),
        "normals": primitive.normals,
        "uvs": None if uvs is None else np.stack([uvs[:, 0], 1 - uvs[:, 1]], axis=1),
        "vertex_colors": None if colors is None else np.clip(colors[:, :3], 0, 1).astype(np.float32),
    }
    for place in primitive.places:
        matrix = pose @ place
        if np.isfinite(matrix).all() and abs(np.linalg.det(matrix[:3, :3])) > 1e-30:
            world.add_mesh(primitive.positions, primitive.faces, matrix=matrix, **options)


def _material(material: Any, textured: bool) -> dict[str, Any]:
    """The keys of a material of type "principled"."""
    keys: dict[str, Any] = {
        "type": "principled",
        "color": np.clip(material.baseColorFactor[:3], 0, 1),
        "emission": _finite(material.emissiveFactor),
    }
    if isinstance(material, MetallicRoughnessMaterial):
        keys["metallic"], keys["roughness"] = material.metallicFactor, material.roughnessFactor
    if material.alphaMode == "BLEND":
        keys["opacity"], keys["alpha"] = float(np.clip(material.baseColorFactor[3], 0, 1)), "blend"
    else:
        keys["alpha"] = "opaque"
    if textured:
        base, rough, shining = (
            material.baseColorTexture,
            material.metallicRoughnessTexture,
            material.emissiveTexture,
        )
        textures = {"emission": shining}
        if base is not None:
            keys["texture"] = _texture(base)
        keys["textures"] = {name: _texture(one) for name, one in textures.items() if one is not None}
        if rough is not None:
            keys["textures"] |= dict.fromkeys(("metallic", "roughness"), _texture(rough, (3, 0, 1, 3)))
    return keys


def _texture(texture: Texture, channels: tuple[int, ...] = (0, 1, 2, 3)) -> dict[str, Any]:
    """Returns the texture keys of a raycam material; `channels` are the texel channels in order."""
    sampler = texture.sampler
    nearest = sampler.magFilter == GLTF.NEAREST
    return {
        "image": np.round(255 * np.clip(texture.texels()[..., channels], 0, 1)).astype(np.uint8),
        "wrap": [WRAPS.get(mode, "repeat") for mode in (sampler.wrapS, sampler.wrapT)],
        "filter": "nearest" if nearest else "linear",
    }


def _add_light(world: raycam.World, light: Light, pose: Floats) -> None:
    strength = _finite(light.color * light.intensity)
    along = -pose[:3, 2]
    if isinstance(light, DirectionalLight):
        world.add_light("sun", direction=along, irradiance=strength)
    elif isinstance(light, SpotLight):
        cone = np.degrees([light.innerConeAngle, max(light.outerConeAngle, 1e-6)]).clip(0, 90)
        world.add_light(
            "spot", position=pose[:3, 3], direction=along, intensity=strength, inner=cone[0], outer=cone[1]
        )
    else:
        world.add_light("point", position=pose[:3, 3], intensity=strength)


def pinhole_camera(camera: Camera, pose: Floats, size: tuple[int, int]) -> raycam.Camera:
    """Returns the camera without its near and far planes.

    The camera's matrix K is computed from the rays of two image corners.
    """
    width, height = size
    starts, ways = camera.rays(np.array([0.0, width]), np.array([0.0, height]), size)
    if np.ptp(starts) > 0:
        raise NotImplementedError(
            'shading "raycam" requires a perspective camera; for parallel rays, use raycam.Camera.orthographic'
        )
    fx, fy = width / (ways[1, 0] - ways[0, 0]), height / (ways[0, 1] - ways[1, 1])
    K = [[fx, 0, -ways[0, 0] * fx], [0, fy, ways[0, 1] * fy], [0, 0, 1]]
    return raycam.Camera.from_opengl(K, pose, size, pixel_center="half", up="y")


def _finite(values: npt.ArrayLike) -> Floats:
    return np.clip(np.nan_to_num(np.asarray(values, dtype=np.float64)), 0, None)
