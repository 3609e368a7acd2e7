"""Skins, flexes and tendons of a MuJoCo model: meshes whose vertices move with the state."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ...arguments import Floats
from ...errors import Notice
from .materials import element_look
from .model import FLEX_OBJECT, SKIN_OBJECT, element_name, element_prefix
from .tendons import Tendon, is_spatial

__all__ = ["Deformable", "Flex", "Skin", "deformables", "rotation_of"]


@dataclass(frozen=True)
class Skin:
    """A skin, moved by the bodies that are its bones (linear blend skinning)."""

    number: int
    kind = SKIN_OBJECT
    """The type of the object, a value of MuJoCo's `mjtObj`."""

    def triangles(self, model: Any) -> Any:
        """Returns the triangles [t, 3] as vertex indices."""
        first, count = int(model.skin_faceadr[self.number]), int(model.skin_facenum[self.number])
        return np.asarray(model.skin_face[first : first + count], np.int64)

    def shape(self, model: Any, data: Any) -> tuple[Floats, Floats | None]:
        """Returns vertices and smooth normals [v, 3] in the world, in metres.

        The shape is inflated as specified in the model.
        """
        vertices = self._vertices(model, data)
        return vertices, smooth_normals(vertices, self.triangles(model))

    def _vertices(self, model: Any, data: Any) -> Floats:
        first, count = int(model.skin_vertadr[self.number]), int(model.skin_vertnum[self.number])
        rest = np.asarray(model.skin_vert[first : first + count], np.float64)
        moved = np.zeros_like(rest)
        bone, bones = int(model.skin_boneadr[self.number]), int(model.skin_bonenum[self.number])
        for each in range(bone, bone + bones):
            start, used = int(model.skin_bonevertadr[each]), int(model.skin_bonevertnum[each])
            ids = np.asarray(model.skin_bonevertid[start : start + used], np.int64)
            weights = np.asarray(model.skin_bonevertweight[start : start + used], np.float64)
            body = int(model.skin_bonebodyid[each])
            bind = rotation_of(np.asarray(model.skin_bonebindquat[each], np.float64))
            turn = np.asarray(data.xmat[body]).reshape(3, 3) @ bind.T
            shift = np.asarray(data.xpos[body]) - turn @ np.asarray(model.skin_bonebindpos[each], np.float64)
            np.add.at(moved, ids, weights[:, None] * (rest[ids] @ turn.T + shift))
        inflate = float(model.skin_inflate[self.number])
        return moved + inflate * smooth_normals(moved, self.triangles(model)) if inflate else moved

    def coordinates(self, model: Any) -> Floats | None:
        """Returns the texture coordinates [v, 2], or None."""
        start = int(model.skin_texcoordadr[self.number])
        count = int(model.skin_vertnum[self.number])
        if start < 0:
            return None
        return np.asarray(model.skin_texcoord[start : start + count], np.float64)


@dataclass(frozen=True)
class Flex:
    """A deformable sheet (its triangles) or body (its surface)."""

    number: int
    kind = FLEX_OBJECT
    """The type of the object, a value of MuJoCo's `mjtObj`."""

    def triangles(self, model: Any) -> Any:
        """Returns the triangles [t, 3] as vertex indices."""
        if int(model.flex_dim[self.number]) == 2:
            first, count = int(model.flex_elemdataadr[self.number]), int(model.flex_elemnum[self.number])
            return np.asarray(model.flex_elem[first : first + 3 * count], np.int64).reshape(-1, 3)
        first, count = int(model.flex_shelldataadr[self.number]), int(model.flex_shellnum[self.number])
        return np.asarray(model.flex_shell[first : first + 3 * count], np.int64).reshape(-1, 3)

    def shape(self, model: Any, data: Any) -> tuple[Floats, Floats | None]:
        """Returns vertices and normals [v, 3] in the world, in metres; no normals for flat shading."""
        first, count = int(model.flex_vertadr[self.number]), int(model.flex_vertnum[self.number])
        vertices = np.asarray(data.flexvert_xpos[first : first + count], np.float64)
        flat = bool(model.flex_flatskin[self.number])
        return vertices, None if flat else smooth_normals(vertices, self.triangles(model))

    def coordinates(self, model: Any) -> Floats | None:
        """Returns None: textures of flexes are not used."""
        return None


Deformable = Skin | Flex | Tendon


def deformables(
    model: Any, groups: tuple[int, ...], tendons: tuple[int, ...], notices: list[Notice]
) -> list[Deformable]:
    """Returns the skins and flexes of `groups`, and the spatial tendons of the groups `tendons`.

    Flexes of one dimension are omitted with a notice.
    """
    ropes = [Tendon(number) for number in range(model.ntendon) if is_spatial(model, number)]
    shown: list[Deformable] = [each for each in ropes if _is_shown(model, each, tendons)]
    found: list[Deformable] = [Skin(number) for number in range(model.nskin)]
    for number in range(model.nflex):
        name = element_name(model, "flex", number)
        if int(model.flex_dim[number]) == 1:
            notices.append(Notice(f"flex {name!r}: cables (dim=1) are not shown", "ignored_element"))
            continue
        if float(model.flex_radius[number]) > 0:
            text = (
                f"flex {name!r}: shown without its thickness (radius {float(model.flex_radius[number]):g} m)"
            )
            notices.append(Notice(text, "approximated_value"))
        found.append(Flex(number))
    return [*(each for each in found if _is_shown(model, each, groups)), *shown]


def _is_shown(model: Any, deformable: Deformable, groups: tuple[int, ...]) -> bool:
    group = getattr(model, f"{element_prefix(deformable.kind)}_group")[deformable.number]
    return int(group) in groups and element_look(model, deformable.kind, deformable.number)[0][3] > 0


def smooth_normals(vertices: Floats, triangles: Any) -> Floats:
    """Returns the unit normals [v, 3] of vertices.

    A vertex's normal is the mean of the normals of its triangles, weighted by area.
    """
    corners = vertices[triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    total = np.zeros_like(vertices)
    for corner in range(3):
        np.add.at(total, triangles[:, corner], normals)
    lengths = np.linalg.norm(total, axis=1, keepdims=True)
    return np.where(lengths > 0, total / np.maximum(lengths, np.finfo(np.float64).tiny), [0.0, 0.0, 1.0])


def rotation_of(quaternion: Floats) -> Floats:
    """Returns the rotation matrix [3, 3] of a quaternion (w, x, y, z)."""
    w, x, y, z = quaternion / np.linalg.norm(quaternion)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
