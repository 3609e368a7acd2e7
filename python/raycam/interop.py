"""Worlds from the meshes of other libraries, by what their objects have: neither library is imported."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from . import _core
from .camera import Camera
from .errors import WorldError
from .glb import Glb
from .world import World

__all__ = ["from_open3d", "from_trimesh"]

Up = Literal["z", "y"]
Array = npt.NDArray[Any]


class _Collector:
    """What becomes a world."""

    def __init__(self) -> None:
        self.glb = Glb()
        self.notices: list[str] = []
        self.images: dict[int, int] = {}
        self.kept: list[Any] = []

    def note(self, name: str, message: str) -> None:
        self.notices.append(f"{name}: {message}")

    def mesh(
        self,
        name: str,
        vertices: Array,
        faces: Array,
        *,
        normals: Array | None = None,
        colors: Array | None = None,
        uvs: Array | None = None,
        materials: list[tuple[int | None, Array]] | None = None,
    ) -> tuple[int, Array] | None:
        """A mesh and the offset of its origin: float32 positions lie around it, unless they are float32 already.

        Per-vertex arrays are as long as `vertices`; `materials` are pairs of a material and the faces [k] it has.
        """
        vertices = np.asarray(vertices, dtype=np.float64).reshape(-1, 3)
        faces = np.asarray(faces).reshape(-1, 3)
        if not len(faces):
            self.note(name, "no triangles: nothing to see")
            return None
        if not np.isfinite(vertices).all():
            raise WorldError(f"{name}: vertices must be finite")
        if faces.min() < 0 or faces.max() >= len(vertices):
            raise WorldError(
                f"{name}: faces from {faces.min()} to {faces.max()}, but there are {len(vertices)} vertices"
            )
        offset = np.zeros(3)
        if (vertices.astype(np.float32) != vertices).any():
            offset = (vertices.min(axis=0) + vertices.max(axis=0)) / 2
        attributes = {"POSITION": self.glb.floats(vertices - offset)}
        if normals is not None:
            attributes["NORMAL"] = self.glb.floats(normals)
        if uvs is not None:
            # Their v runs up.
            attributes["TEXCOORD_0"] = self.glb.floats(np.asarray(uvs) * [1, -1] + [0, 1])
        if colors is not None:
            attributes["COLOR_0"] = self.glb.floats(colors)
        primitives = []
        for material, chosen in materials or [(None, np.arange(len(faces)))]:
            part = {"attributes": attributes, "indices": self.glb.indices(faces[chosen])}
            primitives.append(part if material is None else {**part, "material": material})
        return self.glb.add("meshes", name=name, primitives=primitives), offset

    def place(self, name: str, mesh: tuple[int, Array] | None, matrix: Array) -> None:
        """An object."""
        if mesh is None:
            return
        index, offset = mesh
        placed = np.array(matrix, dtype=np.float64)
        placed[:3, 3] += placed[:3, :3] @ offset
        self.glb.add("nodes", name=name, mesh=index, matrix=placed.T.ravel().tolist())

    def texture(self, image: Any) -> dict[str, int] | None:
        """A reference to an image: a PIL one, an Open3D one, or an array."""
        if image is None:
            return None
        if id(image) not in self.images:
            if getattr(image, "mode", None) in ("P", "1", "LA", "PA", "CMYK", "I", "F"):
                image = image.convert("RGBA")
            source = image.as_tensor().numpy() if hasattr(image, "as_tensor") else image
            pixels = np.asarray(source)
            if pixels.dtype != np.uint8 or pixels.ndim not in (2, 3) or not pixels.size:
                self.notices.append(
                    f"a texture of dtype {pixels.dtype} and shape {list(pixels.shape)} is left out"
                )
                return None
            self.images[id(image)] = self.glb.texture(pixels)
            self.kept.append(image)
        return {"index": self.images[id(image)]}

    def world(self, name: str, up: Up, camera: tuple[str, Camera] | None = None) -> World:
        core = _core.world_from_gltf(self.glb.bytes(), name + ".glb", up, self.notices)
        world = World._of(core)
        if camera is not None:
            world.add_camera(camera[1], camera[0])
        return world


def from_trimesh(geometry: Any, *, up: Up = "z", smooth: bool = False) -> World:
    """The world of a `trimesh.Trimesh` or `trimesh.Scene`.

    Triangles, the colours of faces or vertices (sRGB), texture coordinates with their materials (simple and PBR) and
    images, the scene's graph as objects that share meshes, and its camera where it has one of its own. `smooth` shades
    by trimesh's vertex normals; otherwise faces are flat. Positions that float32 cannot hold are kept to 2^-24 of the
    mesh's size. Paths and point clouds have no surface: they are left out, with a notice.

    Raises `WorldError` for what has no triangles at all, vertices that are not finite and indices out of range.
    """
    collector = _Collector()
    if not hasattr(geometry, "geometry"):
        if not hasattr(geometry, "faces"):
            raise WorldError(f"expected a trimesh.Trimesh or trimesh.Scene, not {type(geometry).__name__}")
        collector.place("mesh", _trimesh(collector, "mesh", geometry, smooth), np.eye(4))
        return _finished(collector, "trimesh", up, None)
    meshes: dict[str, tuple[int, Array] | None] = {}
    for node in geometry.graph.nodes_geometry:
        matrix, name = geometry.graph[node]
        if name not in meshes:
            mesh = geometry.geometry[name]
            if hasattr(mesh, "faces"):
                meshes[name] = _trimesh(collector, name, mesh, smooth)
            else:
                collector.note(name, f"a {type(mesh).__name__} has no surface: left out")
                meshes[name] = None
        collector.place(str(node), meshes[name], matrix)
    camera = None
    if geometry.has_camera:
        lens = geometry.camera
        size = tuple(int(side) for side in lens.resolution)
        pose = np.asarray(geometry.camera_transform)
        camera = ("camera", Camera.from_opengl(lens.K, pose, size, pixel_center="half"))
    return _finished(collector, "trimesh", up, camera)


def _finished(collector: _Collector, name: str, up: Up, camera: tuple[str, Camera] | None) -> World:
    if not collector.glb._lists.get("nodes"):
        raise WorldError(f"{name}: there are no triangles: nothing to see ({'; '.join(collector.notices)})")
    return collector.world(name, up, camera)


def _trimesh(collector: _Collector, name: str, mesh: Any, smooth: bool) -> tuple[int, Array] | None:
    vertices, faces = np.asarray(mesh.vertices), np.asarray(mesh.faces)
    normals = np.asarray(mesh.vertex_normals) if smooth else None
    colors = uvs = material = None
    visual = mesh.visual
    if visual.kind == "texture":
        uvs = None if visual.uv is None or len(visual.uv) != len(vertices) else np.asarray(visual.uv)
        material = _trimesh_material(collector, visual.material, textured=uvs is not None)
    elif visual.kind == "vertex":
        colors = _linear(visual.vertex_colors)
    elif visual.kind == "face":
        # Faces have colours of their own where they share no corners.
        colors = np.repeat(_linear(visual.face_colors), 3, axis=0)
        normals = None if normals is None else normals[faces.ravel()]
        vertices, faces = vertices[faces.ravel()], np.arange(faces.size).reshape(-1, 3)
    if material is None:
        material = _plain(collector, colors)
    return collector.mesh(
        name, vertices, faces, normals=normals, colors=colors, uvs=uvs,
        materials=[(material, np.arange(len(faces)))],
    )  # fmt: skip


def _plain(collector: _Collector, colors: Array | None) -> int:
    """White where there are colours, else light grey; as raycam's own meshes are: matte, seen from both sides."""
    factor = [1.0, 1.0, 1.0, 1.0] if colors is not None else [0.8, 0.8, 0.8, 1.0]
    faint = colors is not None and colors.shape[1] == 4 and (colors[:, 3] < 1).any()
    return collector.glb.add(
        "materials",
        pbrMetallicRoughness={"baseColorFactor": factor, "metallicFactor": 0.0, "roughnessFactor": 1.0},
        doubleSided=True,
        alphaMode="BLEND" if faint else None,
    )


