"""Paths of light from the lidar to surfaces, including paths via mirrors and through glass."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from .. import _core
from ..arguments import Floats
from .surface_motion import surface_velocities, world_moves
from .surfaces import SurfaceTable, conductor_reflectance, dielectric_reflectance

if TYPE_CHECKING:
    from ..world import World

__all__ = ["HIT_FIELDS", "Contributions", "trace_paths"]

HIT_FIELDS = (
    "distance",
    "instance",
    "triangle",
    "category",
    "material",
    "normal",
    "front",
    "barycentric",
    "uv",
    "position",
    "albedo",
)
LEAST_ENERGY = 1e-4
"""A path ends if its share of the pulse's energy is below this value."""
NOTHING = -1
CLEARANCE = 1e-7
"""Distance in metres behind an interface within which hits, which are on neighbouring triangles, are ignored."""


COLUMNS = ("pulse", "ray", "length", "energy", "bounces", "first_instance", "drift", "arrival", "fogged")
"""Arrays of `Contributions` with one value per contribution, apart from `fields`."""


@dataclass
class Contributions:
    """The surfaces that return light: arrays with m rows, sorted by pulse and ray."""

    pulse: npt.NDArray[np.int64]
    ray: npt.NDArray[np.int64]
    """The sub-ray; 0 is the beam's axis."""
    length: Floats
    """Half the optical length of the path out and back, in metres."""
    energy: Floats
    """Returned energy, in units of a white target at normal incidence at 1 m."""
    bounces: npt.NDArray[np.int32]
    first_instance: npt.NDArray[np.int32]
    drift: Floats
    """Rate of change of `length` because the sensor, mirrors and glass move, in m/s."""
    arrival: Floats
    """Direction in which the light arrives at the surface, times the refractive index [m, 3]; 0 if nothing moves."""
    fogged: Floats
    """Half the length of the path in fog, in metres; half the optical length if the fog is everywhere."""
    fields: dict[str, npt.NDArray[Any]]
    """The fields of `World.cast_rays` of the surface, and "incidence" in degrees."""
    deflected: npt.NDArray[np.bool_]
    """True [pulses] if a path left the world after a mirror or glass, or ended after `max_bounces` interfaces."""

    def sorted(self) -> Contributions:
        """Returns the contributions ordered by pulse, ray, length and bounces."""
        step = np.diff(self.pulse)
        if ((step > 0) | ((step == 0) & (np.diff(self.ray) > 0))).all():
            return self
        order = np.lexsort((self.bounces, self.length, self.ray, self.pulse))
        columns: dict[str, Any] = {name: rows(getattr(self, name), order) for name in COLUMNS}
        fields = {name: rows(array, order) for name, array in self.fields.items()}
        return Contributions(**columns, fields=fields, deflected=self.deflected)

    @staticmethod
    def joined(parts: Sequence[Contributions], deflected: npt.NDArray[np.bool_]) -> Contributions:
        """Returns the contributions of all `parts`, in their order."""
        filled = [part for part in parts if len(part.pulse)]
        if len(filled) == 1:
            return replace(filled[0], deflected=deflected)
        columns: dict[str, Any] = {
            name: np.concatenate([getattr(part, name) for part in parts]) for name in COLUMNS
        }
        fields = {name: np.concatenate([part.fields[name] for part in parts]) for name in parts[0].fields}
        return Contributions(**columns, fields=fields, deflected=deflected)


