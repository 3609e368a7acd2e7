"""PCD 0.7 files: binary, compressed or as text.

Source: https://pointclouds.org/documentation/tutorials/pcd_file_format.html.
"""

from __future__ import annotations

import struct
from typing import Any

import numpy as np
import numpy.typing as npt

from ... import _core
from .records import point_records

__all__ = ["pcd_bytes", "pcd_compressed", "pcd_text"]

LETTERS = {"f": "F", "i": "I", "u": "U", "b": "U"}


def pcd_bytes(arrays: dict[str, npt.NDArray[Any]]) -> bytes:
    """Returns the bytes of a binary PCD file; positions are float32, other fields unchanged."""
    records = point_records(arrays)
    return _header(records, "binary") + records.tobytes()


def pcd_compressed(arrays: dict[str, npt.NDArray[Any]]) -> bytes:
    """Returns the bytes of a PCD file with compressed points (LZF), field after field."""
    records = point_records(arrays)
    fields = b"".join(np.ascontiguousarray(records[name]).tobytes() for name in records.dtype.names or ())
    packed = _core.compress_lzf(fields)
    return _header(records, "binary_compressed") + struct.pack("<II", len(packed), len(fields)) + packed


def pcd_text(arrays: dict[str, npt.NDArray[Any]]) -> bytes:
    """Returns the bytes of a PCD text file: a line for each point, with numbers of all digits."""
    records = point_records(arrays)
    columns = [[str(value) for value in records[name]] for name in records.dtype.names or ()]
    lines = [" ".join(row) for row in zip(*columns, strict=True)]
    return _header(records, "ascii") + "".join(f"{line}\n" for line in lines).encode()


def _header(records: npt.NDArray[Any], data: str) -> bytes:
    """Returns the header of a file whose points are stored as `data`."""
    names = records.dtype.names or ()
    kinds = [records.dtype[name] for name in names]
    lines = [
        "# .PCD v0.7 - Point Cloud Data file format",
        "VERSION 0.7",
        f"FIELDS {' '.join(names)}",
        f"SIZE {' '.join(str(kind.itemsize) for kind in kinds)}",
        f"TYPE {' '.join(LETTERS[kind.kind] for kind in kinds)}",
        f"COUNT {' '.join('1' for _ in names)}",
        f"WIDTH {len(records)}",
        "HEIGHT 1",
        "VIEWPOINT 0 0 0 1 0 0 0",
        f"POINTS {len(records)}",
        f"DATA {data}",
    ]
    return "\n".join(lines).encode() + b"\n"
