"""Maps of a surface, in textures or at vertices.

The maps contain occlusion, light, positions, normals, curvature, materials and ids.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from ..arguments import flag, one_of, real, thread_count, whole, words
from ..errors import SettingsError, WorldError
from ..render.arguments import world_of
from ..render.denoise import denoise as denoise_image
from ..world import World
from ..world.chosen import object_number
from ..world.object_mesh import ObjectMesh, object_mesh
from .atlas import Atlas, mesh_with_atlas
from .baked_maps import BakedMaps
from .gutters import fill_gutters
from .light import LIGHT_MAPS, warn_of_default_lights
from .settings import ID_MAPS, MAPS, SCALARS, BakeSettings
from .surface_points import MATERIAL_MAPS
from .texels import covered_texels, find_texels, warn_of_overlap
from .values import BakedObject, FacePoints
from .vertices import bake_vertices, map_names, warn_of_missed

__all__ = ["bake"]

DEFAULT_CAGE = 0.02
"""Distance within which the source is searched, relative to the diagonal of the object's bounds."""
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
    max_depth: int | None = None,
    denoise: bool = False,
    threads: int | None = None,
) -> BakedMaps:
    """Bakes maps of an object into textures of `size` x `size` texels.

    The object is given by id or name. Its texture coordinates determine the texels. Each texel's values
    belong to the surface point at its centre. All objects of the world occlude.

    `BakedMaps` describes the maps: `position`, `normal`, `shading_normal`, `tangent_normal`, `ao`, `bent_normal`,
    `thickness`, `curvature`; `irradiance`, `direct`, `radiance`; `albedo`, `roughness`, `metallic`, `emission`;
    `instance`, `material`, `triangle`. `samples` is the number of rays or paths for each texel, and
    `distance` the length of occlusion rays in metres. `cone` is the opening angle of the rays of `thickness` in
    degrees. `green` is the direction of green in `tangent_normal` ("down" for DirectX). `max_depth` is the maximum
    number of segments of a light path.

    The additional maps `irradiance_error`, `direct_error` and `radiance_error` contain the standard error of the
    luminance of `irradiance`, `direct` and `radiance`; `denoise` removes their noise with Open Image Denoise (requires
    `pip install raycam[denoise]`).

    With `source`, a world or its file, maps show this detailed model. A texel's point is then the source's nearest
    point along the object's shading normal, at most `cage` metres outwards or inwards (default: 2 % of the object's
    diagonal). In this case, only the source occludes and emits light. A notice reports the number of texels without
    such a point; light, curvature and materials are 0 there. `atlas` "xatlas" or "cells" computes texture coordinates,
    as in `texture_from_photos`.

    `to="vertices"` bakes to the vertices, which are the different positions of the corners: arrays are [v] and [v, 3],
    and `BakedMaps.to_world` returns a mesh in vertex colours. A value is the area-weighted mean over the faces at the
    vertex. For each face, it is computed at 1 % of the way from the corner to the face's centroid. `size` and `uv_set`
    are ignored, because no texture coordinates are needed; ids, `tangent_normal`, `atlas` and `denoise` are not
    supported.

    Gutters of 8 texels around the islands continue their values, except for ids. Notices report overlapping islands
    and, if light is baked, a world without lights. The same call returns the same bytes on any number of threads.
    Raises `SettingsError` for invalid arguments, and `WorldError` for an unknown object and if the object does not have
    the texture coordinate set `uv_set`.
    """
    chosen = words("map", maps, MAPS)
    number = object_number(world._core, object)
    wide, uv_set = whole("size", size, 1, 16384), whole("uv_set", uv_set, 0, 7)
    one_of("to", to, ("texture", "vertices"))
    settings = _settings(
        world,
        number,
        chosen,
        samples,
        distance=distance,
        cone=cone,
        cage=cage,
        green=green,
        max_depth=max_depth,
        threads=threads,
    )
    smooth = flag("denoise", denoise)
    for name in chosen:
        if name in MATERIAL_MAPS and source is None:
            raise SettingsError(f"map {name!r} requires source, the detailed model", code="missing_value")
    detailed = None if source is None else world_of(source)
    if set(chosen) & set(LIGHT_MAPS):
        warn_of_default_lights(world if detailed is None else detailed)
    mesh = object_mesh(world, number)
    if to == "vertices":
        _refuse_texture_arguments(chosen, atlas, smooth)
        return bake_vertices(BakedObject(world, mesh, None, detailed, settings), object)
    mesh = _with_coordinates(mesh, atlas, wide, uv_set, object)
    uvs = mesh.uvs[uv_set if atlas is None else 0]
    return _bake_texture(BakedObject(world, mesh, uvs, detailed, settings), uvs, wide, smooth, object)


