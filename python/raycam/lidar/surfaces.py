"""The light that surfaces return to a lidar: pi f(d, d) cos(theta), mirrors and glass."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from .. import _core
from ..arguments import Floats

if TYPE_CHECKING:
    from ..world import World

__all__ = ["Surface", "SurfaceTable", "conductor_reflectance", "dielectric_reflectance"]

UNKNOWN = -2
"""Number of a surface that was not read yet."""
ENERGY_TERMS = (
    "diffuse",
    "phong",
    "alpha",
    "f0",
    "metallic",
    "opacity",
    "reflectance",
    "retroreflection",
    "retroreflection_table",
)
"""Properties of `Surface` that determine the returned energy."""
SMOOTH = 0.03
"""Largest roughness at which a surface is a mirror: it returns light only along its mirror direction."""


@dataclass(frozen=True)
class Surface:
    """The properties of a material at the laser's wavelength; colours are red channels."""

    kind: str
    """"solid", "mirror" or "glass"."""
    diffuse: float = 0.0
    """Factor of the base colour for the diffuse part."""
    phong: tuple[float, float] = (0.0, 0.0)
    """Albedo and exponent of the Phong lobe."""
    alpha: float = 0.0
    """GGX's alpha of the rough specular part; 0: none."""
    f0: float = 0.0
    """Reflectance of the rough specular part at normal incidence, plus `metallic` times the base colour."""
    metallic: float = 0.0
    """The share of the base colour that is added to `f0`, from 0 to 1."""
    ior: float = 1.5
    """Index of refraction of glass."""
    extinction: float = 0.0
    """Imaginary part of the index of refraction, for metal mirrors."""
    thin: bool = False
    """True for glass without thickness, which does not bend light."""
    tinted: bool = False
    """True if the base colour multiplies a mirror's reflectance."""
    opacity: float = 1.0
    """The opacity, from 0 to 1."""
    reflectance: float = math.nan
    """Diffuse reflectance at the wavelength, independent of the base colour; NaN: derived from the material."""
    textured: bool = False
    """True if a texture of the material contains the reflectance, which `reflectance` multiplies."""
    retroreflection: float = 0.0
    """Coefficient of retroreflection R_A at normal incidence, in cd/(lx m²)."""
    retroreflection_table: tuple[tuple[float, float], ...] = ()
    """Pairs of an angle of incidence in degrees and R_A, by ascending angle, instead of `retroreflection`."""


