"""Collada meshes (.dae, .zae) as GLB documents, read by `pycollada`: the `raycam[robots]` extra."""

from __future__ import annotations

import importlib.util
import math
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from .. import _core
from ..arguments import Floats
from ..errors import FormatError, Notice, SettingsError
from ..io.glb import GlbBuilder
from ..srgb import linear_from_srgb
from .collada_archive import ARCHIVE_ENDING, unpack_collada
from .collada_document import ColladaDocument
from .collada_scene import placed_geometries
from .resolve import read_bytes
from .xml_tree import XmlLimits

__all__ = ["collada_to_glb"]

MAX_NODE_TRIANGLES = 1 << 24
"""Maximum number of triangles per file, counted for every node that shows them."""
MAX_COORDINATE = 1e30
"""Largest coordinate in metres: float32 holds squares of differences up to 1e38."""
IMAGE_TYPES = {b"\x89PNG": "image/png", b"\xff\xd8\xff": "image/jpeg"}
"""First bytes and media type of images that glTF embeds without conversion."""
DEFAULT_COLOR = (0.8, 0.8, 0.8)
"""sRGB colour of a material without a diffuse colour."""

TO_Z_UP = {"Y_UP": [[1, 0, 0], [0, 0, -1], [0, 1, 0]], "X_UP": [[0, -1, 0], [0, 0, -1], [1, 0, 0]]}
"""Rotations from other up axes to z (COLLADA 1.4.1, chapter 5, `up_axis`)."""


def collada_to_glb(
    path: Path,
    find_image: Callable[[str], Path],
    scale: tuple[float, float, float] = (1.0, 1.0, 1.0),
    *,
    up_axis: str = "ignore",
) -> tuple[bytes, list[Notice]]:
    """Returns a Collada file as GLB with one node, and notices.

    Of an archive (.zae), only the archive's own files are read. The file's unit is applied. The file's up axis is
    ignored, as in RViz, or with `up_axis="apply"` turned to z.
    `find_image` returns the path of an image, or raises `OSError`. `scale` multiplies the coordinates; the
    orientation of mirrored triangles is reversed. Raises `OSError`, `FormatError` for malformed files, XML
    entities and files that exceed the memory limit, and `SettingsError` without the extra `raycam[robots]`.
    """
    if importlib.util.find_spec("collada") is None:
        raise SettingsError(
            f"{path}: reading Collada requires pycollada: pip install 'raycam[robots]'",
            code="missing_dependency",
        )
    with np.errstate(all="ignore"):  # `_Converter` refuses coordinates that are not finite
        if path.suffix.lower() == ARCHIVE_ENDING:
            with unpack_collada(path) as document:
                label = f"{path}/{document.name}"
                converter = _Converter(document.path, label, document.find, scale, up_axis)
                data, notices = converter.convert()
                return data, [*document.notices, *notices]
        return _Converter(path, os.fspath(path), find_image, scale, up_axis).convert()


