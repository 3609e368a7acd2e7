"""Creates worlds from Open3D meshes without importing Open3D.

The meshes are recognised by their attributes.
"""

from __future__ import annotations

from collections.abc import Iterable
from types import SimpleNamespace
from typing import Any

import numpy as np

from ..errors import WorldError
from ..world import World
from ._collector import Array, Up, WorldCollector, build_world, default_material, to_array, to_linear

__all__ = ["from_open3d"]


def from_open3d(geometry: Any, *, up: Up = "z", smooth: bool = False) -> World:
    """Creates a world from one or several Open3D meshes.

    A mesh is a `TriangleMesh` (legacy or tensor) or a `TriangleMeshModel`. Triangles, vertex colours (sRGB, as Open3D
    shows them), texture coordinates with one image for each material index, and the materials of models and tensor
    meshes are imported. `smooth` shades with the mesh's vertex normals. `up` is the world's up axis. Positions are
    rounded to 2^-24 of the mesh's size, unless they are float32 values.

    Raises the errors of `from_trimesh`.
    """
    collector = WorldCollector()
    several = isinstance(geometry, Iterable) and not hasattr(geometry, "vertex")
    for number, mesh in enumerate(geometry if several else [geometry]):
        if hasattr(mesh, "meshes") and hasattr(mesh, "materials"):
            made = [_open3d_material(collector, material) for material in mesh.materials]
            for part in mesh.meshes:
                own = made[part.material_idx] if part.material_idx < len(made) else None
                name = part.mesh_name or f"mesh {number}"
                collector.add_object(name, _open3d(collector, name, part.mesh, smooth, own), np.eye(4))
        else:
            name = f"mesh {number}" if several else "mesh"
            collector.add_object(name, _open3d(collector, name, mesh, smooth, None), np.eye(4))
    return build_world(collector, "open3d", up, None)


def _open3d(
    collector: WorldCollector, name: str, mesh: Any, smooth: bool, material: int | None
) -> tuple[int, Array] | None:
    painted = None
    # Open3D's tensor point clouds and line sets also have `to_legacy`, but no triangles.
    if hasattr(mesh, "to_legacy") and hasattr(mesh, "triangle"):
        if mesh.has_valid_material():
            material = _open3d_material(collector, _record(mesh.material))
        if "colors" in mesh.triangle:
            painted = to_linear(mesh.triangle["colors"].cpu().numpy())
        mesh = mesh.to_legacy()
    if not (hasattr(mesh, "triangles") and hasattr(mesh, "vertices")):
        raise WorldError(
            f"{name}: expected an Open3D TriangleMesh, not {type(mesh).__name__}", code="wrong_type"
        )
    vertices, faces = np.asarray(mesh.vertices), np.asarray(mesh.triangles)
    normals = np.asarray(mesh.vertex_normals) if smooth and mesh.has_vertex_normals() else None
    colors = to_linear(np.asarray(mesh.vertex_colors)) if mesh.has_vertex_colors() else None
    uvs = np.asarray(mesh.triangle_uvs) if mesh.has_triangle_uvs() else None
    chosen = [(material, np.arange(len(faces)))]
    if uvs is not None or painted is not None:
        # Texture coordinates belong to corners and colours to faces, so each triangle gets its own vertices.
        corners = faces.ravel()
        vertices, faces = vertices[corners], np.arange(corners.size).reshape(-1, 3)
        normals = None if normals is None else normals[corners]
        colors = None if colors is None else colors[corners]
        colors = colors if painted is None else np.repeat(painted, 3, axis=0)
        if uvs is not None and material is None and mesh.has_textures():
            ids = np.asarray(mesh.triangle_material_ids)
            ids = ids if len(ids) == len(faces) else np.zeros(len(faces), int)
            images = [collector.texture(image) for image in mesh.textures]
            made = [_textured(collector, image) for image in images]
            chosen = [
                (made[i] if 0 <= i < len(made) else None, np.flatnonzero(ids == i)) for i in np.unique(ids)
            ]
    default = default_material(collector, colors)
    chosen = [(default if own is None else own, part) for own, part in chosen]
    return collector.add_mesh(
        name, vertices, faces, normals=normals, colors=colors, uvs=uvs, materials=chosen
    )


def _textured(collector: WorldCollector, image: dict[str, int] | None) -> int | None:
    if image is None:
        return None
    pbr = {"baseColorTexture": image, "metallicFactor": 0.0, "roughnessFactor": 1.0}
    return collector.glb.add("materials", pbrMetallicRoughness=pbr, doubleSided=True)


