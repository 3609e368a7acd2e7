"""Creates worlds from trimesh meshes without importing trimesh.

The meshes are recognised by their attributes.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..camera import Camera
from ..errors import WorldError
from ..world import World
from ._collector import Array, Up, WorldCollector, build_world, default_material, to_linear

__all__ = ["from_trimesh"]


def from_trimesh(geometry: Any, *, up: Up = "z", smooth: bool = False) -> World:
    """Creates a world from a `trimesh.Trimesh` or `trimesh.Scene`.

    Triangles, colours of faces or vertices (sRGB), texture coordinates with materials (simple and PBR) and images, the
    scene graph (as objects that share meshes), and the scene's own camera are imported. `smooth` shades with trimesh's
    vertex normals; otherwise faces are flat. `up` is the world's up axis. Positions are rounded to 2^-24 of the mesh's
    size, unless they are float32 values. Paths and point clouds have no surface and are omitted, with a notice.

    Raises `WorldError` for geometry without triangles, vertices that are not finite and indices out of range.
    """
    collector = WorldCollector()
    if not hasattr(geometry, "geometry"):
        if not hasattr(geometry, "faces"):
            raise WorldError(
                f"expected a trimesh.Trimesh or trimesh.Scene, not {type(geometry).__name__}",
                code="wrong_type",
            )
        collector.add_object("mesh", _trimesh(collector, "mesh", geometry, smooth), np.eye(4))
        return build_world(collector, "trimesh", up, None)
    meshes: dict[str, tuple[int, Array] | None] = {}
    for node in geometry.graph.nodes_geometry:
        matrix, name = geometry.graph[node]
        if name not in meshes:
            mesh = geometry.geometry[name]
            if hasattr(mesh, "faces"):
                meshes[name] = _trimesh(collector, name, mesh, smooth)
            else:
                collector.add_notice(name, f"a {type(mesh).__name__} has no surface and is not shown")
                meshes[name] = None
        collector.add_object(str(node), meshes[name], matrix)
    camera = None
    if geometry.has_camera:
        lens = geometry.camera
        size = tuple(int(side) for side in lens.resolution)
        pose = np.asarray(geometry.camera_transform)
        camera = ("camera", Camera.from_opengl(lens.K, pose, size, pixel_center="half"))
    return build_world(collector, "trimesh", up, camera)


def _trimesh(collector: WorldCollector, name: str, mesh: Any, smooth: bool) -> tuple[int, Array] | None:
    vertices, faces = np.asarray(mesh.vertices), np.asarray(mesh.faces)
    normals = np.asarray(mesh.vertex_normals) if smooth else None
    colors = uvs = material = None
    visual = mesh.visual
    if visual.kind == "texture":
        uvs = None if visual.uv is None or len(visual.uv) != len(vertices) else np.asarray(visual.uv)
        material = _trimesh_material(collector, visual.material, textured=uvs is not None)
        # If a file also has vertex colours, which multiply the texture, trimesh stores these colours separately.
        beside = visual.vertex_attributes.get("color")
        colors = None if beside is None or len(beside) != len(vertices) else to_linear(beside)
    elif visual.kind == "vertex":
        colors = to_linear(visual.vertex_colors)
    elif visual.kind == "face":
        # Colours belong to faces, so each face gets its own vertices.
        colors = np.repeat(to_linear(visual.face_colors), 3, axis=0)
        normals = None if normals is None else normals[faces.ravel()]
        vertices, faces = vertices[faces.ravel()], np.arange(faces.size).reshape(-1, 3)
    if material is None:
        material = default_material(collector, colors)
    return collector.add_mesh(
        name, vertices, faces, normals=normals, colors=colors, uvs=uvs,
        materials=[(material, np.arange(len(faces)))],
    )  # fmt: skip


def _trimesh_material(collector: WorldCollector, material: Any, *, textured: bool) -> int | None:
    """Adds trimesh's PBR material, which equals glTF's material.

    Simple materials are first converted to PBR materials by trimesh.
    """
    if material is None:
        return None
    if not hasattr(material, "baseColorFactor"):
        material = material.to_pbr()
    image = collector.texture if textured else lambda image: None
    pbr = {
        "baseColorFactor": _factor(material.baseColorFactor, 4),
        "baseColorTexture": image(material.baseColorTexture),
        "metallicFactor": material.metallicFactor,
        "roughnessFactor": material.roughnessFactor,
        "metallicRoughnessTexture": image(material.metallicRoughnessTexture),
    }
    return collector.glb.add(
        "materials",
        name=material.name,
        pbrMetallicRoughness={key: value for key, value in pbr.items() if value is not None},
        normalTexture=image(material.normalTexture),
        occlusionTexture=image(material.occlusionTexture),
        emissiveTexture=image(material.emissiveTexture),
        emissiveFactor=_factor(material.emissiveFactor, 3),
        alphaMode=material.alphaMode,
        alphaCutoff=material.alphaCutoff,
        doubleSided=bool(material.doubleSided),
    )


def _factor(value: Any, count: int) -> list[float] | None:
    """A glTF factor; trimesh stores some factors as bytes, with 255 for 1."""
    if value is None:
        return None
    array = np.asarray(value)
    array = array / 255 if array.dtype.kind in "iu" else array.astype(float)
    return [float(v) for v in np.append(array, np.ones(count))[:count]]
