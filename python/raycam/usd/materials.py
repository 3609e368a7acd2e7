"""UsdPreviewSurface as MTL. Source: "UsdPreviewSurface Specification", versions 2.0 to 2.6."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from pxr import Sdf, Usd, UsdShade

__all__ = ["Materials"]

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
NOT_USED = {"useSpecularWorkflow": 0, "displacement": 0.0, "opacityThreshold": 0.0, "occlusion": 1.0}
"""Inputs without an equivalent in MTL, with their neutral values."""
MAPS = {
    "diffuseColor": "map_Kd",
    "emissiveColor": "map_Ke",
    "metallic": "map_Pm",
    "roughness": "map_Pr",
    "opacity": "map_d",
    "normal": "norm",
}
CHANNELS = {"metallic": "rb", "roughness": "rg"}
"""The channels of an image that are accepted: red, which a grey image has, or glTF's channel."""


class Materials:
    """The materials of a stage as MTL materials; `image` returns the file of an asset."""

    def __init__(self, image: Callable[[Sdf.AssetPath], str | None]) -> None:
        self.notices: list[str] = []
        self._image = image
        self._names: dict[str, str] = {}
        self._text: list[str] = []
        self._uvs: dict[str, str] = {}

    def name(self, material: UsdShade.Material) -> str:
        """The material's name for `usemtl`."""
        path = material.GetPath().pathString
        if path not in self._names:
            self._names[path] = f"{material.GetPrim().GetName()}_{len(self._names)}"
            self._text.extend([f"newmtl {self._names[path]}", *self._lines(material, path)])
        return self._names[path]

    def plain(self, color: tuple[float, float, float], opacity: float = 1.0) -> str:
        """The name of a material with only a colour and an opacity."""
        name = f"color_{len(self._names)}"
        self._names[name] = name
        self._text.extend([f"newmtl {name}", "Kd {} {} {}".format(*(min(max(c, 0.0), 1.0) for c in color))])
        if opacity != 1.0:
            self._text.append(f"d {opacity}")
        return name

    def primvar(self, material: UsdShade.Material | None) -> str:
        """The name of the primvar with the texture coordinates of the material's images."""
        if material is None:
            return "st"
        self.name(material)
        return self._uvs.get(material.GetPath().pathString, "st")

    def write(self, path: Path) -> None:
        """Writes all materials to an MTL file."""
        path.write_text("\n".join([*self._text, ""]), encoding="utf-8")

    def _lines(self, material: UsdShade.Material, path: str) -> list[str]:
        surface, _, _ = material.ComputeSurfaceSource()
        if not surface or surface.GetShaderId() != "UsdPreviewSurface":
            self.notices.append(f"material {path} is no UsdPreviewSurface: grey")
            return ["Kd 0.8 0.8 0.8"]
        values: dict[str, Any] = dict(FALLBACK)
        maps = []
        for key in [*FALLBACK, "normal", *NOT_USED]:
            source = surface.GetInput(key)
            producers = UsdShade.Utils.GetValueProducingAttributes(source) if source else []
            if not producers:
                continue
            shader = UsdShade.Shader(producers[0].GetPrim())
            if shader and shader.GetShaderId() == "UsdUVTexture" and key in MAPS:
                line, factor = self._map(key, shader, producers[0].GetBaseName(), path)
                maps.extend([line] if line else [])
                if key != "normal":
                    values[key] = factor if line else FALLBACK[key]
            elif (given := producers[0].Get(Usd.TimeCode.EarliestTime())) is not None:
                if key in values:
                    values[key] = given
                elif key in NOT_USED and given != NOT_USED[key]:
                    self.notices.append(f"material {path}: {key} {given:g} is not used")
        return [*self._numbers(values), *maps]

    def _numbers(self, values: dict[str, Any]) -> list[str]:
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

    def _map(self, key: str, shader: UsdShade.Shader, output: str, path: str) -> tuple[str | None, Any]:
        """The MTL line of an image, and the factor of the image."""
        time = Usd.TimeCode.EarliestTime()

        def given(shader: UsdShade.Shader, name: str, default: Any) -> Any:
            source = shader.GetInput(name)
            found = source.Get(time) if source else None
            return default if found is None else found

        file = self._image(given(shader, "file", Sdf.AssetPath("")))
        if file is None:
            return None, None
        if output not in CHANNELS.get(key, output):
            self.notices.append(f"material {path}: {key} is channel {output} of its image: another is used")
        options, transform = [], None
        producers = UsdShade.Utils.GetValueProducingAttributes(st) if (st := shader.GetInput("st")) else []
        reader = UsdShade.Shader(producers[0].GetPrim()) if producers else None
        if reader and reader.GetShaderId() == "UsdTransform2d":
            transform = reader
            producers = UsdShade.Utils.GetValueProducingAttributes(transform.GetInput("in"))
            reader = UsdShade.Shader(producers[0].GetPrim()) if producers else None
        if reader and reader.GetShaderId().startswith("UsdPrimvarReader"):
            name = UsdShade.Utils.GetValueProducingAttributes(reader.GetInput("varname"))
            known = str(name[0].Get(time)) if name else "st"
            if self._uvs.setdefault(path, known) != known:
                self.notices.append(f"material {path}: all its images have the coordinates {self._uvs[path]}")
        if transform:
            if given(transform, "rotation", 0.0):
                self.notices.append(f"material {path}: the rotation of its image is not used")
            options.append("-s {} {}".format(*given(transform, "scale", (1.0, 1.0))))
            options.append("-o {} {}".format(*given(transform, "translation", (0.0, 0.0))))
        wraps = {str(given(shader, name, "repeat")) for name in ("wrapS", "wrapT")}
        if wraps == {"clamp"}:
            options.append("-clamp on")
        elif not wraps <= {"repeat", "useMetadata"}:
            self.notices.append(f"material {path}: its image is repeated, not {' and '.join(sorted(wraps))}")
        factor = list(given(shader, "scale", (1.0,) * 4))
        if key != "normal" and any(given(shader, "bias", (0.0,) * 4)):
            self.notices.append(f"material {path}: the bias of its image is not used")
        value = (
            factor[:3] if key.endswith("Color") else factor["rgba".index(output) if output in "rgba" else 0]
        )
        return " ".join([MAPS[key], *options, file]), value
