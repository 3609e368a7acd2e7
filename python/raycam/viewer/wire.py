"""Packed planes: arrays for the client, and their unpacking by the same rules.

A packed plane is filtered as integers, then compressed with raw deflate. Filters store component after component, and
of each component the lowest bytes of all values, then the next bytes. "left" stores differences from the value on the
left; "left_up" stores the differences of these differences from the row above. Both filters wrap around, so every bit
of every value is restored.
"""

from __future__ import annotations

import base64
import zlib
from typing import Any

import numpy as np
import numpy.typing as npt

__all__ = ["DTYPES", "FILTERS", "data_url", "pack", "reduced", "unpack"]

MANTISSA_BITS = 12
"""Number of mantissa bits for numbers that are only displayed."""
FILTERS = ("plain", "apart", "left", "left_up")
DTYPES = ("float16", "float32", "float64", "int32")

# For each channel, the filter that gives the fewest bytes for most worlds; other channels use "left".
BEST = {
    "color": "plain",
    "albedo": "plain",
    "depth": "left",
    "distance": "left_up",
    "normal": "plain",
    "normal_camera": "plain",
    "shading_normal": "left_up",
    "shading_normal_camera": "left_up",
    "instance": "apart",
    "category": "apart",
    "triangle": "apart",
    "material": "apart",
    "coverage": "apart",
    "alpha": "apart",
    "transmittance": "left",
    "error": "apart",
}

Array = npt.NDArray[Any]


def data_url(media: str, data: bytes) -> str:
    """The bytes as a data URL."""
    return f"data:{media};base64,{base64.b64encode(data).decode()}"


def pack(
    name: str, array: Array, *, level: int = 6, filter: str | None = None
) -> tuple[dict[str, Any], bytes]:
    """Returns the header and the bytes of a plane [h, w] or [h, w, components].

    With level 0, the plane is not compressed.
    """
    dtype = np.dtype(array.dtype).newbyteorder("<")
    if dtype.name not in DTYPES:
        raise ValueError(f"{name} has dtype {dtype.name}; the client supports {', '.join(DTYPES)}")
    height, width = array.shape[:2]
    values = np.ascontiguousarray(array, dtype=dtype).reshape(height, width, -1)
    chosen = filter or (BEST.get(name, "left") if level else "plain")
    header = {
        "name": name,
        "dtype": dtype.name,
        "width": width,
        "height": height,
        "components": values.shape[2],
        "filter": chosen,
        "deflated": level > 0,
    }
    data = _filtered(values, chosen)
    if level:
        compressor = zlib.compressobj(level, zlib.DEFLATED, -zlib.MAX_WBITS)
        data = compressor.compress(data) + compressor.flush()
    return header, data


def reduced(array: Array) -> Array:
    """Floats rounded to `MANTISSA_BITS` bits of their mantissa; other arrays are unchanged.

    Rounded numbers are compressed better by deflate. The relative error is at most 2^-(MANTISSA_BITS + 1); infinities
    and NaN do not change.
    """
    if array.dtype != np.float32:
        return array
    bits = np.ascontiguousarray(array).view(np.uint32)
    low = 23 - MANTISSA_BITS
    rounded = (bits + np.uint32((1 << (low - 1)) - 1) + ((bits >> low) & np.uint32(1))) & np.uint32(
        0xFFFFFFFF << low & 0xFFFFFFFF
    )
    return np.where(np.isfinite(array), rounded, bits).view(np.float32)


def unpack(header: dict[str, Any], data: bytes) -> Array:
    """The array [h, w, components] of a packed plane."""
    dtype = np.dtype(header["dtype"]).newbyteorder("<")
    height, width, components = header["height"], header["width"], header["components"]
    raw = zlib.decompress(data, -zlib.MAX_WBITS) if header["deflated"] else data
    if header["filter"] == "plain":
        return np.frombuffer(raw, dtype).reshape(height, width, components)
    parts = np.frombuffer(raw, np.uint8).reshape(components, dtype.itemsize, height, width)
    words = np.ascontiguousarray(parts.transpose(0, 2, 3, 1)).view(f"<u{dtype.itemsize}")[..., 0]
    if header["filter"] == "left_up":
        words = np.cumsum(words, axis=1, dtype=words.dtype)
    if header["filter"] != "apart":
        words = np.cumsum(words, axis=2, dtype=words.dtype)
    return np.ascontiguousarray(words.transpose(1, 2, 0)).view(dtype)


def _filtered(values: Array, filter: str) -> bytes:
    """Returns the bytes of an array [h, w, components] after a filter."""
    if filter == "plain":
        return values.tobytes()
    size = values.dtype.itemsize
    words = values.view(f"<u{size}").transpose(2, 0, 1).copy()
    if filter != "apart":
        words[:, :, 1:] -= words[:, :, :-1].copy()
    if filter == "left_up":
        words[:, 1:] -= words[:, :-1].copy()
    parts = words.view(np.uint8).reshape(*words.shape, size)
    return np.ascontiguousarray(parts.transpose(0, 3, 1, 2)).tobytes()