class SurfaceTable:
    """The surfaces of a world, read when a ray first meets them.

    There is one surface per material, and one per material and object if the object has values for lidars (`lidar` of
    `[[object]]`).
    """

    def __init__(self, world: World) -> None:
        self._world = world
        self._known: list[Surface] = []
        self._columns: dict[str, npt.NDArray[Any]] = {}
        self._uniform: dict[str, bool] = {}
        """By property: True if all surfaces that were read have the same value."""
        self._of_material = np.full(0, UNKNOWN, np.int64)
        self._of_own: dict[tuple[int, int], int] = {}
        self._own = {row[0]: row[1:] for row in _core.world_lidar_surfaces(world._core)}
        self._instances = np.array(sorted(self._own), np.int64)
        self.is_colored = False
        """True if any hit surface has a base colour other than grey."""

    def note_colors(
        self, surface: npt.NDArray[np.int64], albedo: npt.NDArray[Any], reflectance: npt.NDArray[Any] | None
    ) -> None:
        """Records whether the base colours [n, 3] from which reflectances derive are grey.

        `reflectance` [n] are the values of reflectance textures, NaN for surfaces without such a texture. It is None if
        no surface has such a texture.
        """
        if not self.is_colored:
            red, green, blue = albedo.T
            colored = np.flatnonzero((red != green) | (red != blue))
            own = np.isnan(self.column(surface[colored], "reflectance"))
            if reflectance is not None:
                own &= np.isnan(reflectance[colored])
            self.is_colored = bool(own.any())

    def read(
        self, material: npt.NDArray[Any], instance: npt.NDArray[Any], triangle: npt.NDArray[Any]
    ) -> npt.NDArray[np.int64]:
        """Reads the surfaces of new materials; returns each hit's surface number, -1 for no hit."""
        own = np.zeros(0, np.int64)
        if len(self._instances):
            place = np.minimum(np.searchsorted(self._instances, instance), len(self._instances) - 1)
            own = np.flatnonzero((self._instances[place] == instance) & (material >= 0))
        most = int(material.max(initial=-1))
        if most >= len(self._of_material) - 1:
            grown = np.full(most + 2, UNKNOWN, np.int64)
            grown[: len(self._of_material)] = self._of_material
            grown[-1] = -1  # the last entry is for material -1, a miss
            if len(self._of_material):
                grown[len(self._of_material) - 1] = UNKNOWN
            self._of_material = grown
        surface: npt.NDArray[np.int64] = self._of_material[material]
        surface[own] = -1
        new = np.flatnonzero(surface == UNKNOWN)
        for number, at in zip(*np.unique(material[new], return_index=True), strict=True):
            self._of_material[number] = self._add(self._described(instance, triangle, int(new[at])))
        surface[new] = self._of_material[material[new]]
        if len(own):
            pairs = np.stack([material[own], instance[own]], axis=1)
            kinds, first, where = np.unique(pairs, axis=0, return_index=True, return_inverse=True)
            for pair, at in zip(kinds.tolist(), own[first].tolist(), strict=True):
                key = (pair[0], pair[1])
                if key not in self._of_own:
                    found = self._described(instance, triangle, at)
                    self._of_own[key] = self._add(with_own(found, *self._own[pair[1]]))
            numbers = np.array([self._of_own[pair[0], pair[1]] for pair in kinds.tolist()])
            surface[own] = numbers[where.reshape(-1)]
        return surface

    def _described(self, instance: npt.NDArray[Any], triangle: npt.NDArray[Any], at: int) -> Surface:
        return read_surface(json.loads(self._world._core.material(int(instance[at]), int(triangle[at]))))

    def _add(self, surface: Surface) -> int:
        self._columns, self._uniform = {}, {}
        self._known.append(surface)
        return len(self._known) - 1

    @property
    def has_textures(self) -> bool:
        """True if a surface that was read has a texture of reflectances."""
        return any(surface.textured for surface in self._known)

    @property
    def is_opaque_and_rough(self) -> bool:
        """True if all surfaces that were read scatter light and none is translucent.

        Paths of light then end at the first surface.
        """
        return all(surface.kind == "solid" and surface.opacity == 1.0 for surface in self._known)

    def energy_terms(self) -> list[dict[str, Any]]:
        """Returns the properties that determine the returned energy, for each surface that was read."""
        return [{name: getattr(surface, name) for name in ENERGY_TERMS} for surface in self._known]

    def values(self, name: str) -> npt.NDArray[Any]:
        """Returns a property of all surfaces that were read, followed by the value for "no surface"."""
        if name not in self._columns:
            self._columns[name] = np.array([getattr(one, name) for one in (*self._known, Surface("solid"))])
        return self._columns[name]

    def column(self, surface: npt.NDArray[Any], name: str) -> npt.NDArray[Any]:
        """Returns a property of each hit's surface; the default of `Surface` for -1 (no hit)."""
        values = self.values(name)
        if name not in self._uniform:
            known = values[:-1]
            both_nan = (known != known) & (known[:1] != known[:1])
            self._uniform[name] = len(known) > 0 and bool(((known == known[:1]) | both_nan).all())
        if self._uniform[name] and not (surface < 0).any():
            return np.broadcast_to(values[0], (*surface.shape, *values.shape[1:]))
        return values.take(surface, axis=0)


def with_own(
    surface: Surface,
    reflectance: float | None,
    retroreflection: float | None,
    table: Sequence[Sequence[float]] | None,
) -> Surface:
    """Returns a surface with an object's own values for lidars.

    A mirror or glass surface with such values scatters light instead.
    """
    if reflectance is None and (retroreflection or table) and surface.kind != "solid":
        reflectance = 0.0
    if reflectance is not None:
        surface = Surface(
            "solid", reflectance=reflectance, opacity=surface.opacity, textured=surface.textured
        )
    pairs = tuple((float(angle), float(value)) for angle, value in table or ())
    return replace(surface, retroreflection=retroreflection or 0.0, retroreflection_table=pairs)


