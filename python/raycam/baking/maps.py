"""Maps of a surface: ambient occlusion, positions, normals and ids, in textures."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from .. import _core
from ..arguments import Bools, Floats, real, thread_count, whole, words
from ..errors import Notice, SettingsError, WorldError
from ..io.atomic_files import write
from ..notices import warn
from ..one_line import one_line
from ..render.arguments import world_of
from ..world import World
from ..world.chosen import object_number
from ..world.face_geometry import face_normals
from ..world.object_mesh import ObjectMesh, object_mesh
from .atlas import Atlas, mesh_with_atlas
from .gutters import fill_gutters
from .hemisphere import hemisphere_directions
from .surface_points import SurfacePoints, transfer
from .tangents import corner_tangents, tangent_space_normals
from .texels import Texels, covered_texels, find_texels, warn_of_overlap

__all__ = ["MAPS", "BakedMaps", "bake"]

MAPS = (
    *("position", "normal", "shading_normal", "tangent_normal", "ao", "bent_normal", "thickness"),
    *("albedo", "instance", "triangle"),
)
"""The maps that `bake` supports."""
SCALARS = ("ao", "thickness", "instance", "triangle")
"""Maps with one value for each texel."""
DEFAULT_CAGE = 0.02
"""Distance within which a source is looked for, relative to the diagonal of the object's bounds."""
RELATIVE_ROUNDING = 8 * float(np.finfo(np.float64).eps)
"""Rounding error of a surface point relative to its largest coordinate; rays start at this distance."""
CHUNK_TEXELS = 1 << 17
"""Number of texels processed at a time."""


@one_line
@dataclass(frozen=True, eq=False)
class BakedMaps(Mapping[str, npt.NDArray[Any]]):
    """The result of `bake`: an object's maps by name, arrays [h, w] or [h, w, 3], and the covered texels."""

    maps: dict[str, npt.NDArray[Any]] = field(repr=False)
    """The arrays by name."""
    covered: Bools = field(repr=False)
    """True [h, w] for texels whose centre is inside a face; False in gutters."""
    overlapping: int
    """The number of texels that are inside several faces."""
    missed: Bools = field(repr=False)
    """True [h, w] for texels without a surface of the source, which have the object's own values."""

    def __getitem__(self, name: str) -> npt.NDArray[Any]:
        """The map of this name."""
        return self.maps[name]

    def __iter__(self) -> Any:
        """Iterates over the names."""
        return iter(self.maps)

    def __len__(self) -> int:
        """The number of maps."""
        return len(self.maps)

    def save(self, folder: str | os.PathLike[str]) -> list[Path]:
        """Writes each map as NAME.exr, and ao.png with 16 bits, into a folder; returns the paths."""
        target = Path(folder)
        target.mkdir(parents=True, exist_ok=True)
        made = []
        for name, values in self.maps.items():
            if name in ("ao", "tangent_normal"):
                shares = values if name == "ao" else (values + 1) / 2
                data = _core.encode_png(np.rint(np.clip(shares, 0, 1) * 65535).astype(np.uint16))
            else:
                data = _core.encode_exr([(name, np.ascontiguousarray(values))], False, None, [])
            path = target / f"{name}.{'png' if name in ('ao', 'tangent_normal') else 'exr'}"
            write(path, bytes(data))
            made.append(path)
        return made


