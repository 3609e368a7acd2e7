"""Tracks of a COLMAP model on disk.

The tracks are written image by image and read point by point.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import IO

import numpy as np
import numpy.typing as npt

from ..arguments import Bools

__all__ = ["Tracks"]

CELLS = 1 << 16
"""Maximum number of points times images in memory."""
PART = 1 << 16
"""Number of bytes read from the file at a time; more if the row of an image is longer."""

Ints = npt.NDArray[np.integer]


class Tracks:
    """The observations of points in images, one bit for each observation.

    The observations are in a file because their number is unbounded.
    """

    def __init__(self, points: int, file: IO[bytes]) -> None:
        self._points = points
        self._width = -(-points // 8)
        self._pictures = 0
        self._file = file

    def add(self, visible: Bools) -> None:
        """Adds the next image, with True [n] for the points that it shows."""
        self._file.write(np.packbits(visible).tobytes())
        self._pictures += 1

    def __iter__(self) -> Iterator[tuple[Ints, Ints]]:
        """Iterates over the points.

        An item contains the images that show the point, and the point's index in each image, both from 0.
        """
        step = max(1, CELLS // (8 * self._pictures))
        before = np.zeros((self._pictures, 1), np.int32)
        for first in range(0, self._width, step):
            seen = np.unpackbits(self._columns(slice(first, first + step)), axis=1)
            after = before + np.cumsum(seen, axis=1, dtype=np.int32)
            for point in range(min(8 * step, self._points - 8 * first)):
                pictures = np.flatnonzero(seen[:, point])
                yield pictures, after[pictures, point] - 1
            before = after[:, -1:]

    def _columns(self, columns: slice) -> npt.NDArray[np.uint8]:
        """Reads the bytes `columns` of each image's row; returns them as uint8 [images, bytes]."""
        self._file.seek(0)
        size = max(PART // self._width, 1) * self._width
        parts = iter(lambda: self._file.read(size), b"")
        rows = [np.frombuffer(part, np.uint8).reshape(-1, self._width)[:, columns].copy() for part in parts]
        return np.concatenate(rows)
