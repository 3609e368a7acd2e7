"""The arrays in which the separate process hands over the meshes and objects of a stage.

Each array is a file of plain numbers, whose length alone determines the array's size. The core checks their contents.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

__all__ = ["ARRAYS", "NO_INDEX", "read_arrays", "write_arrays"]

NO_INDEX = 0xFFFF_FFFF
"""The index of a corner without texture coordinates or normal."""

ARRAYS: dict[str, tuple[str, int]] = {
    "meshes": ("<u8", 6),
    "points": ("<f8", 3),
    "colors": ("<f4", 3),
    "uvs": ("<f4", 2),
    "normals": ("<f4", 3),
    "polygons": ("<u4", 2),
    "corners": ("<u4", 3),
    "object_meshes": ("<u4", 1),
    "object_materials": ("<u4", 1),
    "object_matrices": ("<f8", 12),
    "plain_materials": ("<f4", 4),
}
"""Data type and number of columns of each array. `crates/formats/src/polygon_arrays.rs` describes their contents."""


def write_arrays(folder: Path, arrays: dict[str, list[Any]]) -> None:
    """Writes each array, given as a list of its pieces."""
    for name, (kind, columns) in ARRAYS.items():
        with (folder / f"{name}.bin").open("wb") as file:
            for piece in arrays[name]:
                np.asarray(piece, dtype=kind).reshape(-1, columns).tofile(file)


def read_arrays(folder: Path) -> dict[str, npt.NDArray[Any]]:
    """Reads the arrays [n, columns] in a folder.

    Raises `OSError` or `ValueError` if an array is missing or incomplete.
    """
    found = {}
    for name, (kind, columns) in ARRAYS.items():
        path = folder / f"{name}.bin"
        row = np.dtype(kind).itemsize * columns
        size = path.stat().st_size
        if size % row:
            raise ValueError(f"{path.name}: the file has {size} bytes; expected a multiple of {row}")
        table = np.fromfile(path, dtype=kind).reshape(-1, columns)
        found[name] = table.astype(table.dtype.newbyteorder("="), copy=False)
    return found