def _trimesh_material(collector: _Collector, material: Any, *, textured: bool) -> int | None:
    """trimesh's PBR material, which is glTF's; a simple one as trimesh converts it."""
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
    """A factor of glTF; trimesh keeps some as bytes, 255 for 1."""
    if value is None:
        return None
    array = np.asarray(value)
    array = array / 255 if array.dtype.kind in "iu" else array.astype(float)
    return [float(v) for v in np.append(array, np.ones(count))[:count]]


def from_open3d(geometry: Any, *, up: Up = "z", smooth: bool = False) -> World:
    """The world of Open3D's `TriangleMesh` (legacy or tensor), `TriangleMeshModel`, or several of them.

    Triangles, vertex colours (sRGB, as Open3D shows them), texture coordinates with one image for each material index,
    and the materials of models and tensor meshes. `smooth` shades by the vertex normals that a mesh has. Positions that
    float32 cannot hold are kept to 2^-24 of the mesh's size.

    Raises `WorldError` as `from_trimesh` does.
    """
    collector = _Collector()
    several = isinstance(geometry, Iterable) and not hasattr(geometry, "vertex")
    for number, mesh in enumerate(geometry if several else [geometry]):
        if hasattr(mesh, "meshes") and hasattr(mesh, "materials"):
            made = [_open3d_material(collector, material) for material in mesh.materials]
            for part in mesh.meshes:
                own = made[part.material_idx] if part.material_idx < len(made) else None
                name = part.mesh_name or f"mesh {number}"
                collector.place(name, _open3d(collector, name, part.mesh, smooth, own), np.eye(4))
        else:
            name = f"mesh {number}" if several else "mesh"
            collector.place(name, _open3d(collector, name, mesh, smooth, None), np.eye(4))
    return _finished(collector, "open3d", up, None)