class _Converter:
    """The state of a document's conversion."""

    def __init__(
        self,
        path: Path,
        label: str,
        find_image: Callable[[str], Path],
        scale: tuple[float, float, float],
        up_axis: str,
    ) -> None:
        self._name, self._label, self._find_image, self._up_axis = path.stem, label, find_image, up_axis
        self.notices: list[Notice] = []
        data = read_bytes(path, XmlLimits().bytes)
        self._document = ColladaDocument(data, label, self._note)
        self._unit = np.array(scale) * self._document.unit
        self._glb = GlbBuilder()
        self._materials: dict[str, int] = {}
        self._textures: dict[str, int | None] = {}
        self._primitives: list[dict[str, Any]] = []
        self._triangles = 0

    def convert(self) -> tuple[bytes, list[Notice]]:
        """Returns the GLB and the notices."""
        document = self._document
        turn = np.eye(4)
        if document.up_axis in TO_Z_UP and self._up_axis == "apply":
            turn[:3, :3] = TO_Z_UP[document.up_axis]
        elif document.up_axis in TO_Z_UP:
            text = (
                f"the up axis {document.up_axis} is ignored, as in RViz; if parts of the robot appear rotated, use"
                ' world.add_robot(..., up_axis="apply")'
            )
            self._note("ignored_key", text)
        for placed in placed_geometries(document, self._note):
            geometry = document.geometry(placed.geometry)
            if geometry is None:
                text = (
                    f"line {placed.line}: geometry {placed.geometry!r} is not shown: it is missing, faulty, or not a "
                    "<mesh>"
                )
                self._note("ignored_element", text)
                continue
            if placed.is_skin:
                self._note("ignored_feature", "skins and morphs are shown at rest")
            self._add_geometry(geometry, turn @ placed.matrix, placed.materials)
        if document.root.find("library_animations/animation") is not None:
            self._note("ignored_animation", "animations are ignored")
        if not self._primitives:
            raise FormatError(
                f"{self._label}: no triangles to show; expected nodes that refer to <triangles> or polygons",
                code="nothing_visible",
            )
        mesh = self._glb.add("meshes", name=self._name, primitives=self._primitives)
        self._glb.add("nodes", name=self._name, mesh=mesh)
        return self._glb.bytes(), list(dict.fromkeys(self.notices))

    def _note(self, code: str, text: str) -> None:
        self.notices.append(Notice(f"{self._label}: {text}", code))

    # Geometry -----------------------------------------------------------------------------------------------

    def _add_geometry(self, geometry: Any, matrix: Floats, materials: dict[str, str]) -> None:
        for part in geometry.primitives:
            if type(part).__name__ == "TriangleSet":
                triangles = part
            elif hasattr(part, "triangleset"):
                self._check_polygons(part)
                triangles = part.triangleset()
            else:
                text = (
                    f"line {part.xmlnode.line}: <{part.xmlnode.tag}> of geometry {geometry.id!r} is ignored; only "
                    "triangles and polygons are shown"
                )
                self._note("ignored_element", text)
                continue
            index = np.asarray(triangles.index)
            if not index.size:
                continue
            index = index.reshape(len(index) * 3 if index.ndim == 3 else -1, index.shape[-1])
            self._triangles += len(index) // 3
            if self._triangles > MAX_NODE_TRIANGLES:
                text = f"too many triangles; the limit is {MAX_NODE_TRIANGLES}"
                raise self._document.fail(part.xmlnode, text, "budget_exceeded")
            material = self._document.material(materials.get(triangles.material, ""))
            self._add_triangles(part, triangles.sources, index, matrix, material)

    def _check_polygons(self, part: Any) -> None:
        """Raises `FormatError` if the polygons' corner counts do not sum to the number of corners."""
        counts, corners = np.asarray(part.vcounts, np.int64), len(part.index)
        if (counts < 0).any() or counts.sum() != corners:
            text = f"<{part.xmlnode.tag}>: the corner counts add up to {counts.sum()}, but <p> has {corners} corners"
            raise self._document.fail(part.xmlnode, text, "wrong_shape")

    def _add_triangles(
        self, part: Any, sources: dict[str, list[Any]], index: Any, matrix: Floats, material: Any
    ) -> None:
        """Adds triangles: rows of `index` are the source indices of one corner."""
        corners, inverse = np.unique(index, axis=0, return_inverse=True)
        faces = inverse.reshape(-1, 3)
        linear = matrix[:3, :3] * self._unit[:, None]
        points = self._values(part, sources, "VERTEX", corners, 3)
        if points is None:
            raise self._document.fail(
                part.xmlnode, f"<{part.xmlnode.tag}> has no input with the semantic VERTEX", "missing_value"
            )
        with np.errstate(all="ignore"):
            points = points @ linear.T + matrix[:3, 3] * self._unit
            determinant = np.linalg.det(linear)
        if not (abs(points) <= MAX_COORDINATE).all():
            text = f"<{part.xmlnode.tag}>: coordinates must be finite and at most {MAX_COORDINATE:g} m"
            raise self._document.fail(part.xmlnode, text, "out_of_range")
        if determinant < 0:
            faces = faces[:, ::-1]
        attributes = {"POSITION": self._glb.floats(points)}
        normals = self._values(part, sources, "NORMAL", corners, 3)
        if normals is not None and np.isfinite(normals).all() and determinant != 0.0:
            normals = normals @ np.linalg.inv(linear)
            lengths = np.linalg.norm(normals, axis=1, keepdims=True)
            if np.isfinite(lengths).all() and (lengths > 0).all():
                attributes["NORMAL"] = self._glb.floats(normals / lengths)
        uvs = self._values(part, sources, "TEXCOORD", corners, 2)
        if uvs is not None and np.isfinite(uvs).all():
            attributes["TEXCOORD_0"] = self._glb.floats(uvs * [1, -1] + [0, 1])
        colors = self._values(part, sources, "COLOR", corners, 3)
        if colors is not None and np.isfinite(colors).all():
            attributes["COLOR_0"] = self._glb.floats(_linear(np.clip(colors, 0, 1)))
        number = self._material(material, colors is not None, uvs is not None)
        self._primitives.append(
            {"attributes": attributes, "indices": self._glb.indices(faces), "material": number}
        )

    def _values(
        self, part: Any, sources: dict[str, list[Any]], semantic: str, corners: Any, width: int
    ) -> Floats | None:
        """Returns the values [n, width] of the first source with the given semantic, or None."""
        for offset, _, _, _, source in sources.get(semantic, [])[:1]:
            data = np.asarray(source.data, np.float64)
            if data.ndim != 2 or data.shape[1] < width or not len(data):
                continue
            index = corners[:, offset]
            if offset < 0 or index.min() < 0 or index.max() >= len(data):
                text = (
                    f"<{part.xmlnode.tag}>: indices of {semantic} must be 0 to {len(data) - 1}, "
                    f"got {index.min()} to {index.max()} at offset {offset}"
                )
                raise self._document.fail(part.xmlnode, text, "index_out_of_range")
            found: Floats = data[index, :width]
            return found
        return None

    # Materials ----------------------------------------------------------------------------------------------

    def _material(self, material: Any, colored: bool, textured: bool) -> int:
        key = f"{getattr(material, 'id', None)} {colored} {textured}"
        if key not in self._materials:
            self._materials[key] = self._new_material(material, colored, textured)
        return self._materials[key]

    def _new_material(self, material: Any, colored: bool, textured: bool) -> int:
        effect = None if material is None else material.effect
        diffuse = None if effect is None else effect.diffuse
        if diffuse is None and effect is not None and effect.shadingtype == "constant":
            diffuse = effect.emission
        texture = self._texture(diffuse) if textured else None
        if texture is not None or (colored and diffuse is None):
            color = (1.0, 1.0, 1.0)
        elif isinstance(diffuse, tuple):
            color = diffuse[:3]
        else:
            color = DEFAULT_COLOR
            if effect is not None:
                why = (
                    "has no diffuse colour"
                    if diffuse is None
                    else "has a diffuse texture that cannot be used"
                )
                self._note("missing_colors", f"material {material.id!r} {why}; it is shown in light grey")
        alpha, emission = 1.0, None
        if effect is not None:
            alpha = self._opacity(effect, material.id)
            if isinstance(effect.emission, tuple) and effect.shadingtype != "constant":
                emission = self._emission(effect.emission, color, material.id)
        return self._glb.add(
            "materials",
            name=None if material is None else material.id,
            pbrMetallicRoughness={
                "baseColorFactor": [*_linear(np.clip(color, 0, 1)).tolist(), alpha],
                "metallicFactor": 0.0,
                "roughnessFactor": _roughness(effect),
                **({} if texture is None else {"baseColorTexture": {"index": texture}}),
            },
            emissiveFactor=emission if emission and any(emission) else None,
            alphaMode="BLEND" if alpha < 1 else None,
            doubleSided=True,
        )

    def _emission(self, emission: tuple[float, ...], color: tuple[float, ...], name: str) -> list[float]:
        """Returns the emitted linear radiance; zero if the material has a diffuse colour.

        Exporters write emission as a fill light. With this emission, a world without other lights would not
        get the default lights.
        """
        found: list[float] = _linear(np.clip(emission[:3], 0, 1)).tolist()
        if any(found) and any(color):
            text = f"material {name!r}: emission is ignored, because the material has a diffuse colour"
            self._note("ignored_feature", text)
            return [0.0, 0.0, 0.0]
        return found

    def _opacity(self, effect: Any, name: str) -> float:
        """The opacity in the four modes of Collada 1.5 (chapter 7, "Determining transparency")."""
        transparent, factor = effect.transparent, effect.transparency
        node = None if effect.xmlnode is None else effect.xmlnode.find(".//transparent")
        mode = "A_ONE" if node is None else node.get("opaque", "A_ONE")
        factor = float(factor) if isinstance(factor, int | float) else 1.0
        if not isinstance(transparent, tuple):
            if transparent is not None:
                return 1.0  # an image; its alpha channel is not used
            opacity = factor
        else:
            luminance = float(np.dot(transparent[:3], (0.212671, 0.715160, 0.072169)))
            value = luminance if mode.startswith("RGB") else transparent[3] if len(transparent) > 3 else 1.0
            opacity = 1.0 - value * factor if mode.endswith("ZERO") else value * factor
        opacity = min(max(float(opacity), 0.0), 1.0)
        if opacity == 0.0:
            self._note("ignored_transparency", f"material {name!r} is fully transparent; it is shown opaque")
            return 1.0
        return opacity

    def _texture(self, value: Any) -> int | None:
        """The texture of a `Map`; None for a colour or a missing image."""
        image = getattr(getattr(getattr(value, "sampler", None), "surface", None), "image", None)
        if image is None:
            return None
        name = str(image.path)
        if name not in self._textures:
            self._textures[name] = self._new_texture(name)
        return self._textures[name]

    def _new_texture(self, name: str) -> int | None:
        try:
            found = self._find_image(name)
            data = read_bytes(found, 1 << 28)
            kind = next((kind for start, kind in IMAGE_TYPES.items() if data.startswith(start)), None)
            if kind is None:
                pixels, _ = _core.read_picture(os.fspath(found))
                data, kind = _encode_png(np.asarray(pixels)), "image/png"
        except (OSError, FormatError) as error:
            self._note("missing_file", f"image {name!r} is not shown: {error}")
            return None
        image = self._glb.add("images", bufferView=self._glb.view(data), mimeType=kind, name=name)
        return self._glb.add("textures", source=image)


def _encode_png(linear: Any) -> bytes:
    encoded = _core.srgb_from_linear(np.ascontiguousarray(linear[..., :3], np.float32), 1.0, 8, "standard")
    return bytes(_core.encode_png(np.ascontiguousarray(encoded)))


def _linear(colors: Any) -> Floats:
    """Returns the linear values of sRGB colours.

    Like RViz and most exporters, raycam reads Collada's colours as sRGB.
    """
    values = np.asarray(colors, np.float64)
    return linear_from_srgb(values)


def _roughness(effect: Any) -> float:
    """The roughness that resembles Phong's exponent s: sqrt(2 / (s + 2)) (Walter et al. 2007)."""
    shininess = getattr(effect, "shininess", None)
    if (
        effect is None
        or effect.shadingtype in ("lambert", "constant")
        or not isinstance(shininess, int | float)
    ):
        return 1.0
    return math.sqrt(2.0 / (max(float(shininess), 0.0) + 2.0))
