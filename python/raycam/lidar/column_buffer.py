"""`ColumnBuffer`: columns that are filled block by block, without a second copy in memory."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

__all__ = ["ColumnBuffer"]

GROWTH = 1.25
"""Factor by which a full buffer grows."""


class ColumnBuffer:
    """Arrays by name, to which blocks of rows are appended.

    `capacity` is the expected number of rows. Memory that is not written yet takes no space.
    """

    def __init__(self, capacity: int) -> None:
        self._capacity, self._rows = capacity, 0
        self._columns: dict[str, npt.NDArray[Any]] = {}

    def append(self, block: dict[str, npt.NDArray[Any]]) -> None:
        """Appends the rows of `block`; every block must have the same columns."""
        rows = len(next(iter(block.values())))
        end = self._rows + rows
        if not self._columns:
            self._capacity = max(self._capacity, end)
            self._columns = {
                name: np.empty((self._capacity, *array.shape[1:]), array.dtype)
                for name, array in block.items()
            }
        if end > self._capacity:
            self._resize(max(end, int(self._capacity * GROWTH)))
        for name, array in block.items():
            self._columns[name][self._rows : end] = array
        self._rows = end

    def finish(self) -> dict[str, npt.NDArray[Any]]:
        """Returns the columns, and leaves the buffer empty."""
        self._resize(self._rows)
        columns, self._columns, self._rows = self._columns, {}, 0
        return columns

    def _resize(self, capacity: int) -> None:
        for array in self._columns.values():
            array.resize(
                (capacity, *array.shape[1:]), refcheck=False
            )  # in place: nothing else refers to the array
        self._capacity = capacity
