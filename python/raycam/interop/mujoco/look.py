"""MuJoCo's own light: OpenGL's fixed pipeline with shadows, evaluated at exact hits.

Sources: OpenGL 2.1 specification, sections 2.14.1 (lighting) and 3.8.13 (texture environments); MuJoCo's
documentation, chapter Visualization. Sums are formed and clamped in sRGB, as MuJoCo does. Differences: light is
computed at every pixel instead of every vertex, and shadows are exact instead of from a shadow map.
"""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass
from functools import partial
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from ...arguments import Floats
from ...camera import Camera
from ...errors import SettingsError
from ...world import World
from .atmosphere import Atmosphere
from .cube_map import sample_cube_map
from .layers import BEHIND, blend_layers, blending_order, find_layers, planes_behind
from .light_model import Light, MujocoLights
from .model import DIRECTIONAL
from .surfaces import Surfaces
from .textures import skybox_faces

__all__ = ["DEFAULT_FLAGS", "MujocoLook", "pixel_angle"]

Single = npt.NDArray[np.float32]
FIELDS = ("t", "position", "shading_normal", "normal", "instance", "triangle", "uv")
DEFAULT_FLAGS = (1, 0, 1, 0, 1, 0, 1, 0, 0, 0, 1, 1)
"""The initial values of `mjvScene.flags`, by `mjtRndFlag`."""
SHADOW, WIREFRAME, REFLECTION, ADDITIVE, SKYBOX, FOG, HAZE, DEPTH, SEGMENT = range(9)
"""Values of `mjtRndFlag`."""
UNSUPPORTED_FLAGS = {
    WIREFRAME: "mjRND_WIREFRAME",
    ADDITIVE: "mjRND_ADDITIVE",
    DEPTH: "mjRND_DEPTH",
    SEGMENT: "mjRND_SEGMENT",
}
SHADOW_FIELDS = ("position", "normal", "instance", "triangle")
NO_LIGHT = 0.3
"""The ambient light of models without any light (`mjr_render`)."""
BIAS = 1e-4
"""The distance between a surface and the start of its shadow rays, as a share of the model's extent."""
CORNERS = np.array([[-0.125, -0.375], [0.375, -0.125], [-0.375, 0.125], [0.125, 0.375]])
"""Offsets of the four samples in a pixel: a rotated grid."""
EDGE = 0.1
"""Pixels whose colour differs from a neighbour's colour by more than this value get four samples."""


@dataclass(frozen=True)
class _View:
    """The camera, lights and flags of one image, and values computed from them."""

    camera: Camera
    lights: list[Light]
    """The model's lights and the headlight."""
    pixel: float
    """The angle between neighbouring pixels in the middle of the image, in radians."""
    flags: list[bool]
    """The flags of the scene, indexed by MuJoCo's `mjtRndFlag`."""
    order: list[int]
    """The transparent objects and the planes that are viewed from behind, in the order of blending."""
    behind: list[int]
    """The planes that are viewed from behind."""


