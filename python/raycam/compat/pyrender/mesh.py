"""Meshes of pyrender: primitives that are placed together."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from .constants import GLTF
from .material import Material, MetallicRoughnessMaterial
from .primitive import Primitive

__all__ = ["Mesh"]

Floats = npt.NDArray[Any]


class Bounded:
    """Something with bounds, in its own coordinates."""

    @property
    def bounds(self) -> Floats:
        """The lower and upper corner [2, 3]."""
        raise NotImplementedError

    @property
    def centroid(self) -> Floats:
        """The centre of the bounds."""
        return np.asarray(self.bounds.mean(axis=0))

    @property
    def extents(self) -> Floats:
        """The lengths of the sides of the bounds."""
        return np.asarray(np.diff(self.bounds, axis=0)[0])

    @property
    def scale(self) -> float:
        """The length of the diagonal of the bounds."""
        return float(np.linalg.norm(self.extents))


class Mesh(Bounded):
    """A list of primitives; `is_visible` may be assigned to."""

    def __init__(
        self,
        primitives: Sequence[Primitive],
        name: str | None = None,
        weights: Any = None,
        is_visible: bool = True,
    ) -> None:
        self.primitives = list(primitives)
        self.name, self.weights, self.is_visible = name, weights, bool(is_visible)

    @property
    def bounds(self) -> Floats:
        """The lower and upper corner [2, 3]."""
        each = np.array([primitive.bounds for primitive in self.primitives])
        return np.stack([each[:, 0].min(axis=0), each[:, 1].max(axis=0)])

    @property
    def is_transparent(self) -> bool:
        """True if any primitive is."""
        return any(primitive.is_transparent for primitive in self.primitives)

    @staticmethod
    def from_points(
        points: npt.ArrayLike,
        colors: npt.ArrayLike | None = None,
        normals: npt.ArrayLike | None = None,
        is_visible: bool = True,
        poses: npt.ArrayLike | None = None,
    ) -> Mesh:
        """Points as squares of the renderer's `point_size` pixels, unlit."""
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
        """Triangles of a `trimesh.Trimesh` or of several.

        Raises `TypeError` for anything else and `ValueError` for colours of faces with `smooth=True`.
        """
        meshes = list(mesh) if isinstance(mesh, list | tuple | set | np.ndarray) else [mesh]
        if wireframe:
            raise NotImplementedError("wireframe=True: lines are not rendered")
        for one in meshes:
            if not (hasattr(one, "faces") and hasattr(one, "vertices")):
                raise TypeError(f"expected a trimesh.Trimesh or a list of them, not {type(one).__name__}")
        return Mesh([_primitive(one, material, poses, smooth) for one in meshes], is_visible=is_visible)


def _primitive(mesh: Any, material: Material | None, poses: npt.ArrayLike | None, smooth: bool) -> Primitive:
    faces, visual = np.asarray(mesh.faces), mesh.visual
    colors = coordinates = None
    if visual.kind == "vertex":
        colors = np.asarray(visual.vertex_colors)
    elif visual.kind == "face":
        if smooth:
            raise ValueError("a smooth mesh has no colours of faces: give smooth=False")
        colors = np.repeat(np.asarray(visual.face_colors), 3, axis=0)
    elif visual.kind == "texture" and getattr(visual, "uv", None) is not None:
        coordinates = np.asarray(visual.uv, dtype=np.float64)
    if material is None and visual.kind == "texture":
        material = _material(visual.material)
    if smooth:
        return Primitive(
            mesh.vertices,
            normals=mesh.vertex_normals,
            texcoord_0=coordinates,
            color_0=colors,
            indices=faces,
            material=material,
            poses=poses,
        )
    apart = faces.reshape(-1)
    if visual.kind == "vertex" and colors is not None:
        colors = colors[apart]
    return Primitive(
        np.asarray(mesh.vertices)[apart],
        normals=np.repeat(np.asarray(mesh.face_normals), 3, axis=0),
        texcoord_0=None if coordinates is None else coordinates[apart],
        color_0=colors,
        material=material,
        poses=poses,
    )


def _material(given: Any) -> MetallicRoughnessMaterial | None:
    """The material of one of trimesh: of a PBRMaterial its values, of a SimpleMaterial what comes near."""
    if given is None:
        return None
    if hasattr(given, "baseColorFactor") or hasattr(given, "metallicFactor"):

        def value(name: str, otherwise: Any) -> Any:
            found = getattr(given, name, None)
            return otherwise if found is None else found

        return MetallicRoughnessMaterial(
            baseColorFactor=value("baseColorFactor", None),
            baseColorTexture=value("baseColorTexture", None),
            metallicFactor=value("metallicFactor", 1.0),
            roughnessFactor=value("roughnessFactor", 1.0),
            metallicRoughnessTexture=value("metallicRoughnessTexture", None),
            emissiveFactor=value("emissiveFactor", None),
            emissiveTexture=value("emissiveTexture", None),
            alphaMode=value("alphaMode", None),
            doubleSided=value("doubleSided", False),
        )
    shininess = float(getattr(given, "glossiness", 1.0) or 0.0)
    return MetallicRoughnessMaterial(
        alphaMode="BLEND",
        baseColorFactor=np.asarray(given.diffuse),
        baseColorTexture=getattr(given, "image", None),
        metallicFactor=0.0,
        roughnessFactor=(2 / (shininess + 2)) ** 0.25,
    )