def _with_coordinates(
    mesh: ObjectMesh, atlas: Atlas | None, wide: int, uv_set: int, object: int | str
) -> ObjectMesh:
    """Returns the mesh with the texture coordinates of an atlas, or with its own.

    Raises `WorldError` if the mesh does not have the set `uv_set` of texture coordinates.
    """
    if atlas is not None:
        return mesh_with_atlas(mesh, atlas, wide)
    if uv_set >= len(mesh.uvs):
        raise WorldError(
            f"uv_set {uv_set} is missing; object {object!r} has {len(mesh.uvs)} UV sets, numbered from 0; "
            'atlas="xatlas" (--atlas xatlas) creates texture coordinates; to="vertices" (--to vertices) works '
            "without them",
            code="missing_texture_coordinates",
        )
    return mesh


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
    max_depth: int | None,
    threads: int | None,
) -> BakeSettings:
    """Checks the arguments of `bake`, and returns them as settings."""
    diagonal = float(np.sqrt((np.ptp(world.triangles(number).reshape(-1, 3), axis=0) ** 2).sum()))
    angle = real("cone", cone, 0.0, what="an angle in degrees")
    if not 0 < angle <= 180:
        raise SettingsError(
            f"cone must be more than 0 and at most 180 degrees, got {angle:g}", code="out_of_range"
        )
    return BakeSettings(
        number,
        maps,
        whole("samples", samples, 1, 65536),
        np.inf if distance == np.inf else real("distance", distance, 0.0, what="a distance in metres"),
        float(np.radians(angle)),
        DEFAULT_CAGE * diagonal if cage is None else real("cage", cage, 0.0, what="a distance in metres"),
        one_of("green", green, ("up", "down")) == "down",
        None if max_depth is None else whole("max_depth", max_depth, 1, 1 << 20),
        thread_count(threads),
    )


def _refuse_texture_arguments(maps: list[str], atlas: Atlas | None, denoise: bool) -> None:
    """Raises `SettingsError` for arguments and maps that require textures, not vertices."""
    unsupported = [name for name in maps if name in (*ID_MAPS, "tangent_normal")]
    if unsupported:
        raise SettingsError(
            f'map {unsupported[0]!r} cannot be baked to vertices; use to="texture"', code="conflicting_values"
        )
    if atlas is not None or denoise:
        name = "atlas" if atlas is not None else "denoise"
        raise SettingsError(
            f'{name} requires to="texture"; vertices have no texture', code="conflicting_values"
        )


def _bake_texture(
    baked: BakedObject, uvs: npt.NDArray[np.float32], wide: int, smooth: bool, name: int | str
) -> BakedMaps:
    """The maps of a mesh in textures of `wide` x `wide` texels."""
    texels = find_texels(uvs, (wide, wide))
    warn_of_overlap(texels, name)
    covered = covered_texels(texels)
    names = map_names(baked.settings.maps)
    found = {each: _empty_map(each, wide) for each in [*names, *(["shading_normal"] if smooth else [])]}
    missed = np.zeros(wide * wide, bool)
    for first in range(0, len(texels.index), CHUNK_TEXELS):
        part = slice(first, first + CHUNK_TEXELS)
        index = texels.index[part]
        pixel = np.stack([index % wide, index // wide], axis=1).astype(np.int32)
        values, missed[index] = baked.values(
            FacePoints(texels.face[part], texels.weights(part), index, pixel)
        )
        for each, array in found.items():
            array[index] = values[each]
    warn_of_missed(missed, len(texels.index), "texels", baked.settings.cage, name)
    for each, array in found.items():
        image = array.reshape(wide, wide, *array.shape[1:])
        if array.dtype == np.float32:
            image = fill_gutters(image.reshape(wide, wide, -1), covered).reshape(image.shape)
        found[each] = image
    if smooth:
        _denoise(found)
    named = {each: found[each] for each in names}
    return BakedMaps(named, covered, texels.overlapping, missed.reshape(wide, wide))


def _empty_map(name: str, wide: int) -> npt.NDArray[Any]:
    """An empty map, in which no texel has a surface."""
    if name in ID_MAPS:
        return np.full(wide * wide, -1, np.int32)
    is_scalar = name in SCALARS or name.endswith("_error")
    return np.zeros((wide * wide,) if is_scalar else (wide * wide, 3), np.float32)


def _denoise(maps: dict[str, npt.NDArray[Any]]) -> None:
    """Removes the noise of maps of light, guided by the normals."""
    for name in LIGHT_MAPS:
        if name in maps:
            maps[name] = denoise_image(maps[name], np.ones_like(maps[name]), maps["shading_normal"])