class MujocoLook:
    """Computes images of a model's world in MuJoCo's own light."""

    def __init__(self, model: Any, world: World, surfaces: Surfaces, elements: list[tuple[int, int]]) -> None:
        self._model, self._world, self._surfaces, self._elements = model, world, surfaces, elements
        self._skybox = skybox_faces(model)
        self._atmosphere = Atmosphere(model, elements)

    def for_world(self, world: World, surfaces: Surfaces, elements: list[tuple[int, int]]) -> MujocoLook:
        """Returns the look of the same model for another world, with its surfaces and elements."""
        found = copy(self)
        found._world, found._surfaces, found._elements = world, surfaces, elements
        return found

    def image(
        self,
        camera: Camera,
        lights: MujocoLights,
        *,
        samples: int = 4,
        flags: npt.NDArray[np.uint8] | None = None,
    ) -> npt.NDArray[np.uint8]:
        """Returns sRGB colours, uint8 [h, w, 3].

        With `samples=4`, edges are antialiased by four samples per pixel. `flags` are those of `mjvScene`
        (default: `DEFAULT_FLAGS`). Raises `SettingsError` for flags without support.
        """
        width, height = camera.size
        v, u = np.mgrid[:height, :width] + 0.5 + camera.corner
        pixels = np.stack([u.ravel(), v.ravel()], axis=1)
        view = self._view(camera, lights, DEFAULT_FLAGS if flags is None else flags)
        colors = self._colors(view, pixels)
        if samples > 1:
            edges = _edges(colors.reshape(height, width, 3))
            places = (pixels[edges][:, None] + CORNERS).reshape(-1, 2)
            if len(places):
                colors[edges] = self._colors(view, places).reshape(-1, len(CORNERS), 3).mean(axis=1)
        return np.round(255 * colors).astype(np.uint8).reshape(height, width, 3)

    def _view(self, camera: Camera, lights: MujocoLights, flags: Any) -> _View:
        chosen = [bool(flag) for flag in flags]
        for flag, name in UNSUPPORTED_FLAGS.items():
            if chosen[flag]:
                raise SettingsError(f"scene.flags: {name} is not supported", code="unsupported_feature")
        behind = planes_behind(self._model, self._world, self._elements, camera.C)
        blended = [*(each for each in self._surfaces.transparent if each not in behind), *behind]
        order = blending_order(self._model, self._world, self._elements, blended, camera.C)
        return _View(camera, lights.seen_from(camera), pixel_angle(camera), chosen, order, behind)

    def _colors(self, view: _View, pixels: Floats) -> Single:
        """The sRGB colours [n, 3] at pixel positions [n, 2]."""
        origins, directions = view.camera.rays(pixels)
        colors = np.zeros((len(directions), 3), np.float32)
        sky_shown = self._skybox is not None and view.flags[SKYBOX]
        limits = self._atmosphere.limits(directions, view.camera.R[2], sky_shown)
        hit = np.zeros(len(directions), bool)
        distances = limits.copy()
        if self._surfaces.opaque:
            hits = self._cast(origins, directions, self._surfaces.opaque)
            hit = (hits["instance"] >= 0) & (hits["t"] <= limits)
            distances[hit] = hits["t"][hit]
            chosen = hits if hit.all() else {name: value[hit] for name, value in hits.items()}
            if view.flags[FOG]:
                chosen["depth"] = chosen["distance"] * (directions[hit] @ view.camera.R[2])
            shadows = view.flags[SHADOW]
            colors[hit] = self._light(chosen, directions[hit], view, shadows=shadows)
            if self._surfaces.mirror is not None and view.flags[REFLECTION]:
                colors[hit] += self._reflection(chosen, directions[hit], view)
                np.minimum(colors, 1, out=colors)
        if sky_shown:
            self._add_sky(colors, directions, limits, ~hit & np.isfinite(directions).all(axis=1), view)
            if view.flags[HAZE] and self._atmosphere.ground is not None:
                matrix = self._world.objects[self._atmosphere.ground].matrix
                up = matrix[:3, 2] / np.linalg.norm(matrix[:3, 2])
                height = (view.camera.C - matrix[:3, 3]) @ up
                along = directions @ view.camera.R[2] if view.flags[FOG] else None
                self._atmosphere.blend_haze(colors, directions, distances, height, up, along)
        self._blend(colors, origins, directions, distances, view)
        return colors

    def _add_sky(
        self, colors: Single, directions: Floats, limits: Floats, sky: npt.NDArray[np.bool_], view: _View
    ) -> None:
        """Sets the colours of rays [n] that meet the skybox."""
        assert self._skybox is not None
        x, y, z = directions[sky].T
        found = sample_cube_map(self._skybox, np.stack([x, z, -y], axis=1))
        if view.flags[FOG]:
            found = self._atmosphere.fogged(found, limits[sky] * (directions[sky] @ view.camera.R[2]))
        colors[sky] = found

    def _cast(
        self,
        origins: Floats,
        directions: Floats,
        objects: list[int],
        t_min: Floats | float = 0.0,
        t_max: Floats | float = np.inf,
        facing: Literal["front", "back"] = "front",
    ) -> dict[str, Any]:
        """Returns the nearest hits on front faces, or for planes on both sides, as MuJoCo draws.

        Directions are unit vectors, so that `t` is the distance.
        """
        chosen = None if len(objects) == len(self._elements) else objects
        hits = self._world.cast_rays(
            origins, directions, t_min=t_min, t_max=t_max, facing=facing, fields=FIELDS, objects=chosen
        )
        return hits | {"distance": hits["t"]}

    def _blend(
        self,
        colors: Single,
        origins: Floats,
        directions: Floats,
        limits: Floats,
        view: _View,
        *,
        strength: float = 1.0,
        travelled: Floats | None = None,
        along: Floats | None = None,
    ) -> None:
        """Blends the transparent surfaces nearer than `limits` [n] over the colours [n, 3].

        For reflected rays, `travelled` [n] is the distance from the camera to the rays' starts, and `along` [n] the
        depth per distance.
        """
        transparent = [each for each in self._surfaces.transparent if each in view.order]
        found = find_layers(self._cast, origins, directions, limits, transparent)
        if view.behind and travelled is None:
            back = partial(self._cast, facing="back")
            found += find_layers(back, origins, directions, limits, view.behind)
        if not found:
            return
        along = directions @ view.camera.R[2] if along is None else along
        layers = []
        for hits in found:
            rays, instance = hits["ray"], hits["instance"]
            if travelled is not None:
                hits["distance"] = hits["distance"] + travelled[rays]
            hits["depth"] = hits["distance"] * along[rays]
            behind = np.isin(instance, view.behind)
            # The normal of a plane seen from behind points away, so that only light from its front is visible.
            hits["shading_normal"] = np.where(behind[:, None], -1, 1) * hits["shading_normal"]
            front = self._light(hits, directions[rays], view, shadows=False, strength=strength)
            alpha = self._surfaces.alpha[instance] * np.where(behind, np.float32(BEHIND), np.float32(1))
            layers.append((hits, front, np.asarray(alpha, np.float32)))
        blend_layers(colors, layers, view.order)

    def _reflection(self, hits: dict[str, Any], directions: Floats, view: _View) -> Single:
        """Returns the colours that the reflecting plane or box top mirrors at hits [n, 3].

        Mirrored objects have no shadows, as in MuJoCo.
        """
        assert self._surfaces.mirror is not None
        number, strength = self._surfaces.mirror
        colors = np.zeros((len(directions), 3), np.float32)
        matrix = self._world.objects[number].matrix
        up = matrix[:3, 2] / np.linalg.norm(matrix[:3, 2])
        shown = (hits["instance"] == number) & (hits["normal"] @ up > 0.999)
        others = [each for each in self._surfaces.opaque if each != number]
        if not shown.any():
            return colors
        start, incoming, travelled = (
            array[shown] for array in (hits["position"], directions, hits["distance"])
        )
        reflected = incoming - 2 * (incoming @ up)[:, None] * up
        light = np.zeros((len(incoming), 3), np.float32)
        limits, along = np.full(len(incoming), np.inf), incoming @ view.camera.R[2]
        if others:
            seen = self._cast(start, reflected, others)
            met = seen["instance"] >= 0
            limits[met] = seen["t"][met]
            chosen = {name: value[met] for name, value in seen.items()}
            chosen["distance"] = chosen["distance"] + travelled[met]
            chosen["depth"] = chosen["distance"] * along[met]
            light[met] = self._light(chosen, reflected[met], view, shadows=False, strength=strength)
        self._blend(
            light, start, reflected, limits, view, strength=strength, travelled=travelled, along=along
        )
        colors[shown] = light
        return colors

    def _light(
        self,
        hits: dict[str, Any],
        directions: Floats,
        view: _View,
        *,
        shadows: bool,
        strength: float = 1.0,
    ) -> Single:
        """Returns the light [n, 3] from hits towards the rays' origins.

        `strength` scales the colour of the surface.
        """
        instance, normal = hits["instance"], hits["shading_normal"].astype(np.float32)
        to_camera = -directions.astype(np.float32)
        color = strength * self._surfaces.colors(instance)
        ambient = np.float32(0.0 if view.lights else NO_LIGHT)
        plain = color * (self._surfaces.emission[instance][:, None] + ambient)
        shadowed = np.zeros_like(plain)
        for light in view.lights:
            one = self._one_light(light, hits, normal, to_camera, color)
            if shadows and light.shadow:
                lit = np.flatnonzero(one.any(axis=1))
                lit = lit[~self._shadowed(light, {name: hits[name][lit] for name in SHADOW_FIELDS})]
                shadowed[lit] += np.minimum(one[lit], 1)
            else:
                plain += one
        total = shadowed + np.minimum(plain, 1)
        if self._surfaces.unlit is not None:
            # MuJoCo adds the plain colour once, and once more for each light that casts shadows.
            passes = 1 + sum(shadows and light.shadow for light in view.lights)
            total = np.where(self._surfaces.unlit[instance][:, None], passes * color, total)
        facing = np.maximum(abs(np.einsum("nc,nc->n", hits["normal"], directions)), 0.05)
        footprint = (view.pixel * hits["distance"] / facing).astype(np.float32)
        factors = self._surfaces.texture_factors(hits, footprint)
        found = np.asarray(np.minimum(total if factors is None else total * factors, 1), np.float32)
        return self._atmosphere.fogged(found, hits["depth"]) if view.flags[FOG] else found

    def _one_light(
        self, light: Light, hits: dict[str, Any], normal: Single, to_camera: Single, color: Single
    ) -> Single:
        """The light [n, 3] that surfaces of a colour [n, 3] reflect from one light, without shadow."""
        towards, fade = _towards(light, hits["position"])
        cosine = np.maximum(np.einsum("nc,nc->n", normal, towards), 0)
        half = towards + to_camera
        half /= np.maximum(_lengths(half), 1e-12)[:, None]
        aligned = np.maximum(np.einsum("nc,nc->n", normal, half), 0)
        instance = hits["instance"]
        gloss = self._surfaces.specular[instance] * np.power(aligned, self._surfaces.exponent[instance])
        gloss *= cosine > 0
        diffuse = light.ambient.astype(np.float32) + cosine[:, None] * light.diffuse.astype(np.float32)
        specular = gloss[:, None] * light.specular.astype(np.float32)
        return np.asarray(fade[:, None] * (color * diffuse + specular), np.float32)

    def _shadowed(self, light: Light, hits: dict[str, Any]) -> npt.NDArray[np.bool_]:
        """True [n] where another surface hides the light."""
        start = hits["position"] + BIAS * float(self._model.stat.extent) * hits["normal"]
        if light.kind == DIRECTIONAL:
            towards, end = np.broadcast_to(-light.direction, start.shape), np.inf
        else:
            towards, end = light.position - start, 1.0
        skip = (hits["instance"], hits["triangle"])
        objects = None
        if self._surfaces.shadowless:
            objects = [i for i in range(len(self._elements)) if i not in self._surfaces.shadowless]
        return self._world.occluded(start, towards, end, skip=skip, objects=objects)


