"""Meshes of pyrender: groups of primitives."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from .constants import GLTF
from .material import Material, MetallicRoughnessMaterial
from .primitive import Bounded, Primitive
from .values import Converted, text

__all__ = ["Mesh"]

Floats = npt.NDArray[Any]


class Mesh(Bounded):
    """A list of primitives; `is_visible` may be assigned to."""

    name = Converted(text)
    is_visible = Converted(bool)

    def __init__(
        self,
        primitives: Sequence[Primitive],
        name: str | None = None,
        weights: Any = None,
        is_visible: bool = True,
    ) -> None:
        self.primitives = list(primitives)
        self.name, self.weights, self.is_visible = name, weights, is_visible

    @property
    def bounds(self) -> Floats:
        """The lower and upper corner [2, 3] of the bounding box."""
        each = np.array([primitive.bounds for primitive in self.primitives])
        return np.stack([each[:, 0].min(axis=0), each[:, 1].max(axis=0)])

    @property
    def is_transparent(self) -> bool:
        """True if any primitive is transparent."""
        return any(primitive.is_transparent for primitive in self.primitives)

    @staticmethod
    def from_points(
        points: npt.ArrayLike,
        colors: npt.ArrayLike | None = None,
        normals: npt.ArrayLike | None = None,
        is_visible: bool = True,
        poses: npt.ArrayLike | None = None,
    ) -> Mesh:
        """Returns points as squares of the renderer's `point_size` pixels.

        Without normals, the points face the camera.
        """
        cloud = Primitive(points, normals=normals, color_0=colors, mode=GLTF.POINTS, poses=poses)
        return Mesh([cloud], is_visible=is_visible)

    @staticmethod
    def from_trimesh(
        mesh: Any,
        material: Material | None = None,
        is_visible: bool = True,
        poses: npt.ArrayLike | None = None,
        wireframe: bool = False,
        smooth: bool = True,
    ) -> Mesh:
        """Returns the triangles of one or several `trimesh.Trimesh`.

        With `wireframe`, returns the triangles' edges instead. A given material is copied, and replaces the
        colours of vertices and faces. Raises `TypeError` for other objects, and `ValueError` for face colours
        with `smooth=True`.
        """
        meshes = list(mesh) if isinstance(mesh, list | tuple | set | np.ndarray) else [mesh]
        for one in meshes:
            if not all(hasattr(one, name) for name in ("faces", "vertices", "visual")):
                raise TypeError(
                    f"expected a trimesh.Trimesh or a list of them, not {type(one).__name__}; "
                    "for arrays, use Primitive(positions, normals, indices=faces); for a point cloud, use "
                    "Mesh.from_points(cloud.vertices, cloud.colors)"
                )
        made = []
        for one in meshes:
            shown = _material_of(one) if material is None else copy.copy(material)
            shown.wireframe = bool(wireframe)
            made.append(_primitive(one, shown, poses, smooth, colored=material is None))
        return Mesh(made, is_visible=is_visible)


def _primitive(
    mesh: Any, material: Material, poses: npt.ArrayLike | None, smooth: bool, *, colored: bool
) -> Primitive:
    faces, visual = np.asarray(mesh.faces), mesh.visual
    apart = faces.reshape(-1)
    colors = coordinates = None
    if colored and visual.kind == "vertex":
        colors = np.asarray(visual.vertex_colors)
        colors = colors if smooth else colors[apart]
    elif colored and visual.kind == "face":
        if smooth:
            raise ValueError("face colours require a flat mesh; pass smooth=False")
        colors = np.repeat(np.asarray(visual.face_colors), 3, axis=0)
    elif visual.kind == "texture" and getattr(visual, "uv", None) is not None:
        coordinates = np.asarray(visual.uv, dtype=np.float64)
        coordinates = coordinates if smooth else coordinates[apart]
    vertices = np.asarray(mesh.vertices)
    return Primitive(
        vertices if smooth else vertices[apart],
        normals=mesh.vertex_normals if smooth else np.repeat(np.asarray(mesh.face_normals), 3, axis=0),
        texcoord_0=coordinates,
        color_0=colors,
        indices=faces if smooth else None,
        material=material,
        poses=poses,
    )


def _material_of(mesh: Any) -> Material:
    """Returns the material of a trimesh mesh.

    The result is a conversion of the mesh's own material. A mesh without a material is grey, or white with
    vertex or face colours.
    """
    if mesh.visual.kind == "texture" and mesh.visual.material is not None:
        return _converted(mesh.visual.material)
    colored = mesh.visual.kind in ("vertex", "face")
    return MetallicRoughnessMaterial(
        alphaMode="BLEND",
        baseColorFactor=[1.0, 1.0, 1.0, 1.0] if colored else [0.3, 0.3, 0.3, 1.0],
        metallicFactor=0.2,
        roughnessFactor=0.8,
    )


def _converted(given: Any) -> Material:
    """Returns the conversion of a trimesh material.

    A PBRMaterial keeps its values, and a SimpleMaterial becomes a metal with the same colour.
    """
    if isinstance(given, Material):
        return copy.copy(given)
    if hasattr(given, "baseColorFactor") or hasattr(given, "metallicFactor"):
        names = (
            "baseColorFactor",
            "baseColorTexture",
            "metallicFactor",
            "roughnessFactor",
            "metallicRoughnessTexture",
            "emissiveFactor",
            "emissiveTexture",
            "normalTexture",
            "occlusionTexture",
            "alphaCutoff",
        )
        values: dict[str, Any] = {name: getattr(given, name, None) for name in names}
        sides = bool(getattr(given, "doubleSided", False))
        return MetallicRoughnessMaterial(alphaMode="BLEND", doubleSided=sides, **values)
    shininess: Any = (getattr(given, "kwargs", None) or {}).get("Ns", 1.0)
    shininess = float(shininess[0] if isinstance(shininess, list) else shininess)
    return MetallicRoughnessMaterial(
        alphaMode="BLEND",
        baseColorFactor=np.asarray(given.diffuse),
        baseColorTexture=getattr(given, "image", None),
        roughnessFactor=(2 / (shininess + 2)) ** 0.25,
    )
