"""Maps of a surface: occlusion, positions, normals, curvature, materials and ids, in textures or at vertices."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from ..arguments import one_of, real, thread_count, whole, words
from ..errors import SettingsError, WorldError
from ..render.arguments import world_of
from ..world import World
from ..world.chosen import object_number
from ..world.object_mesh import object_mesh
from .atlas import Atlas, mesh_with_atlas
from .baked_maps import BakedMaps
from .gutters import fill_gutters
from .settings import ID_MAPS, MAPS, SCALARS, BakeSettings
from .surface_points import MATERIAL_MAPS
from .texels import covered_texels, find_texels, warn_of_overlap
from .values import BakedObject, FacePoints
from .vertices import bake_vertices, warn_of_missed

__all__ = ["bake"]

DEFAULT_CAGE = 0.02
"""Distance within which a source is looked for, relative to the diagonal of the object's bounds."""
CHUNK_TEXELS = 1 << 17
"""Number of texels processed at a time."""


def bake(
    world: World,
    maps: Sequence[str] | str = ("ao",),
    *,
    object: int | str = 0,
    to: Literal["texture", "vertices"] = "texture",
    size: int = 1024,
    uv_set: int = 0,
    source: World | str | os.PathLike[str] | None = None,
    cage: float | None = None,
    atlas: Atlas | None = None,
    samples: int = 64,
    distance: float = np.inf,
    cone: float = 180.0,
    green: Literal["up", "down"] = "up",
    threads: int | None = None,
) -> BakedMaps:
    """Bakes maps of an object, by id or name, into textures of `size` x `size` texels by its texture coordinates.

    Each texel's values belong to the surface point at its centre. All objects of the world occlude.

    ============== ========= =======================================================================================
    position       float32   the point in the world, metres
    normal         float32   the face's unit normal in the world
    shading_normal float32   the interpolated unit normal in the world; the face's for flat faces
    tangent_normal float32   the shading normal in MikkTSpace's tangent space: x along u, y up the image as in glTF and
                             OpenGL, or down as in DirectX with `green="down"`
    ao             float32   the cosine-weighted share of the hemisphere around the normal that is free within
                             `distance` metres, from `samples` rays: 1 is open, 0 closed
    bent_normal    float32   the mean free direction, unit; the normal if none is free
    thickness      float32   the mean distance to the next surface inside, cosine-weighted within `cone` degrees around
                             the reversed normal: 180 is the hemisphere, 120 the shape diameter function (Shapira et
                             al. 2008); rays that leave count as `distance`, or not if that is infinite
    curvature      float32   the mean curvature, 1/metre, positive where convex (Meyer et al. 2003)
    albedo         float32   the base colour of `source`, linear
    instance       int32     the object's id, -1 without a surface
    material       int32     the material's number, as in the channel `material`, -1 without a surface
    triangle       int32     the face's index in the mesh, -1 without a surface
    ============== ========= =======================================================================================

    With `source`, a world or its file, maps show this detailed model: a texel's point is the nearest one of the source
    along the object's shading normal, up to `cage` metres outwards or inwards (default: 2 % of the object's diagonal).
    Only the source occludes then. A notice counts texels without one; curvature and albedo are 0 there. `atlas`
    "xatlas" or "cells" computes texture coordinates, as in `texture_from_photos`.

    `to="vertices"` bakes to the vertices, which are the different positions of the corners: arrays are [v] and [v, 3],
    and `BakedMaps.to_world` returns a mesh in vertex colours. A value is the mean over the faces at the vertex, by
    their area; rays start 1 % inside of the face. `size` and `uv_set` are ignored, because no texture coordinates are
    needed; ids, `tangent_normal` and `atlas` are not supported.

    Gutters of 8 texels around the islands continue their values, except for ids. Overlapping islands are reported in
    a notice. The same call returns the same bytes on any number of threads. Raises `SettingsError` for invalid
    arguments, and `WorldError` for an unknown object and if the object does not have the texture coordinate set
    `uv_set`.
    """
    chosen = words("map", maps, MAPS)
    number = object_number(world._core, object)
    wide, uv_set = whole("size", size, 1, 16384), whole("uv_set", uv_set, 0, 7)
    one_of("to", to, ("texture", "vertices"))
    settings = _settings(
        world, number, chosen, samples, distance=distance, cone=cone, cage=cage, green=green, threads=threads
    )
    for name in chosen:
        if name in MATERIAL_MAPS and source is None:
            raise SettingsError(f"map {name!r} requires source, the detailed model", code="missing_value")
    detailed = None if source is None else world_of(source)
    mesh = object_mesh(world, number)
    if to == "vertices":
        _refuse_texture_arguments(chosen, atlas)
        return bake_vertices(BakedObject(world, mesh, None, detailed, settings), object)
    if atlas is not None:
        mesh = mesh_with_atlas(mesh, atlas, wide)
    elif uv_set >= len(mesh.uvs):
        raise WorldError(
            f"uv_set {uv_set} is missing; object {object!r} has {len(mesh.uvs)} sets of texture coordinates, from 0; "
            'atlas="xatlas" (--atlas xatlas) unwraps it, and to="vertices" (--to vertices) needs none',
            code="missing_texture_coordinates",
        )
    uvs = mesh.uvs[uv_set]
    return _bake_texture(BakedObject(world, mesh, uvs, detailed, settings), uvs, wide, object)


