"""Textures and samplers of pyrender."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from .constants import GLTF

__all__ = ["Sampler", "Texture"]

Floats = npt.NDArray[Any]


class Sampler:
    """Filters and wrap modes, by their numbers in `GLTF`."""

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
    """An image as a texture: a PIL image or an array [h, w] or [h, w, c], its first row at v = 1."""

    def __init__(
        self,
        name: str | None = None,
        sampler: Sampler | None = None,
        source: Any = None,
        source_channels: str | None = None,
        width: int | None = None,
        height: int | None = None,
        **_options: Any,
    ) -> None:
        self.name, self.source, self.source_channels = name, source, source_channels
        self.sampler = sampler or Sampler()
        self.width, self.height = width, height
        self._texels: Floats | None = None

    def texels(self) -> Floats:
        """The texels [h, w, 4] in 0..1, as they are in the image."""
        if self._texels is None:
            source = self.source
            if hasattr(source, "convert"):
                source = source.convert("RGBA")
            array = np.asarray(source)
            array = array / 255.0 if array.dtype.kind in "iu" else array.astype(np.float64)
            array = array[..., np.newaxis] if array.ndim == 2 else array
            if array.shape[2] == 1:
                array = np.repeat(array, 3, axis=2)
            rest = np.ones((*array.shape[:2], max(0, 4 - array.shape[2])))
            self._texels = np.concatenate([array, rest], axis=2)[..., :4]
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
