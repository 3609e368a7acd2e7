"""Traces one light path from the camera.

The path contains its bounces, the light gathered at each bounce, and the path's contribution to the pixel.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..reference.units import Floats
from ..world import World
from .digits import number, vector
from .lighting import ray_of, surface_at
from .probe import emitted, facing_light, lit_world, only_light, radiance
from .steps import PixelSteps

__all__ = ["Bounce", "LightPath", "light_path"]

SAMPLES = 16


@dataclass(frozen=True)
class Bounce:
    """A point of the path."""

    point: Floats
    """The position in the world, [3], metres."""
    object_name: str
    """The object; "the sky" for the end of a path that leaves the world."""
    weight: Floats
    """The fraction [3] of the light that leaves this point along the path and reaches the pixel."""
    gathered: Floats
    """The radiance [3] that leaves this point along the path without another bounce, W/(m² sr): direct light, and at
    the first point emission. At later points, emission is omitted, because it is part of the previous point's direct
    light."""


@dataclass(frozen=True)
class LightPath:
    """One light path.

    The mean of `radiance` over many seeds is the value of the pixel with `integrator="path"`.
    """

    origin: Floats
    """The start of the ray, [3]."""
    bounces: tuple[Bounce, ...]
    seed: int

    @property
    def radiance(self) -> Floats:
        """The sum of weight times gathered light, [3], linear RGB, W/(m² sr)."""
        return np.asarray(sum((each.weight * each.gathered for each in self.bounces), np.zeros(3)))

    @property
    def points(self) -> Floats:
        """The vertices [n, 3] of the path, starting at the camera."""
        return np.array([self.origin, *(each.point for each in self.bounces)])

    def __str__(self) -> str:
        """The bounces as text."""
        return "\n".join(_text(self))


def light_path(explanation: PixelSteps, seed: int = 0, max_bounces: int = 5) -> LightPath:
    """Returns a path from an explained pixel with at most `max_bounces` points.

    `seed` selects the path's directions. Directions are sampled proportionally to the cosine with the normal
    (Lambert); a weight is then reflectance times π. The path ends at mirrors and glass, which have no such
    distribution.
    """
    world = lit_world(explanation.world, explanation.camera)
    dark = only_light(world, None)
    random = np.random.default_rng(seed)
    origin, direction = ray_of(explanation)
    start = origin
    weight, bounces = np.ones(3), []
    for index in range(max_bounces):
        surface = surface_at(world, origin, direction)
        emission = emitted(world, origin, direction)
        if surface is None:
            end = origin + direction * _far(world)
            bounces.append(Bounce(end, "the sky", weight, emission * (index == 0)))
            break
        lit = radiance(world, origin, direction, SAMPLES, seed=seed).value - (emission if index else 0)
        bounces.append(Bounce(surface.point, surface.object_name, weight, lit))
        towards = _cosine_direction(surface.shading_normal, random)
        if towards @ surface.normal <= 0:
            break
        begin = surface.point + 1e-6 * (np.abs(surface.point).max() + 1.0) * surface.normal
        reach = world.cast_rays(begin, towards, fields=("t",), threads=1)["t"]
        distance = 0.5 * min(float(reach), _far(world))
        probed = facing_light(dark, surface.point, towards, distance)
        cosine = float(towards @ surface.shading_normal)
        without = radiance(dark, origin, direction, 2, seed=seed).value
        # The radiance for a light with irradiance 1 from `towards`: the BSDF times the cosine.
        leaves = radiance(probed, origin, direction, 2, seed=seed).value - without
        weight = weight * np.maximum(leaves, 0) * np.pi / cosine
        if not weight.any():
            break
        origin, direction = begin, towards
    return LightPath(start, tuple(bounces), seed)


def _far(world: World) -> float:
    """The size of the world, metres."""
    bounds = world.bounds
    return 1.0 if bounds is None else float(np.linalg.norm(bounds[1] - bounds[0]))


def _cosine_direction(normal: Floats, random: np.random.Generator) -> Floats:
    """Returns a random direction [3] with the density cosine / π about a normal.

    The direction leads to a uniform point on a sphere that touches the surface.
    """
    z = random.uniform(-1, 1)
    angle = random.uniform(0, 2 * np.pi)
    ring = np.sqrt(1 - z * z)
    found = normal + np.array([ring * np.cos(angle), ring * np.sin(angle), z])
    return np.asarray(found / np.linalg.norm(found))


def _text(path: LightPath) -> Iterator[str]:
    """Yields the lines of `LightPath.__str__`."""
    yield f"ONE PATH OF LIGHT (seed {path.seed}): THE IMAGE IS THE MEAN OF MANY PATHS"
    yield ""
    yield "   Each direction is random, with a density proportional to its cosine with the normal. Each bounce"
    yield "   multiplies the weight by reflectance times π. A point adds its weight times its direct light."
    for index, each in enumerate(path.bounces):
        yield ""
        yield f"   {index + 1}. {each.object_name}"
        yield f"      at                     {vector(each.point)}"
        if index:
            way = float(np.linalg.norm(each.point - path.bounces[index - 1].point))
            yield f"      after                  {number(way)} m"
        yield f"      weight                 {vector(each.weight)}"
        yield f"      direct light           {vector(each.gathered)}"
        yield f"      contribution           {vector(each.weight * each.gathered)}"
    yield ""
    yield f"   Sum of this path         {vector(path.radiance)}, linear RGB, W/(m² sr)"
