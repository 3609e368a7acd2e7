"""Materials of pyrender: metal and roughness."""

from __future__ import annotations

from typing import Any

from .colors import format_color_vector
from .texture import Texture

__all__ = ["Material", "MetallicRoughnessMaterial"]


class Material:
    """The values that all materials have.

    `normalTexture`, `occlusionTexture`, `smooth` and `wireframe` are kept and not shown.
    """

    def __init__(
        self,
        name: str | None = None,
        normalTexture: Any = None,
        occlusionTexture: Any = None,
        emissiveTexture: Any = None,
        emissiveFactor: Any = None,
        alphaMode: str | None = None,
        alphaCutoff: float | None = None,
        doubleSided: bool = False,
        smooth: bool = True,
        wireframe: bool = False,
    ) -> None:
        self.name = name
        self.normalTexture, self.occlusionTexture = _texture(normalTexture), _texture(occlusionTexture)
        self.emissiveTexture = _texture(emissiveTexture)
        self.emissiveFactor = format_color_vector(0.0 if emissiveFactor is None else emissiveFactor, 3)
        self.alphaMode = alphaMode or "OPAQUE"
        if self.alphaMode not in ("OPAQUE", "MASK", "BLEND"):
            raise ValueError(f"alphaMode is {alphaMode!r}: expected OPAQUE, MASK or BLEND")
        self.alphaCutoff = 0.5 if alphaCutoff is None else float(alphaCutoff)
        self.doubleSided, self.smooth, self.wireframe = bool(doubleSided), bool(smooth), bool(wireframe)


class MetallicRoughnessMaterial(Material):
    """The material of glTF 2.0, by its names."""

    def __init__(
        self,
        name: str | None = None,
        normalTexture: Any = None,
        occlusionTexture: Any = None,
        emissiveTexture: Any = None,
        emissiveFactor: Any = None,
        alphaMode: str | None = None,
        alphaCutoff: float | None = None,
        doubleSided: bool = False,
        smooth: bool = True,
        wireframe: bool = False,
        baseColorFactor: Any = None,
        baseColorTexture: Any = None,
        metallicFactor: float = 1.0,
        roughnessFactor: float = 1.0,
        metallicRoughnessTexture: Any = None,
    ) -> None:
        super().__init__(
            name,
            normalTexture,
            occlusionTexture,
            emissiveTexture,
            emissiveFactor,
            alphaMode,
            alphaCutoff,
            doubleSided,
            smooth,
            wireframe,
        )
        self.baseColorFactor = format_color_vector(1.0 if baseColorFactor is None else baseColorFactor, 4)
        self.baseColorTexture = _texture(baseColorTexture)
        self.metallicFactor, self.roughnessFactor = float(metallicFactor), float(roughnessFactor)
        self.metallicRoughnessTexture = _texture(metallicRoughnessTexture)


def _texture(value: Any) -> Texture | None:
    """A texture, also of a plain image."""
    return value if value is None or isinstance(value, Texture) else Texture(source=value)
