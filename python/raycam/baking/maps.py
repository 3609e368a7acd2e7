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
from ..errors import WorldError
from ..io.atomic_files import write
from ..world import World
from ..world.chosen import object_number
from ..world.face_geometry import face_normals
from ..world.object_mesh import ObjectMesh, object_mesh
from .gutters import fill_gutters
from .hemisphere import hemisphere_directions
from .texels import Texels, covered_texels, find_texels, warn_of_overlap

__all__ = ["MAPS", "BakedMaps", "bake"]

MAPS = ("position", "normal", "shading_normal", "ao", "bent_normal", "thickness", "instance", "triangle")
"""The maps that `bake` supports."""
RELATIVE_ROUNDING = 8 * float(np.finfo(np.float64).eps)
"""Rounding error of a surface point relative to its largest coordinate; rays start at this distance."""
CHUNK_TEXELS = 1 << 17
"""Number of texels processed at a time."""


@dataclass(frozen=True, eq=False)
class BakedMaps(Mapping[str, npt.NDArray[Any]]):
    """The result of `bake`: an object's maps by name, arrays [h, w] or [h, w, 3], and the covered texels."""

    maps: dict[str, npt.NDArray[Any]] = field(repr=False)
    """The arrays by name."""
    covered: Bools = field(repr=False)
    """True [h, w] for texels whose centre is inside a face; False in gutters."""
    overlapping: int
    """The number of texels that are inside several faces."""

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
            if name == "ao":
                data = _core.encode_png(np.rint(values * 65535).astype(np.uint16))
            else:
                data = _core.encode_exr([(name, np.ascontiguousarray(values))], False, None, [])
            path = target / f"{name}.{'png' if name == 'ao' else 'exr'}"
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
    ao             float32   the cosine-weighted share of the hemisphere around the normal that is free within
                             `distance` metres, from `samples` rays: 1 is open, 0 closed
    bent_normal    float32   the mean free direction, unit; the normal where none is free
    thickness      float32   the mean distance to the next surface inside, cosine-weighted around the reversed normal
                             (Shapira et al. 2008); rays that leave count as `distance`, or not if that is infinite
    instance       int32     the object's id, -1 without a surface
    triangle       int32     the face's index in the mesh, -1 without a surface
    ============== ========= =======================================================================================

    Gutters of 8 texels around the islands continue their values, except for ids. Overlapping islands are reported in
    a notice. The same call returns the same bytes on any number of threads. Raises `SettingsError` for invalid
    arguments, and `WorldError` for an unknown object and if the object does not have the texture coordinate set
    `uv_set`.
    """
    chosen = words("map", maps, MAPS)
    number = object_number(world._core, object)
    wide = whole("size", size, 1, 16384)
    count = whole("samples", samples, 1, 65536)
    reach = np.inf if distance == np.inf else real("distance", distance, 0.0, what="metres")
    mesh = object_mesh(world, number)
    if whole("uv_set", uv_set, 0, 7) >= len(mesh.uvs):
        raise WorldError(
            f"uv_set {uv_set} is missing; object {object!r} has {len(mesh.uvs)} sets of texture coordinates, from 0"
        )
    texels = find_texels(mesh.uvs[uv_set], (wide, wide))
    warn_of_overlap(texels, object)
    covered = covered_texels(texels)
    found: dict[str, npt.NDArray[Any]] = {}
    for name in chosen:
        shape = (wide * wide,) if name in ("ao", "thickness", "instance", "triangle") else (wide * wide, 3)
        ids = name in ("instance", "triangle")
        found[name] = np.full(shape, -1, np.int32) if ids else np.zeros(shape, np.float32)
    linear = np.asarray(np.linalg.inv(world.objects[number].matrix[:3, :3]).T, np.float64)
    for first in range(0, len(texels.index), CHUNK_TEXELS):
        part = slice(first, first + CHUNK_TEXELS)
        values = _values(
            world, mesh, texels, part, linear, (number, chosen, count, reach, thread_count(threads))
        )
        for name in chosen:
            found[name][texels.index[part]] = values[name]
    for name, array in found.items():
        image = array.reshape(wide, wide, *array.shape[1:])
        if array.dtype == np.float32:
            filled = fill_gutters(image.reshape(wide, wide, -1), covered)
            image = filled.reshape(image.shape)
        found[name] = image
    return BakedMaps(found, covered, texels.overlapping)


Settings = tuple[int, list[str], int, float, int | None]


def _values(
    world: World, mesh: ObjectMesh, texels: Texels, part: slice, linear: Floats, settings: Settings
) -> dict[str, npt.NDArray[Any]]:
    """The values of some texels by map."""
    number, names, samples, reach, threads = settings
    face, weights = texels.face[part], texels.weights(part)
    corners = mesh.corners[face]
    position = np.einsum("nk,nkj->nj", weights, corners)
    normal = face_normals(corners)
    values: dict[str, npt.NDArray[Any]] = {"position": position, "normal": normal, "triangle": face}
    values["instance"] = np.full(len(face), number)
    values["shading_normal"] = normal
    if mesh.normals is not None:
        turned = np.einsum("nk,nkj->nj", weights, mesh.normals[face].astype(np.float64)) @ linear.T
        length = np.sqrt((turned**2).sum(axis=1, keepdims=True))
        values["shading_normal"] = np.where(length > 0, turned / np.where(length > 0, length, 1), normal)
    skip = (np.full(len(face), number, np.int32), face.astype(np.int32))
    # A texel on an edge touches the neighbouring face, which is not an occluder.
    start = RELATIVE_ROUNDING * float(np.abs(position).max(initial=0.0))
    keys = texels.index[part]
    if "ao" in names or "bent_normal" in names:
        free, bent = np.zeros(len(face)), np.zeros((len(face), 3))
        for sample in range(samples):
            directions = hemisphere_directions(normal, keys, sample, samples)
            clear = ~world.occluded(position, directions, reach, t_min=start, skip=skip, threads=threads)
            free += clear
            bent += np.where(clear[:, None], directions, 0.0)
        length = np.sqrt((bent**2).sum(axis=1, keepdims=True))
        values["ao"] = free / samples
        values["bent_normal"] = np.where(length > 0, bent / np.where(length > 0, length, 1), normal)
    if "thickness" in names:
        total, hits = np.zeros(len(face)), np.zeros(len(face))
        for sample in range(samples):
            directions = hemisphere_directions(-normal, keys, sample, samples)
            t = world.cast_rays(
                position, directions, t_max=reach, t_min=start, fields=("t",), skip=skip, threads=threads
            )["t"]
            hit = np.isfinite(t)
            total += np.where(hit, t, reach if np.isfinite(reach) else 0.0)
            hits += hit | np.isfinite(reach)
        values["thickness"] = total / np.maximum(hits, 1)
    return values
