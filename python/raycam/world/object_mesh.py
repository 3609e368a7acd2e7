"""The mesh of one object as arrays per triangle corner, read from the object's glTF export."""

from __future__ import annotations

import json
import struct
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from .. import _core
from ..arguments import Floats
from .contents import WorldContents

__all__ = ["ObjectMesh", "attributes_of", "object_mesh"]

Single = npt.NDArray[np.float32]

COMPONENTS = {5120: "i1", 5121: "u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}


@dataclass(frozen=True)
class ObjectMesh:
    """An object's triangles in their order in the ground truth; arrays of corners are [f, 3, k]."""

    corners: Floats
    """Positions in the world [f, 3, 3], exact."""
    uvs: tuple[Single, ...]
    """Texture coordinates [f, 3, 2] of each set, v down; an empty tuple if the mesh has none."""
    normals: Single | None
    """Unit shading normals in the mesh's frame [f, 3, 3]; None for flat faces."""
    colors: Single | None
    """Linear vertex colours [f, 3, 3 or 4], or None."""
    slots: npt.NDArray[np.int32]
    """The material's number within the object for each triangle [f]."""

    @property
    def faces(self) -> int:
        """The number of triangles."""
        return len(self.corners)


def object_mesh(world: WorldContents, number: int) -> ObjectMesh:
    """Returns the mesh of the object with this id.

    Texture coordinates and normals are the mesh's float32 values.
    """
    corners = world.triangles(number)
    alone = _alone(world, number)
    data, _ = _core.world_to_gltf(alone)
    length = struct.unpack("<I", data[12:16])[0]
    document, binary = json.loads(data[20 : 20 + length]), memoryview(data)[28 + length :]
    parts = [attributes_of(document, binary, each) for each in document["meshes"][0]["primitives"]]
    order = np.arange(len(corners))
    local = np.concatenate([part["POSITION"] for part in parts])
    if len(parts) > 1:
        order = _match(local, alone.triangles(0).astype(np.float32))
    sets = [name for name in sorted(parts[0]) if name.startswith("TEXCOORD_")]

    def joined(name: str) -> Single | None:
        if any(name not in part for part in parts):
            return None
        return np.concatenate([part[name] for part in parts])[order]

    slots = np.concatenate([np.full(len(part["POSITION"]), i) for i, part in enumerate(parts)])[order]
    uvs = tuple(found for name in sets if (found := joined(name)) is not None)
    return ObjectMesh(corners, uvs, joined("NORMAL"), joined("COLOR_0"), slots.astype(np.int32))


def _alone(world: WorldContents, number: int) -> _core.World:
    """A copy of the world with only one object, untransformed."""
    copy = _core.world_with_cameras(world._core, [])
    for other in range(copy.object_count - 1, -1, -1):
        if other != number:
            _core.world_remove_object(copy, other)
    _core.world_set_object(copy, 0, {"matrix": np.eye(4).tolist(), "visible": True})
    return copy


def attributes_of(
    document: dict[str, Any], binary: memoryview, primitive: dict[str, Any]
) -> dict[str, Single]:
    """Returns the attributes of a glTF primitive per triangle corner, [f, 3, k]."""
    arrays = {name: _accessor(document, binary, i) for name, i in primitive["attributes"].items()}
    count = len(arrays["POSITION"])
    indices = np.arange(count)
    if "indices" in primitive:
        indices = _accessor(document, binary, primitive["indices"]).reshape(-1).astype(np.int64)
    return {name: array[indices].reshape(-1, 3, array.shape[1]) for name, array in arrays.items()}


def _accessor(document: dict[str, Any], binary: memoryview, number: int) -> npt.NDArray[Any]:
    """An accessor [n, k] of a document that raycam wrote."""
    accessor = document["accessors"][number]
    view = document["bufferViews"][accessor["bufferView"]]
    width, kind = WIDTHS[accessor["type"]], np.dtype(COMPONENTS[accessor["componentType"]])
    start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
    stride = view.get("byteStride", width * kind.itemsize)
    array: npt.NDArray[Any] = np.ndarray(
        (accessor["count"], width), kind, binary, start, (stride, kind.itemsize)
    )
    if accessor.get("normalized"):
        return (array / np.iinfo(kind).max).astype(np.float32)
    return array


def _match(local: Single, wanted: Single) -> npt.NDArray[np.int64]:
    """Returns the number of the equal triangle in `local` for each triangle of `wanted`.

    The triangles are [f, 3, 3]. Equal triangles are matched in order.
    """
    sorted_local = np.lexsort(local.reshape(len(local), 9).T)
    sorted_wanted = np.lexsort(wanted.reshape(len(wanted), 9).T)
    order = np.empty(len(local), np.int64)
    order[sorted_wanted] = sorted_local
    return order