def _open3d(
    collector: _Collector, name: str, mesh: Any, smooth: bool, material: int | None
) -> tuple[int, Array] | None:
    if hasattr(mesh, "to_legacy"):
        if mesh.has_valid_material():
            material = _open3d_material(collector, mesh.material.to_material_record())
        mesh = mesh.to_legacy()
    if not (hasattr(mesh, "triangles") and hasattr(mesh, "vertices")):
        raise WorldError(f"{name}: expected an Open3D TriangleMesh, not {type(mesh).__name__}")
    vertices, faces = np.asarray(mesh.vertices), np.asarray(mesh.triangles)
    normals = np.asarray(mesh.vertex_normals) if smooth and mesh.has_vertex_normals() else None
    colors = _linear(np.asarray(mesh.vertex_colors)) if mesh.has_vertex_colors() else None
    uvs = np.asarray(mesh.triangle_uvs) if mesh.has_triangle_uvs() else None
    chosen = [(material, np.arange(len(faces)))]
    if uvs is not None:
        corners = faces.ravel()
        vertices, faces = vertices[corners], np.arange(corners.size).reshape(-1, 3)
        normals = None if normals is None else normals[corners]
        colors = None if colors is None else colors[corners]
        if material is None and mesh.has_textures():
            ids = np.asarray(mesh.triangle_material_ids)
            ids = ids if len(ids) == len(faces) else np.zeros(len(faces), int)
            images = [collector.texture(image) for image in mesh.textures]
            made = [_textured(collector, image) for image in images]
            chosen = [
                (made[i] if 0 <= i < len(made) else None, np.flatnonzero(ids == i)) for i in np.unique(ids)
            ]
    default = _plain(collector, colors)
    chosen = [(default if own is None else own, part) for own, part in chosen]
    return collector.mesh(name, vertices, faces, normals=normals, colors=colors, uvs=uvs, materials=chosen)


def _textured(collector: _Collector, image: dict[str, int] | None) -> int | None:
    if image is None:
        return None
    pbr = {"baseColorTexture": image, "metallicFactor": 0.0, "roughnessFactor": 1.0}
    return collector.glb.add("materials", pbrMetallicRoughness=pbr, doubleSided=True)


def _open3d_material(collector: _Collector, record: Any) -> int:
    """A `MaterialRecord`. Its images of roughness and metalness are apart: put into one, as glTF has them."""
    image = collector.texture
    pbr: dict[str, Any] = {
        "baseColorFactor": [float(v) for v in np.clip(record.base_color, 0, 1)],
        "metallicFactor": float(record.base_metallic),
        "roughnessFactor": float(record.base_roughness),
    }
    if _has(record.albedo_img):
        pbr["baseColorTexture"] = image(record.albedo_img)
    packed = _packed(record)
    if packed is not None:
        pbr["metallicRoughnessTexture"] = image(packed)
    unlit: dict[str, Any] | None = {"KHR_materials_unlit": {}} if "Unlit" in str(record.shader) else None
    return collector.glb.add(
        "materials",
        pbrMetallicRoughness=pbr,
        normalTexture=image(record.normal_img) if _has(record.normal_img) else None,
        occlusionTexture=image(record.ao_img) if _has(record.ao_img) else None,
        alphaMode="BLEND" if getattr(record, "has_alpha", False) else None,
        doubleSided=True,
        extensions=unlit,
    )


def _has(image: Any) -> bool:
    return image is not None and not image.is_empty()


def _packed(record: Any) -> Array | None:
    """Roughness in green and metalness in blue, 1 where an image is missing."""
    if _has(getattr(record, "ao_rough_metal_img", None)):
        return np.asarray(record.ao_rough_metal_img)
    parts = [
        np.asarray(image) if _has(image) else None for image in (record.roughness_img, record.metallic_img)
    ]
    first = next((part for part in parts if part is not None), None)
    if first is None or any(part is not None and part.shape[:2] != first.shape[:2] for part in parts):
        return None
    pixels = np.full((*first.shape[:2], 3), 255, np.uint8)
    for channel, part in enumerate(parts, start=1):
        if part is not None:
            pixels[..., channel] = part if part.ndim == 2 else part[..., 0]
    return pixels


def _linear(colors: Any) -> Array:
    """Linear colours [n, 3 or 4] of sRGB ones, bytes or 0..1; opacity stays."""
    array = np.asarray(colors)
    array = array / 255 if array.dtype == np.uint8 else np.clip(array.astype(float), 0, 1)
    linear = array.copy()
    rgb = array[:, :3]
    linear[:, :3] = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    opaque = array.shape[1] == 4 and (array[:, 3] == 1).all()
    return linear[:, :3] if opaque else linear
