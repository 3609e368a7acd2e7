"""The materials of a MuJoCo model as keys of an object."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ...arguments import Floats
from ...srgb import linear_from_srgb
from ...world.texture import Texture
from .model import GEOM_OBJECT, SITE_OBJECT, element_prefix
from .textures import color_texture, texture_pixels

__all__ = ["SurfaceValues", "element_look", "is_opaque", "material_keys", "surface_values"]

OPAQUE = 0.995
"""The smallest alpha with which MuJoCo draws a geom as opaque (`mjr_render`)."""


@dataclass(frozen=True)
class SurfaceValues:
    """The values of MuJoCo's own light model for a material, or for geoms without a material."""

    emission: float = 0.0
    specular: float = 0.5
    shininess: float = 0.5
    reflectance: float = 0.0


def element_look(model: Any, kind: int, number: int, dynamic_alpha: float = 1.0) -> tuple[Floats, int]:
    """Returns the colour [4] and the material (-1: none) of a geom, site, flex or skin.

    The colour is the material's colour, unless the element's own colour differs from MuJoCo's default grey.
    `dynamic_alpha` multiplies the opacity of elements that are not fixed to the world.
    """
    prefix = element_prefix(kind)
    material = int(getattr(model, f"{prefix}_matid")[number])
    rgba = np.array(getattr(model, f"{prefix}_rgba")[number], np.float64)
    if material >= 0 and (rgba == (0.5, 0.5, 0.5, 1)).all():
        rgba = np.array(model.mat_rgba[material], np.float64)
    is_rigid = kind in (GEOM_OBJECT, SITE_OBJECT)
    if not is_rigid or model.body_weldid[getattr(model, f"{prefix}_bodyid")[number]] != 0:
        rgba[3] *= dynamic_alpha
    return rgba, material


def surface_values(model: Any, material: int) -> SurfaceValues:
    """Returns a material's values; the defaults of `mjv_updateScene` for -1."""
    if material < 0:
        return SurfaceValues()
    names = ("emission", "specular", "shininess", "reflectance")
    return SurfaceValues(*(float(getattr(model, f"mat_{name}")[material]) for name in names))


def is_opaque(rgba: Floats) -> bool:
    """Returns True if MuJoCo draws this colour without blending."""
    return float(rgba[3]) >= OPAQUE


def material_keys(model: Any, rgba: Floats, material: int) -> dict[str, Any]:
    """Returns the keys of a material with its colour texture.

    Colours are multiplied in sRGB, as in MuJoCo.
    """
    srgb = np.clip(rgba[:3], 0, 1)
    keys: dict[str, Any] = {"color": linear_from_srgb(srgb)}
    texture = color_texture(model, material)
    if texture >= 0:
        pixels = texture_pixels(model, texture)
        tinted = np.round(pixels[:, :, :3] * srgb).astype(np.uint8)
        if pixels.shape[2] == 4:
            tinted = np.concatenate([tinted, pixels[:, :, 3:]], axis=2)
        keys |= {"texture": Texture(tinted).description(), "color": [1.0, 1.0, 1.0]}
    if rgba[3] < 1:
        keys["opacity"] = float(rgba[3])
    emission = surface_values(model, material).emission
    if emission > 0:
        keys["emission"] = emission * linear_from_srgb(srgb)
    return keys
