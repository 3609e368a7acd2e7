"""Baking to the vertices of a mesh."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from ..arguments import Bools
from ..errors import Notice
from ..notices import warn
from ..world.face_geometry import face_areas, unique_rows
from .baked_maps import BakedMaps
from .light import LIGHT_MAPS
from .values import BakedObject, FacePoints, unit_vectors

__all__ = ["bake_vertices", "map_names", "warn_of_missed"]

INSET = 0.01
"""A face's value for a corner is computed at this fraction of the way from the corner to the face's centroid."""
CHUNK_CORNERS = 1 << 17
"""Number of corners processed at a time."""
RANDOM_COLUMNS = 1 << 12
"""Number of columns of an imaginary pixel grid; a corner uses the random numbers of its pixel in this grid."""
UNIT_VECTOR_MAPS = ("normal", "shading_normal", "bent_normal")
"""Maps of unit vectors."""


def bake_vertices(baked: BakedObject, name: int | str) -> BakedMaps:
    """Returns the maps at the vertices, as area-weighted means over the faces.

    The vertices are the distinct positions of the faces' corners.
    """
    corners = baked.mesh.corners
    vertices, vertex = unique_rows(corners.reshape(-1, 3))
    count = len(vertices)
    area = np.repeat(np.maximum(face_areas(corners), 1e-300), 3)
    total = np.bincount(vertex, weights=area, minlength=count)
    sums: dict[str, npt.NDArray[Any]] = {}
    missed = np.zeros(count, bool)
    corner_weights = INSET / 3 + (1 - INSET) * np.eye(3)
    for first in range(0, len(vertex), CHUNK_CORNERS):
        number = np.arange(first, min(first + CHUNK_CORNERS, len(vertex)))
        pixel = np.stack([number % RANDOM_COLUMNS, number // RANDOM_COLUMNS], axis=1).astype(np.int32)
        at = FacePoints((number // 3).astype(np.int32), corner_weights[number % 3], number, pixel)
        values, lost = baked.values(at)
        place, weight = vertex[number], area[number] / total[vertex[number]]
        missed[place[lost]] = True
        for each in map_names(baked.settings.maps):
            rows = values[each].reshape(len(number), -1) * weight[:, None]
            if each.endswith("_error"):  # standard errors are averaged as squares
                rows = rows**2
            found = [np.bincount(place, weights=column, minlength=count) for column in rows.T]
            sums[each] = sums.get(each, 0) + np.stack(found, axis=1)
    maps = {each: _mean(each, array) for each, array in sums.items()}
    warn_of_missed(missed, count, "vertices", baked.settings.cage, name)
    faces = vertex.reshape(-1, 3).astype(np.int32)
    return BakedMaps(maps, np.ones(count, bool), 0, missed, vertices, faces, baked.world.up)


def map_names(maps: list[str]) -> list[str]:
    """Returns the array names of requested maps; light maps also have an array NAME_error."""
    return [name for each in maps for name in ((each, f"{each}_error") if each in LIGHT_MAPS else (each,))]


def _mean(name: str, sums: npt.NDArray[Any]) -> npt.NDArray[np.float32]:
    """Returns the map [v] or [v, 3] from the weighted sums [v, k] of its values."""
    if name.endswith("_error"):
        sums = np.sqrt(sums)
    if name in UNIT_VECTOR_MAPS:
        sums = unit_vectors(sums, np.zeros_like(sums))
    found: npt.NDArray[np.float32] = (sums[:, 0] if sums.shape[1] == 1 else sums).astype(np.float32)
    return found


def warn_of_missed(missed: Bools, count: int, places: str, cage: float, name: object) -> None:
    """Warns about texels or vertices without a surface of the source."""
    if missed.any():
        message = (
            f"object {name!r}: {int(missed.sum())} of {count} {places} have no surface of the source within "
            f"cage={cage:.4g} metres; they show the object itself"
        )
        warn(Notice(message, "missed_source"))
