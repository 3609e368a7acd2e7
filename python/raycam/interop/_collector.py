"""Conversion of other libraries' meshes and materials to a world, through a GLB document."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from .. import _core
from ..camera import Camera
from ..errors import Notice, WorldError
from ..io.glb import GlbBuilder
from ..notices import warn_all
from ..srgb import linear_from_srgb
from ..world import World

__all__ = ["Array", "Up", "WorldCollector", "build_world", "default_material", "to_array", "to_linear"]

Up = Literal["z", "y"]
Array = npt.NDArray[Any]


class WorldCollector:
    """Objects, meshes, materials and textures of the world under construction."""

    def __init__(self) -> None:
        self.glb = GlbBuilder()
        self.notices: list[Notice] = []
        self.images: dict[int, int] = {}
        self.kept: list[Any] = []

    def add_notice(self, name: str, message: str) -> None:
        """Adds a notice about a mesh."""
        self.notices.append(Notice(message, "ignored_element", [name]))

    def add_mesh(
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
        """Adds a mesh; returns the mesh's index and the offset [3] subtracted from its vertices.

        The result is None for an empty mesh. The offset is the mesh's centre, so that float32 positions keep
        their precision, or 0 if the vertices are already float32 values. Arrays per vertex have the length of
        `vertices`. `materials` are pairs of a material and the indices [k] of its faces.
        """
        vertices = np.asarray(vertices, dtype=np.float64).reshape(-1, 3)
        faces = np.asarray(faces).reshape(-1, 3)
        if not len(faces):
            self.add_notice(name, "not shown, because it has no triangles")
            return None
        if not np.isfinite(vertices).all():
            count = int(np.count_nonzero(~np.isfinite(vertices).all(axis=1)))
            raise WorldError(
                f"{name}: vertices must be finite; {count} of {len(vertices)} contain NaN or infinite numbers",
                code="out_of_range",
            )
        if faces.min() < 0 or faces.max() >= len(vertices):
            raise WorldError(
                f"{name}: faces contain the indices {faces.min()} to {faces.max()}, expected 0 to {len(vertices) - 1}",
                code="index_out_of_range",
            )
        offset = np.zeros(3)
        if (vertices.astype(np.float32) != vertices).any():
            offset = (vertices.min(axis=0) + vertices.max(axis=0)) / 2
        attributes = {"POSITION": self.glb.floats(vertices - offset)}
        if normals is not None:
            attributes["NORMAL"] = self.glb.floats(normals)
        if uvs is not None:
            # In these libraries, v runs upwards; in glTF, v runs downwards.
            attributes["TEXCOORD_0"] = self.glb.floats(np.asarray(uvs) * [1, -1] + [0, 1])
        if colors is not None:
            attributes["COLOR_0"] = self.glb.floats(colors)
        primitives = []
        for material, chosen in materials or [(None, np.arange(len(faces)))]:
            part = {"attributes": attributes, "indices": self.glb.indices(faces[chosen])}
            primitives.append(part if material is None else {**part, "material": material})
        return self.glb.add("meshes", name=name, primitives=primitives), offset

    def add_object(self, name: str, mesh: tuple[int, Array] | None, matrix: Array) -> None:
        """Adds an object with world_from_mesh [4, 4]."""
        if mesh is None:
            return
        index, offset = mesh
        placed = np.array(matrix, dtype=np.float64)
        placed[:3, 3] += placed[:3, :3] @ offset
        self.glb.add("nodes", name=name, mesh=index, matrix=placed.T.ravel().tolist())

    def texture(self, image: Any) -> dict[str, int] | None:
        """Returns a glTF reference to an image of PIL or Open3D, or to an array.

        The result is None if `image` is None, or if the image is not supported, with a notice.
        """
        if image is None:
            return None
        if id(image) not in self.images:
            if getattr(image, "mode", None) in ("P", "1", "LA", "PA", "CMYK", "I", "F"):
                image = image.convert("RGBA")
            pixels = to_array(image)
            if pixels.dtype != np.uint8 or pixels.ndim not in (2, 3) or not pixels.size:
                message = (
                    f"a texture of dtype {pixels.dtype} and shape {list(pixels.shape)} is omitted; "
                    "expected uint8 [h, w] or [h, w, c]"
                )
                self.notices.append(Notice(message, "ignored_element"))
                return None
            self.images[id(image)] = self.glb.texture(pixels)
            self.kept.append(image)
        return {"index": self.images[id(image)]}

    def world(self, name: str, up: Up, camera: tuple[str, Camera] | None = None) -> World:
        """Builds the world, named after `name`."""
        core = _core.world_from_gltf(self.glb.bytes(), name + ".glb", up, self.notices)
        world = World._of(core)
        warn_all(world.notices)
        if camera is not None:
            world.add_camera(camera[1], camera[0])
        return world


def build_world(collector: WorldCollector, name: str, up: Up, camera: tuple[str, Camera] | None) -> World:
    """Builds the world; raises `WorldError` if there are no triangles."""
    if not collector.glb._lists.get("nodes"):
        why = f" ({'; '.join(map(str, collector.notices))})" if collector.notices else ""
        raise WorldError(f"{name}: the geometry has no triangles{why}", code="nothing_visible")
    return collector.world(name, up, camera)


def default_material(collector: WorldCollector, colors: Array | None) -> int:
    """Adds the default material, which is matte and two-sided.

    The material is white for a mesh with colours, and otherwise light grey.
    """
    factor = [1.0, 1.0, 1.0, 1.0] if colors is not None else [0.8, 0.8, 0.8, 1.0]
    faint = colors is not None and colors.shape[1] == 4 and (colors[:, 3] < 1).any()
    return collector.glb.add(
        "materials",
        pbrMetallicRoughness={"baseColorFactor": factor, "metallicFactor": 0.0, "roughnessFactor": 1.0},
        doubleSided=True,
        alphaMode="BLEND" if faint else None,
    )


def to_array(image: Any) -> Array:
    """Returns an image (Open3D's legacy or tensor image, or any array) as an array."""
    return image.as_tensor().cpu().numpy() if hasattr(image, "as_tensor") else np.asarray(image)


def to_linear(colors: Any) -> Array:
    """Converts sRGB colours [n, 3 or 4], integers or floats in 0..1, to linear.

    Opacity is unchanged; an opacity of 1 in all rows is omitted, and the result is [n, 3].
    """
    array = np.asarray(colors)
    array = (
        array / np.iinfo(array.dtype).max if array.dtype.kind == "u" else np.clip(array.astype(float), 0, 1)
    )
    linear = array.copy()
    rgb = array[:, :3]
    linear[:, :3] = linear_from_srgb(rgb)
    opaque = array.shape[1] == 4 and (array[:, 3] == 1).all()
    return linear[:, :3] if opaque else linear
