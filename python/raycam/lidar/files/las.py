"""LAS 1.4, point format 6. Source: ASPRS, "LAS Specification 1.4 - R15"."""

from __future__ import annotations

import importlib
import io
import struct
from typing import Any

import numpy as np
import numpy.typing as npt

from ... import _core
from ...errors import LidarError

__all__ = ["las_bytes", "laz_bytes"]

HEADER_SIZE, RECORD_HEADER_SIZE, EXTRA_SIZE = 375, 54, 192
SCALE = 1e-4
"""The step of coordinates, in metres."""
EXTRA_TYPES = {"u1": 1, "i1": 2, "u2": 3, "i2": 4, "u4": 5, "i4": 6, "u8": 7, "i8": 8, "f4": 9, "f8": 10}
STANDARD = ("position", "intensity", "return", "returns", "time", "scan_angle")
ANGLE_STEP = 0.006
"""The step of scan angles, in degrees."""


def las_bytes(arrays: dict[str, npt.NDArray[Any]]) -> bytes:
    """Returns the bytes of a LAS file.

    GPS times are seconds from the frame's start. Scan angles are angles from straight down, positive on the
    sensor's right side. Coordinates are integers in steps of 0.1 mm. Other fields are extra bytes.
    """
    position, count = arrays["position"], len(arrays["position"])
    extra = {name: array for name, array in arrays.items() if name not in STANDARD and array.ndim == 1}
    low = position.min(axis=0) if count else np.zeros(3)
    high = position.max(axis=0) if count else np.zeros(3)
    offset = np.floor((low + high) / 2.0)
    kinds: list[Any] = [
        ("xyz", "<i4", 3),
        ("intensity", "<u2"),
        ("returns", "u1"),
        ("flags", "u1"),
        ("classification", "u1"),
        ("user", "u1"),
        ("angle", "<i2"),
        ("source", "<u2"),
        ("time", "<f8"),
    ]
    kinds += [(f"+{name}", array.dtype.newbyteorder("<")) for name, array in extra.items()]
    records = np.zeros(count, kinds)
    records["xyz"] = np.round((position - offset) / SCALE)
    # The LAS standard requires that intensities use all 16 bits: 255 becomes 65535.
    records["intensity"] = arrays["intensity"].astype(np.uint16) * 257
    number = np.minimum(arrays["return"] + 1, 15)
    total = np.minimum(arrays["returns"], 15)
    records["returns"] = number | (total << 4)
    records["time"] = arrays["time"]
    if "scan_angle" in arrays:
        records["angle"] = np.rint(arrays["scan_angle"] / ANGLE_STEP)
    for name, array in extra.items():
        records[f"+{name}"] = array
    by_return = np.bincount(number, minlength=16)[1:16] if count else np.zeros(15, np.int64)
    descriptions = b"".join(_extra_description(name, array) for name, array in extra.items())
    header = _header(count, records.dtype.itemsize, offset, low, high, by_return, len(descriptions))
    return header + (_record_header(len(descriptions)) + descriptions if extra else b"") + records.tobytes()


def laz_bytes(arrays: dict[str, npt.NDArray[Any]]) -> bytes:
    """Returns the bytes of `las_bytes` compressed as LAZ.

    Raises `LidarError` without the packages laspy and lazrs.
    """
    try:
        laspy = importlib.import_module("laspy")
        importlib.import_module("lazrs")
    except ImportError:
        raise LidarError(
            ".laz requires the packages laspy and lazrs: pip install 'raycam[laz]', or use .las (uncompressed)",
            code="missing_dependency",
        ) from None
    packed = io.BytesIO()
    laspy.read(io.BytesIO(las_bytes(arrays))).write(packed, do_compress=True)
    return packed.getvalue()


def _header(
    count: int, size: int, offset: Any, low: Any, high: Any, by_return: npt.NDArray[np.int64], described: int
) -> bytes:
    """Returns the public header block."""
    lengths = RECORD_HEADER_SIZE + described if described else 0
    software = f"raycam {_core.__version__}".encode()[:31]
    packed = struct.pack("<4sHHIHH8sBB", b"LASF", 0, 1 << 4, 0, 0, 0, b"", 1, 4)
    packed += struct.pack(
        "<32s32sHHHII", b"raycam", software, 1, 2026, HEADER_SIZE, HEADER_SIZE + lengths, bool(described)
    )
    packed += struct.pack("<BHI5I", 6, size, 0, 0, 0, 0, 0, 0)
    packed += struct.pack("<3d3d", SCALE, SCALE, SCALE, *offset)
    packed += struct.pack("<6d", high[0], low[0], high[1], low[1], high[2], low[2])
    return packed + struct.pack("<QQIQ15Q", 0, 0, 0, count, *(int(n) for n in by_return))


def _record_header(length: int) -> bytes:
    return struct.pack("<H16sHH32s", 0, b"LASF_Spec", 4, length, b"extra bytes")


def _extra_description(name: str, array: npt.NDArray[Any]) -> bytes:
    """Returns the description of an extra field."""
    kind = EXTRA_TYPES[array.dtype.str[1:]]
    return struct.pack("<2sBB32s4s", b"", kind, 0, name.encode(), b"").ljust(
        EXTRA_SIZE - 32, b"\0"
    ) + name.encode()[:32].ljust(32, b"\0")
