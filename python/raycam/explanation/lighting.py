"""Computes the light of one pixel.

Each light has a shadow ray, a cosine, a diffuse term and a specular term, which are added up. The terms of
point lights and directional lights are closed forms. The sum is compared with the image.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..reference.units import Floats
from ..world import World
from .digits import number, srgb, vector
from .probe import Estimate, emitted, lit_world, only_light, radiance
from .steps import PixelSteps

__all__ = ["LightTerm", "Lighting", "Surface", "lighting", "material_of", "surface_at"]


@dataclass(frozen=True)
class Surface:
    """The surface point that a ray hits; directions are unit vectors."""

    object_name: str
    point: Floats
    """The position in the world, [3], metres."""
    normal: Floats
    """The geometric normal, [3], facing the viewer."""
    shading_normal: Floats
    """The shading normal, [3], facing the viewer."""
    to_eye: Floats
    """The direction back to the camera, [3]."""
    color: Floats
    """The base colour in linear RGB, [3]."""
    model: str
    """The reflection model: "phong", "unlit", "metal", "glass" or "principled"."""
    diffuse: float
    """The lecture's diffuse share; NaN for other models."""
    specular: Floats
    """The lecture's specular albedo, [3]; NaN for other models."""
    shininess: float
    """The lecture's Phong exponent; NaN for other models."""


@dataclass(frozen=True)
class LightTerm:
    """The contribution of a single light at the point. Radiances are [3], linear RGB, W/(m² sr)."""

    name: str
    """The type and the index of the light, such as "sun 0"."""
    to_light: Floats | None
    """The direction to the light, [3], of unit length; None for lights with an extent."""
    distance: float
    """The distance to the light, metres; +inf for a sun, NaN for lights with an extent."""
    irradiance: Floats
    """The irradiance of a surface that faces the light, [3], W/m²; NaN for lights with an extent."""
    cosine: float
    """The cosine between shading normal and light; NaN for lights with an extent."""
    blocker: str | None
    """The object that the shadow ray meets; None if the shadow ray meets no object, and for lights with an extent."""
    reach: float
    """The length of the shadow ray up to the light or the object, metres; NaN for lights with an extent."""
    diffuse: Floats
    """The closed form of the diffuse term; NaN if the material has no closed form."""
    specular: Floats
    """The closed form of the specular term; NaN if the material has none."""
    radiance: Floats
    """The light's contribution to the pixel: its radiance in an image with only this light."""
    error: float
    """The standard error of the luminance of `radiance`; 0 if all samples are equal."""

    @property
    def is_exact(self) -> bool:
        """True if the term is a closed form."""
        return bool(np.isfinite(self.diffuse).all())


@dataclass(frozen=True)
class Lighting:
    """The direct light of one pixel's centre ray, without indirect light.

    Radiances are in W/(m² sr).
    """

    surface: Surface | None
    """The visible point; None for a miss."""
    emission: Floats
    """The radiance that does not come from a light, [3]: the surface's emission, or the sky."""
    terms: tuple[LightTerm, ...]
    """The lights, followed by the emissive objects, if any."""
    total: Floats
    """The sum of emission and terms, [3]."""
    rendered: Estimate
    """The ray's radiance rendered with all lights at once and `integrator="direct"`, for comparison with `total`."""
    samples: int

    def __str__(self) -> str:
        """The steps with formulas and numbers, as text."""
        return "\n".join(_text(self))


def lighting(explanation: PixelSteps, samples: int = 256) -> Lighting:
    """Returns the direct light of an explained pixel.

    Lights with an extent use `samples` samples.
    """
    world = lit_world(explanation.world, explanation.camera)
    origin, direction = ray_of(explanation)
    surface = surface_at(world, origin, direction)
    emission = emitted(world, origin, direction)
    terms = []
    if surface is not None and surface.model != "unlit":
        for index, light in enumerate(world.lights):
            found = radiance(only_light(world, index), origin, direction, samples)
            terms.append(_term(world, surface, f"{light['type']} {index}", light, found, emission))
        found = radiance(only_light(world, None), origin, direction, samples)
        if found.value.max() > 1e-6 + emission.max() * (1 + 1e-4):
            terms.append(_extended("emissive objects", found, emission))
    return Lighting(
        surface=surface,
        emission=emission,
        terms=tuple(terms),
        total=np.sum([emission, *(each.radiance for each in terms)], axis=0),
        rendered=radiance(world, origin, direction, samples),
        samples=samples,
    )


