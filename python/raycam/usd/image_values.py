"""Conversion of images of UsdUVTexture to maps of an MTL file.

The conversion applies scale, bias, channel and colour space. It is computed once for each value that an 8-bit or
16-bit image may contain, and looked up for each pixel.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ..srgb import linear_from_srgb, srgb_from_linear

__all__ = ["Texels", "ValueChange", "is_grey", "level_values", "look_up", "value_change"]

Texels = npt.NDArray[np.uint8] | npt.NDArray[np.uint16]
"""Values of an image of integers, [height, width, channels]."""

FLOATS = (".exr", ".hdr")
"""Endings of float image files; their values are linear, regardless of the shader's colour space."""
USED_CHANNEL = {"roughness": 1, "metallic": 2}
"""The image channel that an MTL file's roughness or metallic map uses, as in glTF."""


@dataclass(frozen=True)
class ValueChange:
    """A conversion of image values: channels times `scale` plus `bias`.

    The conversion is applied in linear light if the image is sRGB.
    """

    channels: tuple[int, ...]
    scale: tuple[float, ...]
    bias: tuple[float, ...]
    decode: bool = False
    encode: bool = False

    @property
    def words(self) -> str:
        """The change as text, for a notice."""
        names = "".join("rgba"[channel] for channel in self.channels)
        scale, bias = (", ".join(f"{value:g}" for value in row) for row in (self.scale, self.bias))
        spaces = " read as sRGB" * self.decode + " read as linear" * (self.encode and not self.decode)
        return f"{names} x ({scale}) + ({bias}){spaces}"

    def bake(self, pixels: Texels) -> Texels:
        """Converts an image [height, width, 4] to [height, width, 1, 3 or 4].

        Alpha is unchanged, and omitted if all pixels are opaque.
        """
        levels = level_values(pixels)
        linear = linear_from_srgb(levels) if self.decode else levels
        scale, bias = np.array(self.scale, np.float32), np.array(self.bias, np.float32)
        values = np.clip(linear[:, None] * scale + bias, 0, 1)
        channels = list(self.channels)
        if self.encode:
            values = srgb_from_linear(values)
            if (pixels[..., 3] != len(levels) - 1).any():
                values = np.column_stack([values, levels])
                channels.append(3)
        return look_up(pixels, channels, values)


def level_values(pixels: Texels) -> npt.NDArray[np.float32]:
    """Returns the values in 0..1, float32, of all levels that the image's type can represent."""
    count = np.iinfo(pixels.dtype).max + 1
    return np.arange(count, dtype=np.float32) / np.float32(count - 1)


def look_up(pixels: Texels, channels: Sequence[int], values: npt.NDArray[np.float32]) -> Texels:
    """Applies a lookup table to channels of an image; returns uint8 or uint16 [height, width, k].

    Column i of `values` [levels, k], from 0 to 1, replaces the integer values of channel `channels[i]` of `pixels`. The
    result is uint8 if 8 bits represent all used values exactly, and uint16 otherwise.
    """
    small = np.round(values * 255)
    is_exact = np.abs(values * 255 - small) < 1e-3
    used = [np.bincount(pixels[..., channel].ravel(), minlength=len(values)) > 0 for channel in channels]
    fits = all(is_exact[levels, column].all() for column, levels in enumerate(used))
    table = small.astype(np.uint8) if fits else np.round(values * 65535).astype(np.uint16)
    made = np.empty((*pixels.shape[:2], len(channels)), table.dtype)
    for column, channel in enumerate(channels):
        made[..., column] = table[:, column][pixels[..., channel]]
    return made


def value_change(
    key: str, output: str, scale: Sequence[float], bias: Sequence[float], space: str, file: Path
) -> tuple[ValueChange | None, Any]:
    """Returns the conversion that an input's image requires, and the remaining factor.

    The conversion is None if the image can be used unchanged.
    """
    if key == "normal":
        half = tuple(value / 2 for value in scale[:3]), tuple((value + 1) / 2 for value in bias[:3])
        known = half == ((1.0,) * 3, (0.0,) * 3) or _is_plain(scale, bias)
        if known and space != "sRGB":
            return None, 1.0
        half = ((1.0,) * 3, (0.0,) * 3) if known else half
        return ValueChange((0, 1, 2), *half, decode=space == "sRGB"), 1.0
    channel = max("rgba".find(output), 0)
    if key in USED_CHANNEL:
        is_used = channel == USED_CHANNEL[key] or (channel < 3 and is_grey(file))
        if is_used and bias[channel] == 0 and 0 <= scale[channel] <= 1 and space != "sRGB":
            return None, scale[channel]
        return ValueChange((channel,), (scale[channel],), (bias[channel],), decode=space == "sRGB"), 1.0
    channels = (0, 1, 2) if output not in ("r", "g", "b", "a") else (channel,) * 3
    factor, added = [scale[index] for index in channels], [bias[index] for index in channels]
    most = np.inf if key == "emissiveColor" else 1.0
    floats = file.suffix in FLOATS
    is_plain = channels == (0, 1, 2) and not any(added) and all(0 <= value <= most for value in factor)
    if is_plain and (space != "raw" or floats):
        return None, factor
    largest = max(1.0, *(max(value, 0.0) + other for value, other in zip(factor, added, strict=True)))
    rest = largest if key == "emissiveColor" else 1.0
    parts = tuple(value / rest for value in factor), tuple(value / rest for value in added)
    return ValueChange(channels, *parts, decode=space != "raw", encode=True), (rest,) * 3


def _is_plain(scale: Sequence[float], bias: Sequence[float]) -> bool:
    return tuple(scale[:3]) == (1.0,) * 3 and not any(bias[:3])


def is_grey(file: Path) -> bool:
    """True for a PNG or JPEG file whose header specifies one colour channel."""
    with file.open("rb") as stream:
        head = stream.read(1 << 16)
    if head.startswith(b"\x89PNG"):
        return head[25:26] in (b"\0", b"\4")
    place = 2
    while head.startswith(b"\xff\xd8") and place + 10 <= len(head) and head[place] == 0xFF:
        kind, size = head[place + 1], int.from_bytes(head[place + 2 : place + 4], "big")
        if 0xC0 <= kind <= 0xCF and kind not in (0xC4, 0xC8, 0xCC):
            return head[place + 9] == 1
        place += 2 + size
    return False
