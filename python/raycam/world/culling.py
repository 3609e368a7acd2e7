"""Copies of objects in which selected faces are removed."""

from __future__ import annotations

from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

from ..errors import WorldError
from .building import WorldBuilding
from .chosen import object_number
from .object_mesh import object_mesh

__all__ = ["cull_faces"]


Building = TypeVar("Building", bound=WorldBuilding)


def cull_faces(world: Building, which: int | str, keep: npt.ArrayLike) -> Building:
    """Returns a copy in which an object has only the faces to keep; see `World.cull_faces`."""
    number = object_number(world._core, which)
    mask = np.asarray(keep)
    mesh = object_mesh(world, number)
    if mask.dtype != np.bool_ or mask.shape != (mesh.faces,):
        raise WorldError(
            f"keep must be bool [{mesh.faces}], one for each face of object {which!r}, not {mask.dtype} "
            f"{list(mask.shape)}",
            code="wrong_shape",
        )
    if not mask.any():
        raise WorldError(
            f"keep is False for all faces of object {which!r}; use world.remove_object to remove it",
            code="nothing_visible",
        )
    if mesh.slots.any():
        raise WorldError(
            f"object {which!r} has {mesh.slots.max() + 1} materials, but cull_faces supports only one; add the "
            "faces of each material as a separate object",
            code="unsupported_feature",
        )
    matrix = np.linalg.inv(world.objects[number].matrix)
    local = mesh.corners[mask] @ matrix[:3, :3].T + matrix[:3, 3]
    vertex = [local.reshape(-1, 3)]
    optional = {"uvs": mesh.uvs[0] if mesh.uvs else None, "normals": mesh.normals}
    if mesh.colors is not None:
        optional["vertex_colors"] = mesh.colors[..., :3]
    given = {name: array[mask] for name, array in optional.items() if array is not None}
    vertex += [array.reshape(-1, array.shape[-1]).astype(np.float64) for array in given.values()]
    welded, faces = np.unique(np.concatenate(vertex, axis=1), axis=0, return_inverse=True)
    keys: dict[str, Any] = {}
    first = 3
    for name, array in given.items():
        keys[name] = welded[:, first : first + array.shape[-1]]
        first += array.shape[-1]
    copy = world.copy()
    copy.set_object(number, vertices=welded[:, :3], faces=faces.reshape(-1, 3), **keys)
    return copy
