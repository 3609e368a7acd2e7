"""Shading of pyrender's default shader, pixel by pixel in NumPy.

Lambert and GGX are computed with the shader's formulas and constants. Normals that face away are not flipped.
Radiance is neither clipped nor tone-mapped before the gamma of 1 / 2.2.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from raycam.srgb import linear_from_srgb

from ..light import DirectionalLight, Light, SpotLight
from ..material import MetallicRoughnessMaterial

__all__ = ["GAMMA", "PlacedLight", "Surfaces", "bent", "shade", "surface_values", "turn_normals"]

Floats = npt.NDArray[Any]
Shadow = Callable[["PlacedLight", Floats], npt.NDArray[np.bool_]]

GAMMA = 1 / 2.2
F0, LEAST = 0.04, 0.001


@dataclass
class PlacedLight:
    """A light with its position and direction in the world."""

    light: Light
    position: Floats
    direction: Floats


@dataclass
class Surfaces:
    """Points [m] of one material: the surface values and the viewing directions."""

    position: Floats
    normal: Floats
    to_eye: Floats
    base: Floats
    metallic: Floats
    roughness: Floats
    emissive: Floats
    occlusion: Floats
    vertex_color: Floats


def surface_values(
    material: MetallicRoughnessMaterial, uv: Floats | None, vertex_color: Floats, count: int, flat: bool
) -> dict[str, Floats]:
    """Returns the values of a material at `count` points with the texture coordinates `uv`.

    `uv` is [m, 2], or None without texture coordinates. The values are `base` [m, 4], `metallic`, `roughness` and
    `occlusion` [m], and `emissive` [m, 3]. They are linear; with `flat`, the base colour's texels are multiplied as
    they are, in sRGB. The emissive factor is squared, as in pyrender.
    """
    base = np.tile(material.baseColorFactor.astype(np.float64), (count, 1))
    metallic = np.full(count, material.metallicFactor)
    roughness = np.full(count, material.roughnessFactor)
    emissive = np.tile(material.emissiveFactor.astype(np.float64) ** 2, (count, 1))
    occlusion = np.ones(count)
    if uv is not None:
        if material.baseColorTexture is not None:
            texels = material.baseColorTexture.lookup(uv)
            base *= (
                texels if flat else np.concatenate([linear_from_srgb(texels[:, :3]), texels[:, 3:]], axis=1)
            )
        if material.metallicRoughnessTexture is not None:
            texels = material.metallicRoughnessTexture.lookup(uv)
            roughness, metallic = roughness * texels[:, 0], metallic * texels[:, 1]
        if material.emissiveTexture is not None:
            emissive *= linear_from_srgb(material.emissiveTexture.lookup(uv)[:, :3])
        if material.occlusionTexture is not None:
            occlusion = material.occlusionTexture.lookup(uv)[:, 0]
    return {
        "base": base,
        "metallic": metallic,
        "roughness": roughness,
        "emissive": emissive,
        "occlusion": occlusion,
    }


def bent(normal: Floats, tangent: Floats, texels: Floats) -> Floats:
    """Returns normals [m, 3] modified by texels of a normal texture.

    The tangents [m, 3] point along increasing u.
    """
    across = _unit(tangent - normal * (normal * tangent).sum(axis=1, keepdims=True))
    local = 2 * texels[:, :3] - 1
    frame = np.stack([across, _unit(np.cross(normal, across)), normal], axis=1)
    return _unit(np.einsum("mk,mkj->mj", local, frame))


def _unit(vectors: Floats) -> Floats:
    return np.asarray(vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-30))


def turn_normals(normals: Floats, turn: Floats) -> Floats:
    """Returns the unit normals [n, 3] after the vertices are transformed by `turn`.

    `turn` is [3, 3] or [n, 3, 3], and may be singular: the normals are multiplied by its cofactors.
    """
    cofactors = np.stack(
        [np.cross(turn[..., (i + 1) % 3, :], turn[..., (i + 2) % 3, :]) for i in range(3)], axis=-2
    )
    sides = np.where(np.linalg.det(turn) < 0, -1.0, 1.0)[..., np.newaxis, np.newaxis]
    return _unit((sides * cofactors @ normals[:, :, np.newaxis])[:, :, 0])


def shade(at: Surfaces, lights: list[PlacedLight], ambient: Floats, shadow: Shadow | None) -> Floats:
    """The colours [m, 3] of lit points, with gamma."""
    rgb = at.base[:, :3]
    f0 = F0 * (1 - at.metallic[:, np.newaxis]) + rgb * at.metallic[:, np.newaxis]
    diffuse = rgb * ((1 - F0) * (1 - at.metallic))[:, np.newaxis] / np.pi
    alpha = np.maximum(at.roughness, 0.04) ** 2
    k = (np.maximum(at.roughness, 0.04) + 1) ** 2 / 8
    facing = np.clip(np.abs((at.normal * at.to_eye).sum(axis=1)), LEAST, 1)
    color = np.zeros_like(rgb)
    for placed in lights:
        to_light, radiance = _incoming(placed, at.position)
        half = to_light + at.to_eye
        half /= np.maximum(np.linalg.norm(half, axis=1, keepdims=True), 1e-30)
        lit = np.clip((at.normal * to_light).sum(axis=1), LEAST, 1)
        mirror = np.clip((at.normal * half).sum(axis=1), 0, 1)
        grazing = np.clip((at.to_eye * half).sum(axis=1), 0, 1)
        fresnel = f0 + (1 - f0) * ((1 - grazing) ** 5)[:, np.newaxis]
        shadowing = lit / (lit * (1 - k) + k) * (facing / (facing * (1 - k) + k))
        spread = alpha**2 / (np.pi * ((mirror**2) * (alpha**2 - 1) + 1) ** 2)
        specular = fresnel * (shadowing * spread / (4 * lit * facing + LEAST))[:, np.newaxis]
        if shadow is not None:
            radiance = np.where(shadow(placed, at.position)[:, np.newaxis], 0, radiance)
        color += lit[:, np.newaxis] * radiance * ((1 - fresnel) * diffuse + specular)
    color = (color + rgb * ambient) * at.occlusion[:, np.newaxis] + at.emissive
    return np.asarray(np.clip(color * at.vertex_color[:, :3], 0, None) ** GAMMA)


def _incoming(placed: PlacedLight, position: Floats) -> tuple[Floats, Floats]:
    """Unit directions to a light and its radiance, [m, 3] each."""
    light = placed.light
    strength = light.color.astype(np.float64) * light.intensity
    if isinstance(light, DirectionalLight):
        return np.broadcast_to(-placed.direction, position.shape), np.broadcast_to(strength, position.shape)
    offset = placed.position - position
    squared = np.maximum((offset**2).sum(axis=1, keepdims=True), 1e-30)
    to_light = offset / np.sqrt(squared)
    radiance: Any = strength / squared
    if isinstance(light, SpotLight):
        inner, outer = np.cos(light.innerConeAngle), np.cos(light.outerConeAngle)
        steep = 1 / max(LEAST, inner - outer)
        along = -(to_light @ placed.direction)
        radiance = radiance * (np.clip((along - outer) * steep, 0, 1) ** 2)[:, np.newaxis]
    return to_light, radiance
