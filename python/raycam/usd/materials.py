"""UsdPreviewSurface as MTL. Source: "UsdPreviewSurface Specification", versions 2.0 to 2.6."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from pxr import Sdf, Usd, UsdShade

from .image_values import ValueChange, value_change
from .images import Images, bake_opacity, bake_wrap
from .notices import StageNotice

__all__ = ["Coordinates", "Materials"]

FALLBACK = {
    "diffuseColor": (0.18, 0.18, 0.18),
    "emissiveColor": (0.0, 0.0, 0.0),
    "metallic": 0.0,
    "roughness": 0.5,
    "clearcoat": 0.0,
    "clearcoatRoughness": 0.01,
    "opacity": 1.0,
    "ior": 1.5,
}
NOT_USED = {"useSpecularWorkflow": 0, "displacement": 0.0, "occlusion": 1.0}
"""Inputs without an equivalent in MTL, with their neutral values."""
MAPS = {
    "diffuseColor": "map_Kd",
    "emissiveColor": "map_Ke",
    "metallic": "map_Pm",
    "roughness": "map_Pr",
    "opacity": "map_d",
    "normal": "norm",
}
PURPOSES = (UsdShade.Tokens.full, UsdShade.Tokens.preview, UsdShade.Tokens.allPurpose)
"""The purposes of material bindings, beginning with the preferred purpose."""


def _purpose(binding: Usd.Relationship) -> str:
    """Returns the purpose in the name of a binding.

    Examples of names are material:binding:full and material:binding:collection:full:NAME.
    """
    parts = binding.GetName().split(":")[2:]
    if parts[:1] == ["collection"]:
        parts = parts[1:-1]
    return parts[0] if parts else UsdShade.Tokens.allPurpose  # type: ignore[no-any-return]


def _preview_surface(material: UsdShade.Material) -> UsdShade.Shader | None:
    surface, _, _ = material.ComputeSurfaceSource()
    return surface if surface and surface.GetShaderId() == "UsdPreviewSurface" else None


@dataclass
class Coordinates:
    """The texture coordinates of a material: a primvar, and the matrix [2, 3] applied to it."""

    primvar: str | None = None
    """The name of the primvar with the coordinates; None for the usual "st"."""
    matrix: Any = None
    """The matrix that transforms the coordinates; None for the identity."""
    constant: Any = None
    """The coordinates [2] for meshes without the primvar, or if no primvar is read; None for a material without
    images."""
    low: Any = (0.0, 0.0)
    """The smallest coordinates of all meshes."""
    high: Any = (1.0, 1.0)

    def apply(self, table: Any, used: Any) -> Any:
        """Returns the transformed coordinates [n, 2] of a mesh, with v upwards.

        `table` [n, 2] are the mesh's coordinates, and `used` the indices of the coordinates that faces use.
        """
        table = table.astype(np.float64)
        if self.matrix is not None:
            table = table @ self.matrix[:, :2].T + self.matrix[:, 2]
        mask = np.zeros(len(table), bool)
        mask[used] = True
        ends = table[mask & np.isfinite(table).all(axis=1)]
        if len(ends):
            self.low = np.minimum(self.low, ends.min(axis=0))
            self.high = np.maximum(self.high, ends.max(axis=0))
        return table


@dataclass
class Map:
    """An image of a material."""

    key: str
    file: str
    matrix: Any
    """image_from_primvar [2, 3], v upwards."""
    wraps: tuple[str, str]
    alpha: tuple[Any, ...] | None = None
    """The arguments of `bake_opacity`, for an image of opacities."""
    change: ValueChange | None = None
    """The conversion of the image's values to the map's values; None if both are equal."""


@dataclass(frozen=True)
class ColorReader:
    """The primvar from which a material reads its colour."""

    primvar: str
    fallback: tuple[float, float, float] | None
    """The colour of meshes without the primvar; None if the file contains no such value."""


@dataclass
class MtlMaterial:
    """A material of the MTL file."""

    name: str
    lines: list[str] = field(default_factory=list)
    maps: list[Map] = field(default_factory=list)
    coordinates: Coordinates = field(default_factory=Coordinates)
    color_reader: ColorReader | None = None


class Materials:
    """The materials of a stage as MTL materials, by number."""

    def __init__(self, images: Images, time: Usd.TimeCode) -> None:
        self.notices: list[StageNotice] = []
        self._images = images
        self._time = time
        self._numbers: dict[Any, int] = {}
        self._materials: list[MtlMaterial] = []
        self._known: dict[Any, bool] = {}

    def bound_materials(self, prims: list[Usd.Prim]) -> dict[str, UsdShade.Material | None]:
        """The material bound to each prim, by path; see `bound_material`."""
        api = UsdShade.MaterialBindingAPI
        found: dict[str, list[UsdShade.Material]] = {prim.GetPath().pathString: [] for prim in prims}
        for purpose in PURPOSES:
            for prim, material, binding in zip(
                prims, *api.ComputeBoundMaterials(prims, purpose), strict=True
            ):
                if material and _purpose(binding) == purpose:
                    found[prim.GetPath().pathString].append(material)
        return {path: self._choose(materials) for path, materials in found.items()}

    def bound_material(self, prim: Usd.Prim) -> UsdShade.Material | None:
        """Returns the first of the prim's bound materials that is a UsdPreviewSurface.

        The materials are in the order of their purposes. If no material is a UsdPreviewSurface, the first material is
        returned.
        """
        return next(iter(self.bound_materials([prim]).values()))

    def _choose(self, materials: list[UsdShade.Material]) -> UsdShade.Material | None:
        usable = [material for material in materials if self.is_known(material)]
        return next(iter([*usable, *materials]), None)

    def add(self, material: UsdShade.Material) -> int:
        """Adds a material; returns its number."""
        path = material.GetPath()
        if path not in self._numbers:
            self._numbers[path] = len(self._materials)
            own = MtlMaterial(f"{material.GetPrim().GetName()}_{len(self._materials)}")
            self._materials.append(own)
            own.lines = self._lines(material, path.pathString, own)
        return self._numbers[path]

    def add_emitter(self, name: str, radiance: Sequence[float]) -> int:
        """Adds a black material that emits light; returns its number."""
        emission = " ".join(repr(float(value)) for value in radiance)
        own = MtlMaterial(f"{name}_{len(self._materials)}", ["Kd 0 0 0", f"Ke {emission}"])
        self._materials.append(own)
        return len(self._materials) - 1

    def is_known(self, material: UsdShade.Material) -> bool:
        """True for a supported material, a UsdPreviewSurface."""
        path = material.GetPath()
        if path not in self._known:
            self._known[path] = _preview_surface(material) is not None
        return self._known[path]

    def color_reader(self, number: int) -> ColorReader | None:
        """The primvar that determines the colour of a material.

        None for a material with a constant colour or an image.
        """
        return self._materials[number].color_reader

    def tint(self, number: int, color: tuple[float, float, float]) -> int:
        """Returns the number of a copy of the material with a different colour."""
        if (number, color) not in self._numbers:
            own = self._materials[number]
            lines = [line for line in own.lines if line.split()[0] != "Kd"]
            other = replace(
                own, name=f"{own.name}_{len(self._materials)}", lines=[*lines, "Kd {} {} {}".format(*color)]
            )
            self._numbers[number, color] = len(self._materials)
            self._materials.append(other)
        return self._numbers[number, color]

    def coordinates(self, number: int) -> Coordinates:
        """The texture coordinates of a material.

        A plain material, whose number is negative, has default coordinates.
        """
        return self._materials[number].coordinates if number >= 0 else Coordinates()

    def write(self, path: Path, used: set[int]) -> tuple[list[str], dict[int, int]]:
        """Writes the used materials to an MTL file.

        Returns their names, and their indices by number.
        """
        order = {number: place for place, number in enumerate(sorted(n for n in used if n >= 0))}
        lines = []
        for number in order:
            own = self._materials[number]
            maps = [self._map_line(found, own.coordinates) for found in own.maps]
            lines.extend([f"newmtl {own.name}", *own.lines, *filter(None, maps)])
        path.write_text("\n".join([*lines, ""]), encoding="utf-8")
        return [self._materials[number].name for number in order], order

    def _note(self, code: str, path: str, text: str) -> None:
        self.notices.append(StageNotice(code, text, f"Material {path}"))

    def _lines(self, material: UsdShade.Material, path: str, own: MtlMaterial) -> list[str]:
        surface = _preview_surface(material)
        if surface is None:
            self._note(
                "ignored_feature",
                path,
                "not a UsdPreviewSurface; displayColor is shown instead, or grey",
            )
            return ["Kd 0.8 0.8 0.8"]
        values: dict[str, Any] = dict(FALLBACK)
        threshold = float(self._given(surface, "opacityThreshold", 0.0))
        maps: list[Map] = []
        for key in [*FALLBACK, "normal", *NOT_USED]:
            source = surface.GetInput(key)
            producers = UsdShade.Utils.GetValueProducingAttributes(source) if source else []
            if not producers:
                continue
            shader = UsdShade.Shader(producers[0].GetPrim())
            if shader and shader.GetShaderId() == "UsdUVTexture" and key in MAPS:
                output = producers[0].GetBaseName()
                image, factor = self._map(key, shader, output, path, own, threshold)
                maps.extend([image] if image else [])
                if key != "normal":
                    values[key] = self._given(shader, "fallback", FALLBACK[key]) if factor is None else factor
                    values[key] = _like(values[key], FALLBACK[key])
            elif shader and (shader.GetShaderId() or "").startswith("UsdPrimvarReader"):
                fallback = self._given(shader, "fallback", None)
                if key == "diffuseColor":
                    color = None if fallback is None else _like(fallback, FALLBACK[key])
                    own.color_reader = ColorReader(str(self._given(shader, "varname", "displayColor")), color)
                    values[key] = (1.0, 1.0, 1.0)
                    continue
                if key in values and fallback is not None:
                    values[key] = _like(fallback, FALLBACK[key])
                name = self._given(shader, "varname", "")
                used = "the input's default" if fallback is None else f"the reader's fallback {fallback}"
                self._note(
                    "ignored_feature", path, f"{key} from primvar {name!r} is not supported; {used} is used"
                )
            elif (given := producers[0].Get(self._time)) is not None:
                if key in values:
                    values[key] = _like(given, FALLBACK[key])
                elif key in NOT_USED and given != NOT_USED[key]:
                    self._note("ignored_feature", path, f"{key} = {given:g} is ignored")
            else:
                what = (shader.GetShaderId() if shader else None) or "a shader without a known id"
                self._note("ignored_feature", path, f"{key} from {what} is not supported")
        if threshold > 0 and not any(image.key == "opacity" for image in maps):
            values["opacity"] = float(float(values["opacity"]) >= threshold)
        own.maps = maps
        self._choose_base(maps, path, own.coordinates)
        return _write_values(values)

    def _choose_base(self, maps: list[Map], path: str, coordinates: Coordinates) -> None:
        """Applies a rotation of images to the texture coordinates of the meshes.

        An MTL file has only scales and offsets, but no rotations.
        """
        turned = [own for own in maps if not _is_straight(own.matrix)]
        if not turned:
            return
        base = np.vstack([turned[0].matrix, [0, 0, 1]])
        if np.linalg.det(base) == 0:
            self._note("ignored_feature", path, "the image's UsdTransform2d has scale 0 and is ignored")
            turned[0].matrix = np.eye(3)[:2]
            return
        coordinates.matrix = base[:2]
        back = np.linalg.inv(base)
        for own in maps:
            own.matrix = own.matrix @ back
            if not _is_straight(own.matrix):
                self._note("ignored_feature", path, f"the rotation of the {own.key} image is ignored")
                own.matrix = np.eye(3)[:2]

    def _given(self, shader: UsdShade.Shader, name: str, default: Any) -> Any:
        source = shader.GetInput(name)
        producers = UsdShade.Utils.GetValueProducingAttributes(source) if source else []
        found = producers[0].Get(self._time) if producers else None
        return default if found is None else found

    def _map(
        self, key: str, shader: UsdShade.Shader, output: str, path: str, own: MtlMaterial, threshold: float
    ) -> tuple[Map | None, Any]:
        """An image of a material, and the factor of the image."""
        asset = self._given(shader, "file", Sdf.AssetPath(""))
        file = self._images.file(asset) if isinstance(asset, Sdf.AssetPath) and asset.path else None
        if file is None:
            return None, None
        scale = [float(value) for value in self._given(shader, "scale", (1.0,) * 4)]
        bias = [float(value) for value in self._given(shader, "bias", (0.0,) * 4)]
        wraps = tuple(str(self._given(shader, side, "repeat")) for side in ("wrapS", "wrapT"))
        found = Map(
            key, file, self._transform(shader, path, own.coordinates), (_wrap(wraps[0]), _wrap(wraps[1]))
        )
        channel = max("rgba".find(output), 0)
        if key == "opacity":
            found.alpha = ("rgba"[channel], scale[channel], bias[channel], threshold)
            return found, 1.0
        used = [channel] if output in ("r", "g", "b", "a") else [0, 1, 2]
        if key != "normal" and not any(scale[index] for index in used):
            constant = [bias[index] for index in used]
            return None, constant * 3 if key.endswith("Color") and len(used) == 1 else constant
        space = str(self._given(shader, "sourceColorSpace", "auto"))
        found.change, factor = value_change(key, output, scale, bias, space, self._images.folder / file)
        if key == "normal" and tuple(scale[:3]) == (1.0,) * 3 and not any(bias[:3]):
            self._note(
                "assumed_convention",
                path,
                "the normal map lacks scale 2 and bias -1; these values are assumed",
            )
        return found, factor

    def _transform(self, shader: UsdShade.Shader, path: str, coordinates: Coordinates) -> Any:
        """Returns image_from_primvar [2, 3] of an image.

        The primvar of the material's first image is stored in `coordinates`; a notice reports other primvars.
        """
        matrix = np.eye(3)
        reader = _source(shader, "st")
        is_value = reader is None or reader.GetPrim() == shader.GetPrim()
        if is_value and coordinates.constant is None:
            coordinates.constant = _like(self._given(shader, "st", (0.0, 0.0)), (0.0, 0.0))
        while reader and reader.GetShaderId() == "UsdTransform2d":
            angle = np.radians(float(self._given(reader, "rotation", 0.0)))
            turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
            own = np.eye(3)
            own[:2, :2] = turn @ np.diag([float(v) for v in self._given(reader, "scale", (1.0, 1.0))])
            own[:2, 2] = [float(v) for v in self._given(reader, "translation", (0.0, 0.0))]
            matrix = matrix @ own
            reader = _source(reader, "in")
        if reader and (reader.GetShaderId() or "").startswith("UsdPrimvarReader"):
            known = str(self._given(reader, "varname", "st"))
            if coordinates.primvar is None:
                coordinates.primvar = known
                coordinates.constant = _like(self._given(reader, "fallback", (0.0, 0.0)), (0.0, 0.0))
            if coordinates.primvar != known:
                self._note(
                    "ignored_feature",
                    path,
                    f"texture coordinates {known!r} are ignored; all images use {coordinates.primvar!r}",
                )
        return matrix[:2]

    def _map_line(self, found: Map, coordinates: Coordinates) -> str | None:
        """The MTL line of an image."""
        file: str | None = found.file
        if found.alpha is not None:
            channel, scale, bias, threshold = found.alpha
            how = f"opacity from channel {channel} x {scale:g} + {bias:g}, threshold {threshold:g},"
            file = self._images.baked(found.file, how, partial(_opacity, alpha=found.alpha))
        if found.change is not None:
            file = self._images.baked(found.file, found.change.words, found.change.bake)
        matrix, clamp = found.matrix, found.wraps == ("clamp", "clamp")
        if file and not clamp and found.wraps != ("repeat", "repeat"):
            file, matrix, clamp = self._unwrap(file, found, coordinates)
        if file is None:
            return None
        options = ["-clamp on"] if clamp else []
        if not np.array_equal(matrix, np.eye(3)[:2]):
            options.append(f"-s {float(matrix[0, 0])!r} {float(matrix[1, 1])!r}")
            options.append(f"-o {float(matrix[0, 2])!r} {float(matrix[1, 2])!r}")
        return " ".join([MAPS[found.key], *options, file])

    def _unwrap(self, file: str, found: Map, own: Coordinates) -> tuple[str | None, Any, bool]:
        """Returns an image that looks like `found` and needs no wrap modes.

        The other results are the image's matrix, and True if the image must be clamped.
        """
        ends = np.array([own.low, own.high]) * np.diag(found.matrix[:, :2]) + found.matrix[:, 2]
        clamp = not {"clamp", "black"}.isdisjoint(found.wraps)
        tiles = []
        for axis, wrap in enumerate(found.wraps):
            if wrap in ("clamp", "black"):
                tiles.append((0, 1))
            elif clamp:
                # One more tile on each side, so that nothing is clamped.
                tiles.append((int(np.floor(ends[:, axis].min())) - 1, int(np.ceil(ends[:, axis].max())) + 1))
            else:
                tiles.append((0, 2) if wrap == "mirror" else (0, 1))
        how = f"wrapping by {' and '.join(found.wraps)} over the tiles {tiles}"
        made = self._images.baked(file, how, lambda pixels: bake_wrap(pixels, found.wraps, tiles))
        if made == file:
            return file, found.matrix, False
        size, matrix = self._images.sizes[file], found.matrix.copy()
        for axis, (wrap, (low, high)) in enumerate(zip(found.wraps, tiles, strict=True)):
            border = 1 / size[axis] if wrap == "black" else 0.0
            matrix[axis, 2] += border - low
            matrix[axis] /= high - low + 2 * border
        return made, matrix, clamp


def _write_values(values: dict[str, Any]) -> list[str]:
    """The lines with a material's values."""

    def share(key: str) -> float:
        return min(max(float(values[key]), 0.0), 1.0)

    diffuse = " ".join(repr(min(max(float(c), 0.0), 1.0)) for c in values["diffuseColor"])
    emission = " ".join(repr(max(float(c), 0.0)) for c in values["emissiveColor"])
    return [
        f"Kd {diffuse}",
        f"Ke {emission}",
        f"Pr {share('roughness')!r}",
        f"Pm {share('metallic')!r}",
        f"Pc {share('clearcoat')!r}",
        f"Pcr {share('clearcoatRoughness')!r}",
        f"Ni {min(max(float(values['ior']), 1.0), 10.0)!r}",
        f"d {share('opacity')!r}",
    ]


