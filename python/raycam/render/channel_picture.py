"""Images of channels that are not colours, by fixed rules, and JPEG encoding."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from .. import _core

__all__ = ["channel_picture", "encode_jpeg"]

JPEG_QUALITY = 92
"""The quality of JPEG files, 1 to 100."""
VIRIDIS_COLORS = (
    *(0x440154, 0x481B6D, 0x46327E, 0x3F4788, 0x365C8D, 0x2E6E8E, 0x277F8E, 0x21918C, 0x1FA187, 0x2DB27D),
    *(0x4AC16D, 0x73D056, 0xA0DA39, 0xD0E11C, 0xFDE725),
)
"""15 even steps of the colour map viridis (S. van der Walt and N. Smith, 2015, CC0), 0xrrggbb."""
LIGHT_CHANNELS = (
    *("color", "albedo", "shadow", "transmittance"),
    *("emission", "direct", "indirect", "diffuse", "specular", "volume"),
)
"""Channels of linear light, in addition to the channels of single lights."""
FRACTION_CHANNELS = ("coverage", "alpha", "roughness", "metallic")
"""Channels of fractions, 0 to 1."""
UNIT_VECTOR_CHANNELS = ("normal", "normal_camera", "shading_normal", "shading_normal_camera")


def channel_picture(name: str, plane: npt.NDArray[Any]) -> npt.NDArray[np.uint8]:
    """Returns a channel [h, w, ...] as an sRGB image, uint8 [h, w, 3]; the background is black.

    * `color` and its parts, `albedo`, `shadow` and `transmittance`: sRGB, as in PNG.
    * unit vectors: (x + 1) / 2, (y + 1) / 2, (z + 1) / 2, as in normal maps.
    * ids: one colour per id, which depends on the id only: hue id * 0.618034 (modulo 1), saturation and value between
      0.55 and 1.
    * `barycentric` and `nocs`: the weights or coordinates as red, green and blue. `uv`: u and v (modulo 1) as red and
      green.
    * `position`: x, y and z as red, green and blue, and `projector_uv`: u and v as red and green, each scaled from the
      image's lowest to its highest value.
    * other numbers: the colour map viridis from the image's lowest (dark) to its highest finite value; for `depth` and
      `distance` from the farthest (dark) to the nearest; for `coverage`, `alpha`, `roughness` and `metallic`
      from 0 to 1.
    """
    if name in LIGHT_CHANNELS or name.startswith("light:"):
        return np.asarray(_core.srgb_from_linear(np.ascontiguousarray(plane, np.float32), 1.0, 8, "standard"))
    if plane.dtype.kind == "i":
        return _ids(plane)
    valid = np.isfinite(plane) if plane.ndim == 2 else np.isfinite(plane).all(axis=2)
    if name in UNIT_VECTOR_CHANNELS:
        valid &= (plane != 0).any(axis=2)
        shares = (plane + 1) / 2
    elif name == "uv":
        shares = np.dstack([np.mod(plane, 1), np.zeros(plane.shape[:2])])
    elif name == "projector_uv":
        shares = np.dstack([_stretched(plane, valid, None), np.zeros(plane.shape[:2])])
    elif plane.ndim == 3 and name != "position":
        shares = plane
    else:
        ends = (0.0, 1.0) if name in FRACTION_CHANNELS else None
        shares = _stretched(plane, valid, ends)
        if plane.ndim == 2:
            return _viridis(1 - shares if name in ("depth", "distance") else shares, valid)
    bytes_ = np.where(valid[..., np.newaxis], np.clip(np.nan_to_num(shares), 0, 1) * 255, 0)
    return np.ascontiguousarray(np.round(bytes_).astype(np.uint8))


def _stretched(
    plane: npt.NDArray[Any], valid: npt.NDArray[np.bool_], ends: tuple[float, float] | None
) -> npt.NDArray[np.float64]:
    """Returns the values scaled so that the lowest is 0 and the highest is 1.

    Each component is scaled separately. If `ends` is given, its two numbers replace the lowest and the highest
    value. Pixels that are not `valid` have no meaningful value.
    """
    values = np.where(valid if plane.ndim == 2 else valid[..., np.newaxis], plane, 0).astype(np.float64)
    if not valid.any():
        return values
    low, high = (plane[valid].min(axis=0), plane[valid].max(axis=0)) if ends is None else ends
    return np.asarray((values - low) / np.where(np.asarray(high) > low, np.asarray(high) - low, 1))


def _viridis(shares: npt.NDArray[np.float64], valid: npt.NDArray[np.bool_]) -> npt.NDArray[np.uint8]:
    stops = np.array([[c >> 16, c >> 8 & 255, c & 255] for c in VIRIDIS_COLORS], dtype=np.float64)
    at = np.linspace(0, 1, len(stops))
    shown = np.clip(np.where(valid, shares, 0), 0, 1)
    colors = np.dstack([np.interp(shown, at, stops[:, i]) for i in range(3)])
    return np.ascontiguousarray(np.where(valid[..., np.newaxis], np.round(colors), 0).astype(np.uint8))


def _ids(plane: npt.NDArray[Any]) -> npt.NDArray[np.uint8]:
    """A colour for each id; black for -1."""
    known, index = np.unique(plane, return_inverse=True)
    hue = np.mod(known * 0.618034, 1) * 6
    saturation = 0.55 + 0.45 * np.mod(known * 0.754878, 1)
    value = 0.55 + 0.45 * np.mod(known * 0.569840 + 0.5, 1)
    part = np.abs(np.mod(hue[:, np.newaxis] + np.array([3.0, 1.0, 5.0]), 6) - 3) - 1
    share = 1 - saturation[:, np.newaxis] * (1 - np.clip(part, 0, 1))
    colors = np.round(255 * value[:, np.newaxis] * share).astype(np.uint8)
    colors[known < 0] = 0
    return np.ascontiguousarray(colors[index.reshape(plane.shape)])


def encode_jpeg(rgb: npt.NDArray[np.uint8], quality: int = JPEG_QUALITY) -> bytes:
    """Returns the bytes of a JPEG file of an sRGB image [h, w, 3]; 1 <= `quality` <= 100.

    Raises `FormatError` above 65,535 pixels a side.
    """
    return _core.encode_jpeg(np.ascontiguousarray(rgb), quality)