def bake(
    world: World,
    maps: Sequence[str] | str = ("ao",),
    *,
    object: int | str = 0,
    size: int = 1024,
    uv_set: int = 0,
    source: World | str | os.PathLike[str] | None = None,
    cage: float | None = None,
    atlas: Atlas | None = None,
    samples: int = 64,
    distance: float = np.inf,
    threads: int | None = None,
) -> BakedMaps:
    """Bakes maps of an object, by id or name, into textures of `size` x `size` texels by its texture coordinates.

    Each texel's values belong to the surface point at its centre. All objects of the world occlude.

    ============== ========= =======================================================================================
    position       float32   the point in the world, metres
    normal         float32   the face's unit normal in the world
    shading_normal float32   the interpolated unit normal in the world; the face's for flat faces
    tangent_normal float32   the shading normal in MikkTSpace's tangent space, as in glTF: x along u, y up the image
    ao             float32   the cosine-weighted share of the hemisphere around the normal that is free within
                             `distance` metres, from `samples` rays: 1 is open, 0 closed
    bent_normal    float32   the mean free direction, unit; the normal if none is free
    thickness      float32   the mean distance to the next surface inside, cosine-weighted around the reversed normal
                             (Shapira et al. 2008); rays that leave count as `distance`, or not if that is infinite
    albedo         float32   the base colour of `source`, linear; (0, 0, 0) without a surface of it
    instance       int32     the object's id, -1 without a surface
    triangle       int32     the face's index in the mesh, -1 without a surface
    ============== ========= =======================================================================================

    With `source`, a world or its file, maps show this detailed model: a texel's point is the nearest one of the source
    along the object's shading normal, up to `cage` metres outwards or inwards (default: 2 % of the object's diagonal),
    and only the source occludes. A notice counts texels without one. `atlas` "xatlas" or "cells" computes texture
    coordinates, as in `texture_from_photos`.

    Gutters of 8 texels around the islands continue their values, except for ids. Overlapping islands are reported in
    a notice. The same call returns the same bytes on any number of threads. Raises `SettingsError` for invalid
    arguments, and `WorldError` for an unknown object and if the object does not have the texture coordinate set
    `uv_set`.
    """
    chosen = words("map", maps, MAPS)
    number = object_number(world._core, object)
    wide, uv_set = whole("size", size, 1, 16384), whole("uv_set", uv_set, 0, 7)
    count = whole("samples", samples, 1, 65536)
    reach = np.inf if distance == np.inf else real("distance", distance, 0.0, what="metres")
    diagonal = float(np.sqrt((np.ptp(world.triangles(number).reshape(-1, 3), axis=0) ** 2).sum()))
    cage = DEFAULT_CAGE * diagonal if cage is None else real("cage", cage, 0.0, what="metres")
    if "albedo" in chosen and source is None:
        raise SettingsError("map 'albedo' requires source, the detailed model", code="missing_value")
    detailed = None if source is None else world_of(source)
    mesh = object_mesh(world, number)
    if atlas is not None:
        mesh = mesh_with_atlas(mesh, atlas, wide)
    elif uv_set >= len(mesh.uvs):
        raise WorldError(
            f"uv_set {uv_set} is missing; object {object!r} has {len(mesh.uvs)} sets of texture coordinates, from 0; "
            'atlas="xatlas" (--atlas xatlas) unwraps it',
            code="missing_texture_coordinates",
        )
    settings = _Settings(number, chosen, count, reach, cage, uv_set, thread_count(threads))
    return _bake(world, mesh, wide, settings, detailed, object)


def _bake(
    world: World, mesh: ObjectMesh, wide: int, settings: _Settings, source: World | None, name: int | str
) -> BakedMaps:
    """The maps of a mesh."""
    uvs = mesh.uvs[settings.uv_set]
    texels = find_texels(uvs, (wide, wide))
    warn_of_overlap(texels, name)
    covered = covered_texels(texels)
    tangents = None
    if "tangent_normal" in settings.maps:
        matrix = world.objects[settings.number].matrix
        inverse = np.linalg.inv(matrix)
        local = mesh.corners @ inverse[:3, :3].T + inverse[:3, 3]
        tangents = corner_tangents(local, _corner_normals(mesh, matrix[:3, :3]), uvs.astype(np.float64))
    found: dict[str, npt.NDArray[Any]] = {}
    for each in settings.maps:
        shape = (wide * wide,) if each in SCALARS else (wide * wide, 3)
        found[each] = (
            np.full(shape, -1, np.int32) if each in ("instance", "triangle") else np.zeros(shape, np.float32)
        )
    missed = np.zeros(wide * wide, bool)
    for first in range(0, len(texels.index), CHUNK_TEXELS):
        part = slice(first, first + CHUNK_TEXELS)
        values, missed[texels.index[part]] = _values(world, mesh, texels, part, settings, source, tangents)
        for each in settings.maps:
            found[each][texels.index[part]] = values[each]
    if missed.any():
        message = (
            f"object {name!r}: {int(missed.sum())} of {len(texels.index)} texels have no surface of the source within "
            f"cage={settings.cage:.4g} metres; they show the object itself"
        )
        warn(Notice(message, "missed_source"))
    for each, array in found.items():
        image = array.reshape(wide, wide, *array.shape[1:])
        if array.dtype == np.float32:
            image = fill_gutters(image.reshape(wide, wide, -1), covered).reshape(image.shape)
        found[each] = image
    return BakedMaps(found, covered, texels.overlapping, missed.reshape(wide, wide))


@dataclass(frozen=True)
class _Settings:
    """Arguments of `bake`."""

    number: int
    maps: list[str]
    samples: int
    reach: float
    cage: float
    uv_set: int
    threads: int | None