def _settings(
    world: World,
    number: int,
    maps: list[str],
    samples: int,
    *,
    distance: float,
    cone: float,
    cage: float | None,
    green: str,
    threads: int | None,
) -> BakeSettings:
    """The settings of an object, checked."""
    diagonal = float(np.sqrt((np.ptp(world.triangles(number).reshape(-1, 3), axis=0) ** 2).sum()))
    angle = real("cone", cone, 0.0, what="degrees")
    if not 0 < angle <= 180:
        raise SettingsError(
            f"cone must be more than 0 and at most 180 degrees, got {angle:g}", code="out_of_range"
        )
    return BakeSettings(
        number,
        maps,
        whole("samples", samples, 1, 65536),
        np.inf if distance == np.inf else real("distance", distance, 0.0, what="metres"),
        float(np.radians(angle)),
        DEFAULT_CAGE * diagonal if cage is None else real("cage", cage, 0.0, what="metres"),
        one_of("green", green, ("up", "down")) == "down",
        thread_count(threads),
    )


def _refuse_texture_arguments(maps: list[str], atlas: Atlas | None) -> None:
    """Raises `SettingsError` for arguments that vertices do not support."""
    unsupported = [name for name in maps if name in (*ID_MAPS, "tangent_normal")]
    if unsupported:
        raise SettingsError(
            f'map {unsupported[0]!r} cannot be baked to vertices; use to="texture"', code="conflicting_values"
        )
    if atlas is not None:
        raise SettingsError(
            'atlas requires to="texture"; vertices have no texture', code="conflicting_values"
        )


def _bake_texture(baked: BakedObject, uvs: npt.NDArray[np.float32], wide: int, name: int | str) -> BakedMaps:
    """The maps of a mesh in textures of `wide` x `wide` texels."""
    texels = find_texels(uvs, (wide, wide))
    warn_of_overlap(texels, name)
    covered = covered_texels(texels)
    found = {each: _empty_map(each, wide) for each in baked.settings.maps}
    missed = np.zeros(wide * wide, bool)
    for first in range(0, len(texels.index), CHUNK_TEXELS):
        part = slice(first, first + CHUNK_TEXELS)
        index = texels.index[part]
        values, missed[index] = baked.values(FacePoints(texels.face[part], texels.weights(part), index))
        for each, array in found.items():
            array[index] = values[each]
    warn_of_missed(missed, len(texels.index), "texels", baked.settings.cage, name)
    for each, array in found.items():
        image = array.reshape(wide, wide, *array.shape[1:])
        if array.dtype == np.float32:
            image = fill_gutters(image.reshape(wide, wide, -1), covered).reshape(image.shape)
        found[each] = image
    return BakedMaps(found, covered, texels.overlapping, missed.reshape(wide, wide))


def _empty_map(name: str, wide: int) -> npt.NDArray[Any]:
    """A map of no surface."""
    if name in ID_MAPS:
        return np.full(wide * wide, -1, np.int32)
    return np.zeros((wide * wide,) if name in SCALARS else (wide * wide, 3), np.float32)
