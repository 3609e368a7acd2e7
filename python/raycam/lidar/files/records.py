"""Conversion of point columns to one record per point."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import numpy.typing as npt

__all__ = ["point_records", "scalar_columns"]


def scalar_columns(arrays: dict[str, npt.NDArray[Any]]) -> Iterator[tuple[str, npt.NDArray[Any]]]:
    """Yields one-dimensional columns with their names.

    The position yields x, y, z, and other vectors NAME_x, NAME_y, NAME_z. Arrays with more than three numbers
    per row yield NAME_0, NAME_1 and so on.
    """
    for name, array in arrays.items():
        if array.ndim == 1:
            yield name, array
            continue
        width = array.shape[1]
        for index, axis in enumerate("xyz"[:width] if width <= 3 else map(str, range(width))):
            yield (axis if name == "position" else f"{name}_{axis}"), array[:, index]


def point_records(arrays: dict[str, npt.NDArray[Any]]) -> npt.NDArray[Any]:
    """Returns a little-endian structured array; positions are float32, int64 becomes int32."""
    columns = dict(scalar_columns(arrays))
    kinds = []
    for name, array in columns.items():
        kind = array.dtype
        if name in ("x", "y", "z"):
            kind = np.dtype("f4")
        elif kind == np.int64:
            kind = np.dtype("i4")
        kinds.append((name, kind.newbyteorder("<")))
    records = np.empty(len(next(iter(columns.values()))), kinds)
    for name, array in columns.items():
        records[name] = array
    return records