def read_surface(material: dict[str, Any]) -> Surface:
    """Returns the surface of a material, given as JSON data with the core's names (`Material`)."""
    model = material["model"]
    opacity = float(material["opacity"]) if material["alpha"] == "Blend" else 1.0
    if material.get("reflectance") is not None:
        return Surface("solid", diffuse=1.0, opacity=opacity, textured=True)
    if model == "Unlit":
        return Surface("solid", diffuse=1.0, opacity=opacity)
    (kind, values), *_ = model.items()
    if kind == "Phong":
        lobe = (float(values["specular"][0]), float(values["shininess"]))
        return Surface("solid", diffuse=float(values["diffuse"]), phong=lobe, opacity=opacity)
    if kind == "Metal":
        ior, extinction, rough = (
            float(values["ior"][0]),
            float(values["extinction"][0]),
            float(values["roughness"]),
        )
        if rough <= SMOOTH:
            return Surface("mirror", ior=ior, extinction=extinction, tinted=True, opacity=opacity)
        reflectance = conductor_reflectance(np.ones(1), np.array([ior]), np.array([extinction]))[0]
        return Surface("solid", alpha=rough * rough, f0=0.0, metallic=float(reflectance), opacity=opacity)
    if kind == "Glass":
        rough = float(values["roughness"])
        if rough <= SMOOTH:
            return Surface("glass", ior=float(values["ior"]), thin=bool(values["thin"]), opacity=opacity)
        return Surface(
            "solid", alpha=rough * rough, f0=_normal_reflectance(float(values["ior"])), opacity=opacity
        )
    return _principled(values, opacity)


def _principled(values: dict[str, Any], opacity: float) -> Surface:
    def value(name: str) -> float:
        found = values[name]
        return float(found["value"] if isinstance(found, dict) else found)

    metallic, rough, ior = value("metallic"), value("roughness"), value("ior")
    transmission = value("transmission")
    if rough <= SMOOTH and transmission > 0.5:
        return Surface("glass", ior=ior, thin=value("thickness") == 0.0, opacity=opacity)
    if rough <= SMOOTH and metallic > 0.5:
        return Surface("mirror", ior=0.0, tinted=True, opacity=opacity)
    f0 = _normal_reflectance(ior) * value("specular") * (1.0 - metallic)
    diffuse = (1.0 - metallic) * (1.0 - transmission)
    # A smooth coat reflects light away from the sensor; only a rough coat returns light.
    alpha = rough * rough if rough > SMOOTH else 0.0
    return Surface("solid", diffuse=diffuse, alpha=alpha, f0=f0, metallic=metallic, opacity=opacity)


def _normal_reflectance(ior: float) -> float:
    return ((ior - 1.0) / (ior + 1.0)) ** 2


def dielectric_reflectance(cosine: Floats, ratio: Floats) -> Floats:
    """Returns a dielectric's unpolarised Fresnel reflectance [n] at a `cosine` of incidence [n].

    `ratio` is the index of refraction in front of the surface divided by the index behind it.
    """
    sine2 = ratio**2 * (1.0 - cosine**2)
    total = sine2 >= 1.0
    inner = np.sqrt(np.where(total, 0.0, 1.0 - sine2))
    parallel = (cosine - ratio * inner) / (cosine + ratio * inner)
    across = (ratio * cosine - inner) / (ratio * cosine + inner)
    found: Floats = np.where(total, 1.0, (parallel**2 + across**2) / 2.0)
    return found


def conductor_reflectance(cosine: Floats, ior: Floats, extinction: Floats) -> Floats:
    """Returns a metal's unpolarised Fresnel reflectance [n] at a `cosine` of incidence [n].

    `ior` and `extinction` are the real and imaginary part of the index of refraction. Source: Born and Wolf, section
    14.2.
    """
    c2, s2 = cosine**2, 1.0 - cosine**2
    base = ior**2 - extinction**2 - s2
    root = np.sqrt(base**2 + 4.0 * ior**2 * extinction**2)
    a = np.sqrt(np.maximum(0.0, (root + base) / 2.0))
    across = (root + c2 - 2.0 * a * cosine) / (root + c2 + 2.0 * a * cosine)
    last = c2 * root + s2**2
    parallel = across * (last - 2.0 * a * cosine * s2) / (last + 2.0 * a * cosine * s2)
    found: Floats = (across + parallel) / 2.0
    return found