def ray_of(explanation: PixelSteps) -> tuple[Floats, Floats]:
    """Start and unit direction of the pixel's ray, in the world."""
    units, r = explanation.units, explanation.r
    return units.origin + units.scale * explanation.C, r / np.linalg.norm(r)


def surface_at(world: World, origin: Floats, direction: Floats) -> Surface | None:
    """Returns the surface that a ray hits; None for a miss."""
    fields = ("t", "instance", "triangle", "position", "normal", "shading_normal", "albedo")
    hit = world.cast_rays(origin, direction, fields=fields, threads=1)
    if not np.isfinite(hit["t"]):
        return None
    side = -np.sign(float(hit["normal"] @ direction)) or 1.0
    material = material_of(world, int(hit["instance"]), int(hit["triangle"]))
    model, values = material["model"], material["values"]
    is_phong = model == "phong"
    return Surface(
        object_name=world.objects[int(hit["instance"])].name,
        point=np.asarray(hit["position"], np.float64),
        normal=side * np.asarray(hit["normal"], np.float64),
        shading_normal=side * np.asarray(hit["shading_normal"], np.float64),
        to_eye=-direction,
        color=np.asarray(hit["albedo"], np.float64),
        model=model,
        diffuse=values["diffuse"] if is_phong else np.nan,
        specular=np.array(values["specular"]) if is_phong else np.full(3, np.nan),
        shininess=values["shininess"] if is_phong else np.nan,
    )


def material_of(world: World, instance: int, triangle: int) -> dict[str, Any]:
    """Returns a triangle's material: `model` and `values`.

    The result also contains the fields that all materials have, whatever their model.
    """
    found: dict[str, Any] = json.loads(world._core.material(instance, triangle))
    model = found.pop("model")
    name, values = (model, {}) if isinstance(model, str) else next(iter(model.items()))
    return {**found, "model": name.lower(), "values": values}


def _extended(name: str, found: Estimate, emission: Floats) -> LightTerm:
    """The term of a light that has an extent."""
    unknown = np.full(3, np.nan)
    return LightTerm(
        name,
        None,
        np.nan,
        unknown,
        np.nan,
        None,
        np.nan,
        unknown,
        unknown,
        found.value - emission,
        found.error,
    )


def _term(
    world: World, surface: Surface, name: str, light: dict[str, Any], found: Estimate, emission: Floats
) -> LightTerm:
    """The term of a light."""
    delta = _delta(light, surface.point)
    if delta is None:
        return _extended(name, found, emission)
    to_light, distance, irradiance = delta
    cosine = float(surface.shading_normal @ to_light)
    diffuse = specular = np.full(3, np.nan)
    blocker, reach = None, distance
    is_lit = cosine > 0 and float(surface.normal @ to_light) > 0
    if is_lit:
        blocker, reach = _blocker(world, surface, to_light, distance)
    if surface.model == "phong":
        arrives = irradiance * max(cosine, 0.0) * float(is_lit and blocker is None)
        mirror = 2 * float(surface.shading_normal @ surface.to_eye) * surface.shading_normal - surface.to_eye
        lobe = max(float(mirror @ to_light), 0.0) ** surface.shininess
        diffuse = surface.diffuse * surface.color / np.pi * arrives
        specular = surface.specular * (surface.shininess + 2) / (2 * np.pi) * lobe * arrives
    return LightTerm(
        name=name,
        to_light=to_light,
        distance=distance,
        irradiance=irradiance,
        cosine=cosine,
        blocker=blocker,
        reach=reach,
        diffuse=diffuse,
        specular=specular,
        radiance=found.value - emission,
        error=found.error,
    )


def _delta(light: dict[str, Any], point: Floats) -> tuple[Floats, float, Floats] | None:
    """Returns the direction, distance and irradiance of a directional or point light.

    The irradiance is at normal incidence. The result is None for other lights.
    """
    kind = light["type"]
    if kind == "sun" and not light.get("angular_diameter"):
        way = -np.asarray(light["direction"], np.float64)
        return way / np.linalg.norm(way), np.inf, _rgb(light["irradiance"])
    if kind not in ("bulb", "point", "spot") or light.get("radius"):
        return None
    away = np.asarray(light["position"], np.float64) - point
    distance = float(np.linalg.norm(away))
    to_light = away / distance
    share, power_angle = 1.0, 4 * np.pi
    if kind == "spot":
        inner, outer = (float(np.cos(np.radians(light[name]))) for name in ("inner", "outer"))
        axis = np.asarray(light["direction"], np.float64)
        cosine = -float(to_light @ axis) / float(np.linalg.norm(axis))
        edge = (cosine - outer) / (inner - outer) if inner > outer else float(cosine >= inner)
        share = float(np.clip(edge, 0, 1)) ** 2
        power_angle = 2 * np.pi * (1 - inner + (inner - outer) / 3)
    intensity = _rgb(light["intensity"]) if "intensity" in light else _rgb(light["power"]) / power_angle
    return to_light, distance, share * intensity / distance**2


