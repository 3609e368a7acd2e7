"""Decoding of raycam's own PNG images, for installations without PyAV."""

from __future__ import annotations

import struct
import zlib

import numpy as np
import numpy.typing as npt

from ..errors import FormatError

__all__ = ["decode_png"]

SIGNATURE = b"\x89PNG\r\n\x1a\n"
COMPONENTS = {2: 3, 6: 4}
"""Components by colour type, ISO/IEC 15948 table 11.1: RGB and RGBA."""


def decode_png(data: bytes) -> npt.NDArray[np.uint8]:
    """The pixels [height, width, 3 or 4] of a PNG image that raycam has written.

    Such images have 8 bits and no interlacing. Raises `FormatError` for other PNG files.
    """
    if not data.startswith(SIGNATURE):
        raise FormatError("not a PNG image", code="wrong_format")
    place, header, packed = len(SIGNATURE), b"", []
    while place + 8 <= len(data):
        length, kind = struct.unpack(">I4s", data[place : place + 8])
        body = data[place + 8 : place + 8 + length]
        if kind == b"IHDR":
            header = body
        elif kind == b"IDAT":
            packed.append(body)
        place += 12 + length
    if len(header) != 13:
        raise FormatError("the PNG header is missing", code="missing_value")
    width, height, bits, kind_of_color, _, _, interlaced = struct.unpack(">IIBBBBB", header)
    if bits != 8 or kind_of_color not in COMPONENTS or interlaced:
        raise FormatError(
            "unsupported PNG image; expected 8 bits, RGB or RGBA",
            code="unsupported_feature",
        )
    step = COMPONENTS[kind_of_color]
    raw = np.frombuffer(zlib.decompress(b"".join(packed)), np.uint8)
    if raw.size != height * (width * step + 1):
        raise FormatError("the PNG image is truncated", code="truncated_file")
    rows = raw.reshape(height, width * step + 1)
    above = np.zeros(width * step, np.uint8)
    found = np.empty((height, width * step), np.uint8)
    for number in range(height):
        above = found[number] = _unfiltered(int(rows[number, 0]), rows[number, 1:], above, step)
    return found.reshape(height, width, step)


def _unfiltered(
    kind: int, row: npt.NDArray[np.uint8], above: npt.NDArray[np.uint8], step: int
) -> npt.NDArray[np.uint8]:
    """Removes the filter from a row of bytes (ISO/IEC 15948, clause 9.2)."""
    if kind == 0:
        return row
    if kind == 1:
        by_component = row.reshape(-1, step).cumsum(axis=0, dtype=np.uint64)
        return by_component.astype(np.uint8).ravel()
    if kind == 2:
        return row + above
    if kind not in (3, 4):
        raise FormatError(f"unknown PNG filter {kind}", code="unsupported_feature")
    values, upper = bytearray(row.tobytes()), above.tobytes()
    for i in range(len(values)):
        left = values[i - step] if i >= step else 0
        up = upper[i]
        if kind == 3:
            guess = (left + up) >> 1
        else:
            corner = upper[i - step] if i >= step else 0
            to_left, to_up = abs(up - corner), abs(left - corner)
            to_corner = abs(left + up - 2 * corner)
            guess = (
                left if to_left <= to_up and to_left <= to_corner else up if to_up <= to_corner else corner
            )
        values[i] = (values[i] + guess) & 0xFF
    return np.frombuffer(bytes(values), np.uint8)
