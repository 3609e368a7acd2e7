"""Reads the textures of a MuJoCo model.

The results are the textures' pixels, and texture coordinates for each kind of mapping. The mappings are
those of MuJoCo's documentation (XML reference, asset/texture and asset/material).
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from ...arguments import Floats
from .cube_map import cube_coordinates, split_by_cube_faces

__all__ = ["color_texture", "is_cube", "map_cube", "planar_coordinates", "skybox_faces", "texture_pixels"]

RGB, RGBA = 1, 8
"""Values of `mjtTextureRole`."""
CUBE, SKYBOX = 1, 2
"""Values of `mjtTexture`."""


def color_texture(model: Any, material: int) -> int:
    """Returns the number of a material's colour texture.

    The number is -1 for a material without a colour texture.
    """
    if material < 0:
        return -1
    roles = np.asarray(model.mat_texid[material]).ravel()
    found = [int(roles[role]) for role in (RGB, RGBA) if role < len(roles) and roles[role] >= 0]
    return found[0] if found else -1


def is_cube(model: Any, texture: int) -> bool:
    """Returns True for cube maps and skyboxes, whose six faces are stacked."""
    return int(model.tex_type[texture]) in (CUBE, SKYBOX)


def texture_pixels(model: Any, texture: int) -> npt.NDArray[np.uint8]:
    """Returns the pixels [h, w, 3 or 4] of a texture, sRGB, the first row at t = 0.

    Grey textures have equal channels. A cube map of a single image, which MuJoCo stores once, shows the image on all
    six faces.
    """
    height, width = int(model.tex_height[texture]), int(model.tex_width[texture])
    channels, start = int(model.tex_nchannel[texture]), int(model.tex_adr[texture])
    data = np.asarray(model.tex_data[start : start + height * width * channels], np.uint8)
    pixels = data.reshape(height, width, channels)
    if is_cube(model, texture) and height == width:
        pixels = np.concatenate([pixels] * 6)
    return np.repeat(pixels[:, :, :1], 3, axis=2) if channels < 3 else pixels


def planar_coordinates(corners: Floats, repeat: Floats, scale: Floats, uniform: bool) -> Floats:
    """Returns the texture coordinates [..., 2] of a 2D texture on a geom.

    The geom has no texture coordinates of its own. Such geoms are infinite planes, height fields and meshes.
    `corners` [..., 3] are in the geom's frame, in metres. `scale` [2] is half the geom's size along x and y,
    0 for infinite planes. `repeat` [2] is the number of repetitions over the geom's size. With `uniform`, and
    for infinite planes, `repeat` is the number of repetitions over two metres.
    """
    finite = (scale > 0) & (not uniform)
    return 0.5 * repeat / np.where(finite, scale, 1.0) * [1, -1] * corners[..., :2] - 0.5


def map_cube(
    corners: Floats, factors: Floats, width: int
) -> tuple[Floats, Floats, npt.NDArray[np.int64], npt.NDArray[np.float64]]:
    """Maps a cube map of 6 stacked faces onto triangles, which are cut where the face changes.

    `corners` [t, 3, 3] are in the geom's frame; multiplied by `factors` [3], they are the directions of the lookup.
    Returns for each part its corners [m, 3, 3], their texture coordinates [m, 3, 2], the original triangle [m], and
    the weights [m, 3, 3] of that triangle's corners. Coordinates stay half a texel away from the face's border,
    so that neighbouring faces in the stack do not bleed. Inside a part, coordinates are interpolated linearly, which
    is exact for boxes.
    """
    weights, faces, source = split_by_cube_faces(corners * factors)
    parts = np.einsum("mkj,mjc->mkc", weights, corners[source])
    whole = (weights == np.eye(3)).all(axis=(1, 2))
    parts[whole] = corners[source[whole]]
    directions = (parts * factors).reshape(-1, 3)
    coordinates = cube_coordinates(directions, np.repeat(faces, 3)).reshape(-1, 3, 2)
    margin = 0.5 / width
    coordinates = np.clip(coordinates, margin, 1 - margin)
    coordinates[..., 1] = (coordinates[..., 1] + faces[:, None]) / 6
    return parts, coordinates, source, weights


def skybox_faces(model: Any) -> npt.NDArray[np.float32] | None:
    """Returns the first skybox [6, w, w, 3] of a model, sRGB from 0 to 1.

    The result is None if the model has no skybox. MuJoCo looks the skybox up in the direction (x, z, -y) for
    a viewing direction (x, y, z) in the world.
    """
    for texture in range(model.ntex):
        if int(model.tex_type[texture]) == SKYBOX:
            pixels = texture_pixels(model, texture)[:, :, :3]
            return np.asarray(pixels.reshape(6, pixels.shape[1], -1, 3) / 255, np.float32)
    return None