# The images, numbers and colours of a tensor mesh's material, by their names in a `MaterialRecord`.
IMAGES = {"ao": "ambient_occlusion"} | {
    name: name for name in ("albedo", "normal", "roughness", "metallic", "ao_rough_metal")
}
NUMBERS = {
    "metallic": 0.0,
    "roughness": 1.0,
    "reflectance": 0.5,
    "clear_coat": 0.0,
    "clear_coat_roughness": 0.0,
}
COLORS = {"base_color": (1.0, 1.0, 1.0, 1.0), "emissive_color": (0.0, 0.0, 0.0, 1.0)}


def _record(material: Any) -> Any:
    """Returns a substitute for the `MaterialRecord` of a tensor mesh's `Material`.

    The substitute is necessary, because a real record needs a display.
    """
    maps, scalars, vectors = (
        dict(table)
        for table in (material.texture_maps, material.scalar_properties, material.vector_properties)
    )
    images = {f"{name}_img": maps.get(key) for name, key in IMAGES.items()}
    numbers = {
        f"base_{key.replace('clear_coat', 'clearcoat')}": scalars.get(key, default)
        for key, default in NUMBERS.items()
    }
    colors = {key: vectors.get(key, default) for key, default in COLORS.items()}
    return SimpleNamespace(shader=material.material_name, **images, **numbers, **colors)


def _open3d_material(collector: WorldCollector, record: Any) -> int:
    """Adds a `MaterialRecord` as a glTF material.

    The record's separate images of roughness and metalness are packed into one image, as in glTF.
    """

    def image(name: str) -> dict[str, int] | None:
        found = getattr(record, name, None)
        return collector.texture(found) if _has(found) else None

    pbr: dict[str, Any] = {
        "baseColorFactor": [float(v) for v in np.clip(record.base_color, 0, 1)],
        "metallicFactor": float(record.base_metallic),
        "roughnessFactor": float(record.base_roughness),
        "baseColorTexture": image("albedo_img"),
        "metallicRoughnessTexture": collector.texture(_packed(record)),
    }
    extensions: dict[str, Any] = {}
    if "Unlit" in str(record.shader):
        extensions["KHR_materials_unlit"] = {}
    coat = float(getattr(record, "base_clearcoat", 0.0))
    if coat > 0:
        rough = float(getattr(record, "base_clearcoat_roughness", 0.0))
        extensions["KHR_materials_clearcoat"] = {
            "clearcoatFactor": min(coat, 1.0),
            "clearcoatRoughnessFactor": min(max(rough, 0.0), 1.0),
        }
    reflectance = float(getattr(record, "base_reflectance", 0.5))
    if reflectance != 0.5:
        # Filament's reflectance: F0 = 0.16 reflectance^2.
        root = 0.4 * min(max(reflectance, 0.0), 1.0)
        extensions["KHR_materials_ior"] = {"ior": (1 + root) / (1 - root)}
    emission = [float(v) for v in np.clip(getattr(record, "emissive_color", np.zeros(3)), 0, 1)[:3]]
    return collector.glb.add(
        "materials",
        pbrMetallicRoughness={key: value for key, value in pbr.items() if value is not None},
        normalTexture=image("normal_img"),
        occlusionTexture=image("ao_img"),
        emissiveFactor=emission if any(emission) else None,
        alphaMode="BLEND" if getattr(record, "has_alpha", False) else None,
        doubleSided=True,
        extensions=extensions or None,
    )


def _has(image: Any) -> bool:
    return image is not None and not image.is_empty()


def _packed(record: Any) -> Array | None:
    """Packs roughness into green and metalness into blue; a missing image counts as 1."""
    if _has(getattr(record, "ao_rough_metal_img", None)):
        return to_array(record.ao_rough_metal_img)
    parts = [
        to_array(image) if _has(image) else None for image in (record.roughness_img, record.metallic_img)
    ]
    first = next((part for part in parts if part is not None), None)
    if first is None or any(part is not None and part.shape[:2] != first.shape[:2] for part in parts):
        return None
    pixels = np.full((*first.shape[:2], 3), 255, np.uint8)
    for channel, part in enumerate(parts, start=1):
        if part is not None:
            pixels[..., channel] = part if part.ndim == 2 else part[..., 0]
    return pixels
