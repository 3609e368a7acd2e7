"""CSV with a header line; numbers are written so that they are read back exactly."""

from __future__ import annotations

from typing import Any

import numpy.typing as npt

from .records import scalar_columns

__all__ = ["csv_bytes"]


def csv_bytes(arrays: dict[str, npt.NDArray[Any]]) -> bytes:
    """Returns the bytes of a CSV file with a header and a row for each point."""
    columns = dict(scalar_columns(arrays))
    texts = [[str(value) for value in column.tolist()] for column in columns.values()]
    rows = [",".join(row) for row in zip(*texts, strict=True)]
    return "\n".join([",".join(columns), *rows, ""]).encode()