def rows(array: npt.NDArray[Any], chosen: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Returns the rows `chosen` of an array.

    The function is optimised for repeated values and for rows of several numbers.
    """
    if len(array) and not array.strides[0]:  # the same value in all rows
        return np.broadcast_to(array[0], (len(chosen), *array.shape[1:]))
    return array.take(chosen, axis=0)


def _first_if_uniform(array: Floats) -> Floats:
    """Returns the array, or its first value [1] if the array repeats one value."""
    return array[:1] if len(array) and not array.strides[0] else array


@dataclass
class _Rays:
    """The rays after a given number of interfaces.

    `weight` is the share of the pulse's energy, `index` the medium's refractive index.
    """

    origins: Floats
    directions: Floats
    pulse: npt.NDArray[np.int64]
    ray: npt.NDArray[np.int64]
    weight: Floats
    one_way: Floats
    """Product of the shares at interfaces on the way out, which is also the product on the way back."""
    geometric: Floats
    optical: Floats
    index: Floats
    bounces: npt.NDArray[np.int32]
    first_instance: npt.NDArray[np.int32]
    drift: Floats
    """Rate of change of `optical` because the sensor and the interfaces on the way out move, in m/s."""
    fogged: Floats
    """The length of the way out in fog; `optical` if the fog is everywhere."""
    skip: npt.NDArray[np.int32]
    skip_triangle: npt.NDArray[np.int32]

    def take(self, chosen: npt.NDArray[Any]) -> _Rays:
        return _Rays(*(rows(getattr(self, name), chosen) for name in self.__dataclass_fields__))


def trace_paths(
    world: World,
    surfaces: SurfaceTable,
    origins: Floats,
    directions: Floats,
    weight: float,
    times: Floats | None,
    *,
    drift: Floats | None = None,
    fog_top: tuple[int, float] | None = None,
    max_bounces: int,
    threads: int | None,
) -> Contributions:
    """Returns the light that surfaces send back to n beams of k rays each.

    `origins` and `directions` are [n, k, 3]; `weight` is each ray's share of its pulse's energy.
    `times` [n] are the times of the beams (None: the world's time). `drift` [n, k] is the rate of change of distances
    along each ray because the sensor moves (default: 0). Fog is below the coordinate `fog_top[1]` of the axis
    `fog_top[0]` (default: everywhere). Each ray's path is a tree: at a smooth interface, the share F is reflected and
    1 - F is refracted (Fresnel). Each share is squared, because the light returns along the same path. Both branches
    are followed, up to `max_bounces` interfaces; no random numbers are used.
    """
    count, samples = origins.shape[:2]
    every = np.arange(count * samples)

    def constant(value: float, kind: type = float) -> npt.NDArray[Any]:
        return np.broadcast_to(np.asarray(value, kind), every.shape)

    ones, none = constant(1.0), constant(NOTHING, np.int32)
    rays = _Rays(
        origins.reshape(-1, 3),
        directions.reshape(-1, 3),
        every if samples == 1 else every // samples,
        constant(0, np.int64) if samples == 1 else every % samples,
        constant(weight),
        ones,
        constant(0.0),
        constant(0.0),
        ones,
        constant(0, np.int32),
        none,
        constant(0.0) if drift is None else drift.reshape(-1),
        constant(0.0),
        none,
        none,
    )
    parts: list[Contributions] = []
    deflected = np.zeros(count, bool)
    moves = times is not None and world_moves(world)
    has_textures = _core.world_has_reflectances(world._core)
    while len(rays.pulse):
        at_surface = bool((rays.skip >= 0).any())
        hits = world.cast_rays(
            rays.origins,
            rays.directions,
            times=None if times is None else rows(times, rays.pulse),
            t_min=np.where(rays.skip >= 0, CLEARANCE, 0.0) if at_surface else 0.0,
            skip=(rays.skip, rays.skip_triangle) if at_surface else None,
            fields=(*HIT_FIELDS, "reflectance") if has_textures else HIT_FIELDS,
            threads=threads,
        )
        missed = hits["instance"] < 0
        if missed.any():
            deflected[rays.pulse[missed & (rays.bounces > 0)]] = True
            met = np.flatnonzero(~missed)
            rays, hits = rays.take(met), {name: rows(array, met) for name, array in hits.items()}
        hits["surface"] = surfaces.read(hits["material"], hits["instance"], hits["triangle"])
        surfaces.note_colors(hits["surface"], hits["albedo"], hits.get("reflectance"))
        rays.first_instance = np.where(rays.first_instance < 0, hits["instance"], rays.first_instance)
        hits["fogged"] = rays.fogged + _length_in_fog(rays, hits, fog_top)
        part, cosine = _returned(surfaces, rays, hits, deflected, moves, threads)
        parts.append(part)
        velocities = _InterfaceVelocities(world, times, threads) if moves else None
        rays = _onward(surfaces, rays, hits, cosine, max_bounces, deflected, velocities)
    return Contributions.joined(parts, deflected).sorted()


@dataclass(frozen=True)
class _InterfaceVelocities:
    """The velocities of the points of mirrors and glass that rays meet in a moving world."""

    world: World
    times: Floats | None
    """The time of each pulse [n], in seconds after the world's time; None for the world's time."""
    threads: int | None

    def at(self, hits: dict[str, npt.NDArray[Any]], pulse: npt.NDArray[np.int64], chosen: Any) -> Floats:
        """Returns the velocities [m, 3] of the hits `chosen`, in m/s."""
        fields = {name: hits[name][chosen] for name in ("instance", "triangle", "barycentric")}
        times = None if self.times is None else self.times[pulse[chosen]]
        return surface_velocities(self.world, fields, times, self.threads)


def _length_in_fog(
    rays: _Rays, hits: dict[str, npt.NDArray[Any]], fog_top: tuple[int, float] | None
) -> Floats:
    """Returns the length [n] of each ray within fog, from the ray's start to its hit, in metres."""
    if fog_top is None:
        optical: Floats = hits["distance"] * rays.index
        return optical
    axis, height = fog_top
    start, end = rays.origins[:, axis], hits["position"][:, axis]
    low, high = np.minimum(start, end), np.maximum(start, end)
    span = np.where(high > low, high - low, 1.0)
    share = np.where(high > low, (np.clip(height, low, high) - low) / span, low <= height)
    inside: Floats = hits["distance"] * share
    return inside


def _returned(
    surfaces: SurfaceTable,
    rays: _Rays,
    hits: dict[str, npt.NDArray[Any]],
    deflected: npt.NDArray[np.bool_],
    moves: bool,
    threads: int | None,
) -> tuple[Contributions, Floats]:
    """Returns the scattering hits' contributions, and the cosines of incidence of all hits.

    Scattering hits are hits on surfaces that scatter light.
    """
    share = _first_if_uniform(rays.weight) * _first_if_uniform(rays.one_way) ** 2
    query = {
        "directions": np.ascontiguousarray(rays.directions),
        "normals": hits["normal"],
        "albedos": hits["albedo"],
        "reflectances": hits.get("reflectance"),
        "materials": hits["surface"],
        "lengths": rays.geometric + hits["distance"],
        "shares": share,
        "threads": threads,
    }
    cosine, incidence, energy = _core.lidar_returned_light(query, surfaces.energy_terms())
    optical = rays.optical + hits["distance"] * rays.index
    fields = {name: hits[name] for name in HIT_FIELDS if name not in ("albedo", "distance")}
    fields["incidence"] = incidence
    columns: tuple[npt.NDArray[Any], ...] = (
        rays.pulse,
        rays.ray,
        optical,
        energy,
        rays.bounces,
        rays.first_instance,
        rays.drift,
        rays.directions * rays.index[:, None] if moves else np.broadcast_to(np.zeros(3), (len(cosine), 3)),
        hits["fogged"],
    )
    if not surfaces.is_opaque_and_rough:
        chosen = np.flatnonzero(surfaces.column(hits["surface"], "kind") == "solid")
        columns = tuple(rows(column, chosen) for column in columns)
        fields = {name: rows(array, chosen) for name, array in fields.items()}
    named: dict[str, Any] = dict(zip(COLUMNS, columns, strict=True))
    return Contributions(**named, fields=fields, deflected=deflected), cosine


def _onward(
    surfaces: SurfaceTable,
    rays: _Rays,
    hits: dict[str, npt.NDArray[Any]],
    cosine: Floats,
    max_bounces: int,
    deflected: npt.NDArray[np.bool_],
    velocities: _InterfaceVelocities | None,
) -> _Rays:
    """Returns the continued rays: behind translucent surfaces, reflected, and refracted."""
    if not len(cosine):
        return rays
    if surfaces.is_opaque_and_rough:
        return rays.take(np.zeros(0, np.int64))
    kind = surfaces.column(hits["surface"], "kind")
    opacity = surfaces.column(hits["surface"], "opacity")
    geometric = rays.geometric + hits["distance"]
    optical = rays.optical + hits["distance"] * rays.index
    smooth = kind != "solid"
    ended = smooth & (rays.bounces >= max_bounces)
    deflected[rays.pulse[ended]] = True

    def follow(
        chosen: npt.NDArray[Any], directions: Floats, share: Floats, index: Floats, bounce: int
    ) -> _Rays:
        after = rays.take(chosen)
        after.origins, after.directions = hits["position"][chosen], directions
        after.one_way = after.one_way * share
        after.geometric, after.optical, after.index = geometric[chosen], optical[chosen], index
        after.fogged = hits["fogged"][chosen]
        after.bounces = (after.bounces + bounce).astype(np.int32)
        after.skip, after.skip_triangle = hits["instance"][chosen], hits["triangle"][chosen]
        return after

    through = np.flatnonzero((opacity < 1.0) & ~smooth)
    clear = 1.0 - opacity[through]
    branches = [follow(through, rays.directions[through], clear, rays.index[through], 0)]
    at = np.flatnonzero(smooth & ~ended)
    if len(at):
        interfaces = _at_interface(surfaces, rays, hits, cosine, at, follow)
        if velocities is not None:
            _add_interface_motion(rays, interfaces, velocities.at(hits, rays.pulse, at), at)
        branches += [branch for branch, _ in interfaces]
    joined = _Rays(
        *(
            np.concatenate([getattr(branch, name) for branch in branches])
            for name in _Rays.__dataclass_fields__
        )
    )
    return joined.take(np.flatnonzero(joined.one_way**2 >= LEAST_ENERGY))


def _add_interface_motion(
    rays: _Rays, interfaces: list[tuple[_Rays, npt.NDArray[Any]]], velocity: Floats, at: npt.NDArray[Any]
) -> None:
    """Adds the rate caused by the motion of each branch's mirror or glass to the branch's drift."""
    for branch, own in interfaces:
        before = rays.index[at[own], None] * rays.directions[at[own]]
        bend = before - branch.index[:, None] * branch.directions
        branch.drift = branch.drift + (velocity[own] * bend).sum(axis=1)


def _at_interface(
    surfaces: SurfaceTable,
    rays: _Rays,
    hits: dict[str, npt.NDArray[Any]],
    cosine: Floats,
    at: npt.NDArray[Any],
    follow: Any,
) -> list[tuple[_Rays, npt.NDArray[Any]]]:
    """Returns the reflected and the refracted branch of the rays `at` smooth surfaces.

    Each branch is returned with its rows of `at`.
    """
    material, c = hits["surface"][at], cosine[at]
    kind = surfaces.column(material, "kind")
    ior, thin = surfaces.column(material, "ior").astype(float), surfaces.column(material, "thin")
    tint = np.where(surfaces.column(material, "tinted"), hits["albedo"][at, 0].astype(float), 1.0)
    incoming, normal = rays.directions[at], hits["normal"][at]
    mirrored = incoming + 2.0 * c[:, None] * normal
    leaving = rays.index[at] > 1.0
    behind = np.where(leaving, 1.0, ior)
    ratio = np.where(thin, 1.0, rays.index[at] / behind)
    glass = kind == "glass"
    single = dielectric_reflectance(c, np.where(thin, 1.0 / ior, ratio))
    # Between the faces of a thin pane, light is reflected repeatedly: R + T² R / (1 - R²) = 2 R / (1 + R).
    dielectric = np.where(thin, 2.0 * single / (1.0 + single), single)
    extinction = surfaces.column(material, "extinction").astype(float)
    metal = np.where(ior > 0.0, conductor_reflectance(c, np.maximum(ior, 1e-9), extinction), 1.0)
    reflectance = np.where(glass, dielectric, metal * tint)
    reflected = follow(at, mirrored, reflectance, rays.index[at], 1)
    passing = np.flatnonzero(glass & (reflectance < 1.0))
    eta, cos_in, way, out = ratio[passing], c[passing], incoming[passing], normal[passing]
    cos_out = np.sqrt(np.maximum(0.0, 1.0 - eta**2 * (1.0 - cos_in**2)))
    bent = eta[:, None] * way + (eta * cos_in - cos_out)[:, None] * out
    index = np.where(thin[passing], rays.index[at][passing], behind[passing])
    refracted = follow(at[passing], bent, 1.0 - reflectance[passing], index, 1)
    return [(reflected, np.arange(len(at))), (refracted, passing)]
