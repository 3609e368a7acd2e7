"""Conversion of images of UsdUVTexture to maps of an MTL file.

The conversion applies scale, bias, channel and colour space.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..srgb import linear_from_srgb, srgb_from_linear

__all__ = ["ValueChange", "is_grey", "value_change"]

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

    def bake(self, pixels: Any) -> Any:
        """Converts values [height, width, 4] to [height, width, 3 or 4].

        Alpha is unchanged.
        """
        numbers = pixels[..., list(self.channels)]
        if self.decode:
            numbers = linear_from_srgb(numbers)
        numbers = np.clip(numbers * np.array(self.scale, np.float32) + np.array(self.bias, np.float32), 0, 1)
        if self.encode:
            numbers = srgb_from_linear(numbers)
            alphas = pixels[..., 3:]
            return numbers if (alphas == 1).all() else np.concatenate([numbers, alphas], axis=2)
        return np.repeat(numbers, 3, axis=2) if len(self.channels) == 1 else numbers


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
