"""PLY, binary little-endian."""

from __future__ import annotations

from typing import Any

import numpy.typing as npt

from .records import point_records

__all__ = ["ply_bytes"]

NAMES = {
    "f4": "float",
    "f8": "double",
    "i1": "char",
    "i2": "short",
    "i4": "int",
    "u1": "uchar",
    "u2": "ushort",
}


def ply_bytes(arrays: dict[str, npt.NDArray[Any]]) -> bytes:
    """Returns the bytes of a binary PLY file; positions are float32, other fields unchanged."""
    records = point_records(arrays)
    names = records.dtype.names or ()
    lines = ["ply", "format binary_little_endian 1.0", f"element vertex {len(records)}"]
    lines += [f"property {NAMES[records.dtype[name].str[1:]]} {name}" for name in names]
    return "\n".join([*lines, "end_header", ""]).encode() + records.tobytes()
