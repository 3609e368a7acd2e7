"""The light that surfaces return to a lidar: pi f(d, d) cos(theta), mirrors and glass."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from ..arguments import Floats

if TYPE_CHECKING:
    from ..world import World

__all__ = ["Surface", "SurfaceTable", "dielectric_reflectance", "retroreflectance"]

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
    """See `f0`."""
    ior: float = 1.5
    """Index of refraction of glass."""
    extinction: float = 0.0
    """Imaginary part of the index, of mirrors made of metal."""
    thin: bool = False
    """True for glass without thickness, which does not bend light."""
    tinted: bool = False
    """True if the base colour multiplies a mirror's reflectance."""
    opacity: float = 1.0
    """The share of the surface that is there."""


class SurfaceTable:
    """The surfaces of a world by material number, read when a ray first meets them."""

    def __init__(self, world: World) -> None:
        self._world = world
        self._known: dict[int, Surface] = {}
        self.is_colored = False
        """True if some hit has a base colour that is not grey."""

    def note_colors(self, albedo: npt.NDArray[Any]) -> None:
        """Notes whether base colours [n, 3] of hits differ between their channels."""
        if not self.is_colored:
            self.is_colored = bool((albedo != albedo[:, :1]).any())

    def read(
        self, material: npt.NDArray[Any], instance: npt.NDArray[Any], triangle: npt.NDArray[Any]
    ) -> None:
        """Reads the surfaces of hits that have not been read yet; -1 means no hit."""
        numbers, first = np.unique(material, return_index=True)
        for number, at in zip(numbers.tolist(), first.tolist(), strict=True):
            if number >= 0 and number not in self._known:
                described = json.loads(self._world._core.material(int(instance[at]), int(triangle[at])))
                self._known[number] = read_surface(described)

    def column(self, material: npt.NDArray[Any], name: str) -> npt.NDArray[Any]:
        """Returns a property of the surface of each hit; the default of `Surface` for -1."""
        default = getattr(Surface("solid"), name)
        numbers, where = np.unique(material, return_inverse=True)
        values = [getattr(self._known[n], name) if n >= 0 else default for n in numbers.tolist()]
        found: npt.NDArray[Any] = np.array(values)[where]
        return found


def read_surface(material: dict[str, Any]) -> Surface:
    """Returns the surface of a material as JSON with the names of the core's `Material`."""
    model = material["model"]
    opacity = float(material["opacity"]) if material["alpha"] == "Blend" else 1.0
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
    # A smooth coat reflects away from the sensor: only a rough one returns light.
    alpha = rough * rough if rough > SMOOTH else 0.0
    return Surface("solid", diffuse=diffuse, alpha=alpha, f0=f0, metallic=metallic, opacity=opacity)


def _normal_reflectance(ior: float) -> float:
    return ((ior - 1.0) / (ior + 1.0)) ** 2


def retroreflectance(
    table: SurfaceTable, material: npt.NDArray[Any], albedo: Floats, cosine: Floats
) -> Floats:
    """Returns pi f(d, d) cos(theta) [n]: 1 for a diffuse white surface at normal incidence.

    `albedo` [n] is the base colour at the wavelength, `cosine` [n] the cosine of the angle of incidence. The lobes are
    Lafortune and Willems' modified Phong and GGX (Walter et al. 2007), with the half vector along the ray.
    """
    lambert = table.column(material, "diffuse") * albedo * cosine
    lobes = table.column(material, "phong").reshape(-1, 2) if len(material) else np.zeros((0, 2))
    doubled = np.clip(2.0 * cosine**2 - 1.0, 0.0, 1.0)  # between the ray and its mirror direction
    phong = lobes[:, 0] * (lobes[:, 1] + 2.0) / 2.0 * doubled ** lobes[:, 1] * cosine * (doubled > 0.0)
    alpha = table.column(material, "alpha")
    f0 = table.column(material, "f0") + table.column(material, "metallic") * albedo
    square = alpha**2
    spread = cosine**2 * (square - 1.0) + 1.0
    density = np.divide(square, spread**2, out=np.zeros_like(cosine), where=alpha > 0.0)
    tangent = np.divide(1.0 - cosine**2, cosine**2, out=np.full_like(cosine, np.inf), where=cosine > 0.0)
    masking = 1.0 / np.sqrt(1.0 + square * tangent)  # 1 / (1 + 2 lambda)
    rough = np.divide(f0 * density * masking, 4.0 * cosine, out=np.zeros_like(cosine), where=cosine > 1e-9)
    total: Floats = lambert + phong + rough
    return total


def dielectric_reflectance(cosine: Floats, ratio: Floats) -> Floats:
    """Returns the unpolarised Fresnel reflectance [n]; `ratio` is the index before the surface by that behind it."""
    sine2 = ratio**2 * (1.0 - cosine**2)
    total = sine2 >= 1.0
    inner = np.sqrt(np.where(total, 0.0, 1.0 - sine2))
    parallel = (cosine - ratio * inner) / (cosine + ratio * inner)
    across = (ratio * cosine - inner) / (ratio * cosine + inner)
    found: Floats = np.where(total, 1.0, (parallel**2 + across**2) / 2.0)
    return found


def conductor_reflectance(cosine: Floats, ior: Floats, extinction: Floats) -> Floats:
    """Returns the unpolarised Fresnel reflectance [n] of a metal. Source: Born and Wolf, section 14.2."""
    c2, s2 = cosine**2, 1.0 - cosine**2
    base = ior**2 - extinction**2 - s2
    root = np.sqrt(base**2 + 4.0 * ior**2 * extinction**2)
    a = np.sqrt(np.maximum(0.0, (root + base) / 2.0))
    across = (root + c2 - 2.0 * a * cosine) / (root + c2 + 2.0 * a * cosine)
    last = c2 * root + s2**2
    parallel = across * (last - 2.0 * a * cosine * s2) / (last + 2.0 * a * cosine * s2)
    found: Floats = (across + parallel) / 2.0
    return found
