"""Textures and samplers of pyrender."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from .colors import format_texture_source
from .constants import GLTF
from .values import Converted, text

__all__ = ["Sampler", "Texture"]

Floats = npt.NDArray[Any]


class Sampler:
    """Filters and wrap modes, as constants of `GLTF`."""

    name = Converted(text)

    def __init__(
        self,
        name: str | None = None,
        magFilter: int | None = None,
        minFilter: int | None = None,
        wrapS: int = GLTF.REPEAT,
        wrapT: int = GLTF.REPEAT,
    ) -> None:
        self.name = name
        self.magFilter, self.minFilter = magFilter, minFilter
        self.wrapS, self.wrapT = wrapS, wrapT


class Texture:
    """An image as a texture, with the image's first row at v = 1.

    The image is a PIL image or an array [h, w] or [h, w, c]. `source_channels` are "R", "RG", "GB", "RGB" or
    "RGBA" (default: the channels of the image).
    """

    name = Converted(text)
    sampler = Converted(lambda value: Sampler() if value is None else value)

    def __init__(
        self,
        name: str | None = None,
        sampler: Sampler | None = None,
        source: Any = None,
        source_channels: str | None = None,
        width: int | None = None,
        height: int | None = None,
        tex_type: Any = None,
        data_format: Any = None,
    ) -> None:
        if source is not None and source_channels is None:
            count = len(source.getbands()) if hasattr(source, "getbands") else np.atleast_3d(source).shape[2]
            source_channels = {2: "RG", 4: "RGBA"}.get(count, "RGB")
        self.name, self.sampler, self.source_channels = name, sampler, source_channels
        self.source = source
        self.width, self.height = width, height
        self.tex_type, self.data_format = tex_type, data_format

    @property
    def source(self) -> Any:
        """The image, uint8 [h, w] or [h, w, c]."""
        return self._source

    @source.setter
    def source(self, value: Any) -> None:
        self._source = format_texture_source(value, self.source_channels or "RGB")
        self._texels: Floats | None = None

    def is_transparent(self, cutoff: float = 1.0) -> bool:
        """True if any alpha value, from 0 to 255, is below `cutoff`, as in pyrender."""
        return (
            self.source_channels == "RGBA"
            and self.source is not None
            and bool((self.source[..., 3] < cutoff).any())
        )

    def delete(self) -> None:
        """Does nothing, because no graphics memory is used."""

    def texels(self) -> Floats:
        """Returns the texels [h, w, 4] in 0..1, as stored in the image.

        Missing channels are 0, and missing alpha is 1.
        """
        if self._texels is None:
            image = np.zeros((1, 1, 3)) if self.source is None else np.atleast_3d(self.source) / 255.0
            rest = np.zeros((*image.shape[:2], 4))
            rest[..., 3] = 1
            rest[..., : image.shape[2]] = image
            self._texels = rest
        return self._texels

    def lookup(self, uv: Floats) -> Floats:
        """The values [n, 4] at texture coordinates [n, 2] with v up."""
        texels = self.texels()
        height, width = texels.shape[:2]
        x = uv[:, 0] * width - 0.5
        y = (1 - uv[:, 1]) * height - 0.5
        if self.sampler.magFilter == GLTF.NEAREST:
            return texels[
                _wrap(np.round(y), height, self.sampler.wrapT), _wrap(np.round(x), width, self.sampler.wrapS)
            ]
        left, top = np.floor(x), np.floor(y)
        fx, fy = (x - left)[:, np.newaxis], (y - top)[:, np.newaxis]
        columns = [_wrap(left + i, width, self.sampler.wrapS) for i in (0, 1)]
        rows = [_wrap(top + i, height, self.sampler.wrapT) for i in (0, 1)]
        above = texels[rows[0], columns[0]] * (1 - fx) + texels[rows[0], columns[1]] * fx
        below = texels[rows[1], columns[0]] * (1 - fx) + texels[rows[1], columns[1]] * fx
        return np.asarray(above * (1 - fy) + below * fy)


def _wrap(index: Floats, size: int, mode: int) -> npt.NDArray[np.int64]:
    whole = np.nan_to_num(index).astype(np.int64)
    if mode == GLTF.CLAMP_TO_EDGE:
        return np.clip(whole, 0, size - 1)
    if mode == GLTF.MIRRORED_REPEAT:
        folded = whole % (2 * size)
        return np.minimum(folded, 2 * size - 1 - folded)
    return whole % size