def _values(
    world: World,
    mesh: ObjectMesh,
    texels: Texels,
    part: slice,
    settings: _Settings,
    source: World | None,
    tangents: Floats | None,
) -> tuple[dict[str, npt.NDArray[Any]], Bools]:
    """The values of some texels by map, and which of them missed the source."""
    face, weights = texels.face[part], texels.weights(part)
    own = _own_points(world, mesh, settings.number, face, weights)
    points = own if source is None else transfer(own, source, settings.cage, settings.threads)
    values: dict[str, npt.NDArray[Any]] = {
        "position": points.position,
        "normal": points.normal,
        "shading_normal": points.shading_normal,
        "triangle": face,
        "instance": np.full(len(face), settings.number),
    }
    if points.albedo is not None:
        values["albedo"] = points.albedo
    if tangents is not None:
        # glTF's tangents belong to the mesh's frame, in which normals are turned by the transpose.
        linear = world.objects[settings.number].matrix[:3, :3]
        shading = _unit(
            np.einsum("nk,nkj->nj", weights, _corner_normals(mesh, linear)[face]), own.normal @ linear
        )
        along = np.einsum("nk,nkj->nj", weights, tangents[face][..., :3])
        detailed = _unit(points.shading_normal @ linear, shading)
        values["tangent_normal"] = tangent_space_normals(detailed, shading, along, tangents[face][:, 0, 3])
    values |= _occlusion(points, texels.index[part], settings)
    return values, points.missed


def _own_points(
    world: World, mesh: ObjectMesh, number: int, face: npt.NDArray[np.int32], weights: Floats
) -> SurfacePoints:
    """The texels' points on the object."""
    corners = mesh.corners[face]
    normal = face_normals(corners)
    shading = normal
    if mesh.normals is not None:
        linear = np.asarray(np.linalg.inv(world.objects[number].matrix[:3, :3]).T, np.float64)
        shading = _unit(
            np.einsum("nk,nkj->nj", weights, mesh.normals[face].astype(np.float64)) @ linear.T, normal
        )
    position = np.einsum("nk,nkj->nj", weights, corners)
    instance = np.full(len(face), number, np.int32)
    return SurfacePoints(
        world, position, normal, shading, instance, face.astype(np.int32), np.zeros(len(face), bool)
    )


def _corner_normals(mesh: ObjectMesh, linear: Floats) -> Floats:
    """The shading normals of the corners [f, 3, 3] in the mesh's frame, for its transform `linear` [3, 3]."""
    if mesh.normals is not None:
        return mesh.normals.astype(np.float64)
    normals = face_normals(mesh.corners)
    return np.repeat(_unit(normals @ linear, normals)[:, None], 3, axis=1)


def _unit(vectors: Floats, default: Floats) -> Floats:
    """Vectors [n, 3] of length 1; `default` for those of length 0."""
    length = np.sqrt((vectors**2).sum(axis=1, keepdims=True))
    found: Floats = np.where(length > 0, vectors / np.where(length > 0, length, 1), default)
    return found


def _occlusion(
    points: SurfacePoints, keys: npt.NDArray[np.int64], settings: _Settings
) -> dict[str, npt.NDArray[Any]]:
    """The maps that need rays: occlusion, bent normals and thickness."""
    names, samples, reach, threads = settings.maps, settings.samples, settings.reach, settings.threads
    position, normal, count = points.position, points.normal, len(points.position)
    skip = (points.instance, points.triangle)
    # A texel on an edge touches the neighbouring face, which is not an occluder.
    start = RELATIVE_ROUNDING * float(np.abs(position).max(initial=0.0))
    values: dict[str, npt.NDArray[Any]] = {}
    if "ao" in names or "bent_normal" in names:
        free, bent = np.zeros(count), np.zeros((count, 3))
        for sample in range(samples):
            directions = hemisphere_directions(normal, keys, sample, samples)
            clear = ~points.world.occluded(
                position, directions, reach, t_min=start, skip=skip, threads=threads
            )
            free += clear
            bent += np.where(clear[:, None], directions, 0.0)
        values["ao"] = free / samples
        values["bent_normal"] = _unit(bent, normal)
    if "thickness" in names:
        total, hits = np.zeros(count), np.zeros(count)
        for sample in range(samples):
            directions = hemisphere_directions(-normal, keys, sample, samples)
            t = points.world.cast_rays(
                position, directions, t_max=reach, t_min=start, fields=("t",), skip=skip, threads=threads
            )["t"]
            hit = np.isfinite(t)
            total += np.where(hit, t, reach if np.isfinite(reach) else 0.0)
            hits += hit | np.isfinite(reach)
        values["thickness"] = total / np.maximum(hits, 1)
    return values