def _opacity(pixels: Any, alpha: tuple[Any, ...]) -> Any:
    return bake_opacity(pixels, *alpha)


def _source(shader: UsdShade.Shader, name: str) -> UsdShade.Shader | None:
    """The shader connected to an input."""
    source = shader.GetInput(name)
    producers = UsdShade.Utils.GetValueProducingAttributes(source) if source else []
    return UsdShade.Shader(producers[0].GetPrim()) if producers else None


def _wrap(name: str) -> str:
    """Returns the wrap mode called `name` in USD.

    "useMetadata" counts as "repeat", because raycam does not read the image's metadata.
    """
    return name if name in ("clamp", "mirror", "black") else "repeat"


def _is_straight(matrix: Any) -> bool:
    return bool(np.allclose([matrix[0, 1], matrix[1, 0]], 0, atol=1e-7))


def _like(value: Any, fallback: Any) -> Any:
    """Returns the value converted to the type of its fallback (number or colour).

    If the conversion is impossible, returns the fallback.
    """
    table = np.atleast_1d(np.array(value, dtype=object))
    try:
        numbers = [float(number) for number in table.ravel()]
    except (TypeError, ValueError):
        return fallback
    if not np.isfinite(numbers).all():
        return fallback
    if isinstance(fallback, tuple):
        count = len(fallback)
        return tuple(numbers[:count]) if len(numbers) >= count else (numbers[0],) * count
    return numbers[0]