def pixel_angle(camera: Camera) -> float:
    """Returns the angle between neighbouring pixels in the middle of the image, in radians.

    The angle is 0 if these pixels have no rays.
    """
    width, height = camera.size
    middle = np.array([[width / 2, height / 2], [width / 2 + 1, height / 2]]) + camera.corner
    _, (first, second) = camera.rays(middle)
    return float(np.nan_to_num(np.linalg.norm(second - first)))


def _towards(light: Light, position: Floats) -> tuple[Single, Single]:
    """Returns the unit directions [n, 3] to a light, and its remaining strength [n].

    The remaining strength is the fraction of the light's strength after attenuation by the distance and by the
    light's cone.
    """
    if light.kind == DIRECTIONAL:
        towards = np.broadcast_to(-light.direction / np.linalg.norm(light.direction), position.shape)
        return towards.astype(np.float32), np.ones(len(position), np.float32)
    towards = (light.position - position).astype(np.float32)
    distance = _lengths(towards)
    towards /= np.maximum(distance, 1e-12)[:, None]
    constant, linear, quadratic = light.attenuation
    fade = 1 / np.maximum(constant + linear * distance + quadratic * distance**2, 1e-12)
    along = -(towards @ (light.direction / np.linalg.norm(light.direction)).astype(np.float32))
    inside = along >= np.cos(np.radians(light.cutoff))
    cone = np.where(inside, np.power(np.maximum(along, 0), light.exponent), 0)
    return towards, (fade * cone).astype(np.float32)


def _lengths(vectors: Single) -> Single:
    """The lengths [n] of vectors [n, 3]."""
    return np.asarray(np.sqrt(np.einsum("nc,nc->n", vectors, vectors)), np.float32)


def _edges(colors: Single) -> npt.NDArray[np.bool_]:
    """True [h * w] for pixels that differ from a neighbour."""
    edges = np.zeros(colors.shape[:2], bool)
    for axis in (0, 1):
        step = abs(np.diff(colors, axis=axis)).max(axis=2) > EDGE
        before, after = ((slice(None, -1), slice(None)), (slice(1, None), slice(None)))
        if axis == 1:
            before, after = before[::-1], after[::-1]
        edges[before] |= step
        edges[after] |= step
    return edges.ravel()
