"""Materials of pyrender."""

from __future__ import annotations

from typing import Any

from .colors import format_color_vector
from .texture import Texture
from .values import Converted, number, text, truth

__all__ = ["Material", "MetallicRoughnessMaterial", "SpecularGlossinessMaterial"]


class Material:
    """Base class of the materials, with the attributes that all materials have.

    `alphaCutoff` and `smooth` are stored, but have no effect, as in pyrender.
    """

    name = Converted(text)
    normalTexture = Converted(lambda value: _texture(value, "RGB"))
    occlusionTexture = Converted(lambda value: _texture(value, "R"))
    emissiveTexture = Converted(lambda value: _texture(value, "RGB"))
    emissiveFactor = Converted(lambda value: format_color_vector(0.0 if value is None else value, 3))
    alphaMode = Converted(lambda value: _alpha_mode(value))
    alphaCutoff = Converted(number("alphaCutoff", 0, 1, default=0.5))
    doubleSided = Converted(truth("doubleSided"))
    smooth = Converted(truth("smooth"))
    wireframe = Converted(truth("wireframe"))

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
        self.normalTexture, self.occlusionTexture = normalTexture, occlusionTexture
        self.emissiveTexture, self.emissiveFactor = emissiveTexture, emissiveFactor
        self.alphaMode, self.alphaCutoff = alphaMode, alphaCutoff
        self.doubleSided = False if doubleSided is None else doubleSided
        self.smooth, self.wireframe = smooth, wireframe

    @property
    def is_transparent(self) -> bool:
        """True if surfaces behind this material may be visible."""
        return False

    @property
    def textures(self) -> set[Texture]:
        """The textures of all slots."""
        return {each for each in self._each_texture() if each is not None}

    @property
    def tex_flags(self) -> int:
        """The `TexFlags` of the material's textures."""
        return sum(1 << bit for bit, each in enumerate(self._each_texture()) if each is not None)

    def _each_texture(self) -> list[Any]:
        """The texture of each slot, or None for an empty slot, in the order of `TexFlags`."""
        return [self.normalTexture, self.occlusionTexture, self.emissiveTexture]


class MetallicRoughnessMaterial(Material):
    """The material of glTF 2.0, with glTF's names.

    If the metallic-roughness texture is an image, G is the roughness and B the metalness; if it is a `Texture`, the
    first two channels are used, as in pyrender.
    """

    baseColorFactor = Converted(lambda value: format_color_vector(1.0 if value is None else value, 4))
    baseColorTexture = Converted(lambda value: _texture(value, "RGBA"))
    metallicFactor = Converted(number("metallicFactor", 0, 1, default=1.0))
    roughnessFactor = Converted(number("roughnessFactor", 0, 1, default=1.0))
    metallicRoughnessTexture = Converted(lambda value: _texture(value, "GB"))

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
        self.baseColorFactor, self.baseColorTexture = baseColorFactor, baseColorTexture
        self.metallicFactor, self.roughnessFactor = metallicFactor, roughnessFactor
        self.metallicRoughnessTexture = metallicRoughnessTexture

    @property
    def is_transparent(self) -> bool:
        """True if the base colour's alpha is below 1, or its texture has an alpha of 0.

        pyrender uses the same limits.
        """
        texture = self.baseColorTexture
        return bool(self.baseColorFactor[3] < 1) or (texture is not None and texture.is_transparent())

    def _each_texture(self) -> list[Any]:
        return [*super()._each_texture(), self.baseColorTexture, self.metallicRoughnessTexture]


class SpecularGlossinessMaterial(Material):
    """A material that pyrender defines but does not shade.

    Creating an instance raises `NotImplementedError`.
    """

    def __init__(self, *_arguments: Any, **_options: Any) -> None:
        raise NotImplementedError(
            "SpecularGlossinessMaterial is not supported; use a MetallicRoughnessMaterial with "
            "roughnessFactor = 1 - glossiness"
        )


def _alpha_mode(value: Any) -> str:
    mode = "OPAQUE" if value is None else value
    if mode not in ("OPAQUE", "MASK", "BLEND"):
        raise ValueError(f"alphaMode is {mode!r}: expected OPAQUE, MASK or BLEND")
    return str(mode)


def _texture(value: Any, channels: str) -> Texture | None:
    """Returns a texture unchanged, and a plain image as a texture with the given channels."""
    if value is None or isinstance(value, Texture):
        return value
    return Texture(source=value, source_channels=channels)