def _rgb(value: Any) -> Floats:
    return np.broadcast_to(np.asarray(value, np.float64), 3)


def _blocker(world: World, surface: Surface, to_light: Floats, distance: float) -> tuple[str | None, float]:
    """Returns the name and distance of the first object between a point and a light.

    Without such an object, the result is None and the light's distance.
    """
    size = float(np.abs(surface.point).max()) + 1.0
    start = surface.point + 1e-6 * size * surface.normal
    hit = world.cast_rays(start, to_light, t_max=distance, fields=("t", "instance"), threads=1)
    if not np.isfinite(hit["t"]):
        return None, distance
    return world.objects[int(hit["instance"])].name, float(hit["t"])


def _text(found: Lighting) -> Iterator[str]:
    """Yields the lines of `Lighting.__str__`."""
    yield "THE LIGHT OF THE PIXEL (integrator direct: light that comes straight from a lamp)"
    yield ""
    surface = found.surface
    if surface is None:
        yield f"   The ray meets no surface; the pixel shows the sky: {vector(found.emission)}"
        return
    yield f"   The point p               {vector(surface.point)} on {surface.object_name}"
    yield f"   n, the shading normal     {vector(surface.shading_normal)}"
    yield f"   w, back to the camera     {vector(surface.to_eye)}"
    yield f"   The base colour           {vector(surface.color)}, linear RGB"
    if surface.model == "phong":
        yield f"   diffuse share kd          {number(surface.diffuse)}"
        yield f"   specular albedo ks        {vector(surface.specular)}, exponent s = {number(surface.shininess)}"
        yield "   m = 2 (n·w) n - w, the mirror direction of w"
    else:
        yield f"   The material              {surface.model}"
    yield f"   Its own emission          {vector(found.emission)}"
    for term in found.terms:
        yield ""
        yield from _term_lines(term, surface)
    yield ""
    yield f"   Sum                       {vector(found.total)}, W/(m² sr)"
    spread = f" ± {number(found.rendered.error, 2)}" if found.rendered.error > 0 else ""
    yield f"   Rendered, all lights      {vector(found.rendered.value)}{spread}"
    yield f"   as sRGB bytes             {', '.join(map(str, srgb(found.rendered.value)))}"


def _term_lines(term: LightTerm, surface: Surface) -> Iterator[str]:
    """The text lines for one light."""
    yield f"   {term.name.upper()}"
    if term.to_light is None:
        spread = f" ± {number(term.error, 2)}" if term.error > 0 else ""
        yield "   has an area: the mean over shadow rays to random points on it"
        yield f"   contribution              {vector(term.radiance)}{spread}"
        return
    yield f"   l, to the light           {vector(term.to_light)}, {number(term.distance)} m"
    yield f"   E, facing it              {vector(term.irradiance)}, W/m²"
    yield f"   cosine n·l                {number(term.cosine)}"
    if term.cosine <= 0:
        yield "   The light is behind the surface: its contribution is 0."
        return
    seen = "meets no surface: lit" if term.blocker is None else f"meets {term.blocker}: in shadow"
    yield f"   the shadow ray            {seen}"
    if not term.is_exact:
        yield f"   contribution              {vector(term.radiance)}, by the formulas of {surface.model}"
        return
    yield f"   kd colour / π · E n·l     {vector(term.diffuse)}, diffuse"
    yield f"   ks (s+2)/2π (m·l)^s E n·l {vector(term.specular)}, specular"
    yield f"   contribution              {vector(term.diffuse + term.specular)}"
    if not np.allclose(term.diffuse + term.specular, term.radiance, rtol=1e-3, atol=1e-5):
        yield f"   rendered                  {vector(term.radiance)}: includes transparency and normal maps"
