"""Firing patterns: the time, direction and origin of every pulse of a frame."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..arguments import Floats
from ..errors import LidarError

__all__ = ["MAX_PULSES", "Integers", "Pattern"]

Integers = npt.NDArray[np.int32]

MAX_PULSES = 1 << 26
"""The largest number of pulses per frame."""
PULSE_BYTES = 350
"""Approximate memory of a pulse while a frame is scanned."""


@dataclass(frozen=True)
class Pattern:
    """The pulses of one frame, in the order in which the device lists them.

    Directions and origins are in sensor axes: x forward, y left, z up.
    """

    times: Floats
    """Seconds from the frame's start [n]."""
    directions: Floats
    """Unit vectors [n, 3]."""
    origins: Floats
    """The starting points of the beams' axes [n, 3], in metres."""
    rings: Integers
    """The ring numbers of the manufacturer's driver [n]."""
    lasers: Integers
    """The lasers in firing order [n]."""
    columns: Integers
    """Firing cycles [n]; the columns of an organised image."""
    range_offset: Floats
    """The device reports `range_scale` * distance from the origin + `range_offset` [n], in metres."""
    range_scale: Floats
    """See `range_offset` [n]; 1 except for Velodyne's two-point corrections."""
    shape: tuple[int, int]
    """Rings and columns of an organised image; (0, 0) if the pulses form no grid."""

    def __len__(self) -> int:
        """Returns the number of pulses."""
        return len(self.times)


def check_count(count: int) -> None:
    """Raises `MemoryError` if a frame of `count` pulses is too large."""
    if count > MAX_PULSES:
        raise MemoryError(
            f"a frame of {count} pulses needs about {count * PULSE_BYTES / 2**30:.0f} GiB; limit: {MAX_PULSES} pulses; "
            "increase the rate, or split the pattern into frames, which raycam.scan_many scans one after another"
        )


def grid_pattern(
    times: Floats,
    directions: Floats,
    origins: Floats,
    rings: npt.ArrayLike,
    range_offset: npt.ArrayLike = 0.0,
    range_scale: npt.ArrayLike = 1.0,
) -> Pattern:
    """Returns the pattern of a spinning device from arrays over columns and lasers.

    `times` is [columns, lasers], `directions` and `origins` are [columns, lasers, 3] and `rings` is [lasers]; the other
    arguments are single values or arrays that broadcast to [columns, lasers].
    """
    columns, lasers = times.shape
    every = np.arange(columns * lasers)

    def spread(values: npt.ArrayLike) -> Floats:
        array = np.asarray(values, dtype=float)
        if not array.ndim:
            return np.broadcast_to(array, every.shape)  # a single value in memory
        return np.broadcast_to(array, times.shape).reshape(-1)

    return Pattern(
        times=times.reshape(-1),
        directions=directions.reshape(-1, 3),
        origins=np.broadcast_to(origins, directions.shape).reshape(-1, 3),
        rings=np.broadcast_to(np.asarray(rings, np.int32), times.shape).reshape(-1),
        lasers=(every % lasers).astype(np.int32),
        columns=(every // lasers).astype(np.int32),
        range_offset=spread(range_offset),
        range_scale=spread(range_scale),
        shape=(lasers, columns),
    )


def free_pattern(
    directions: Floats,
    times: Floats,
    rings: Integers | None = None,
    origins: Floats | None = None,
) -> Pattern:
    """Returns a pattern of pulses that form no image."""
    count = len(directions)
    zeros = np.zeros(count, np.int32)
    return Pattern(
        times=times,
        directions=unit_vectors(directions),
        origins=np.zeros((count, 3)) if origins is None else origins,
        rings=zeros if rings is None else rings,
        lasers=zeros,
        columns=np.arange(count, dtype=np.int32),
        range_offset=np.zeros(count),
        range_scale=np.ones(count),
        shape=(0, 0),
    )


def unit_vectors(vectors: Floats) -> Floats:
    """Returns `vectors` [n, 3] divided by their lengths.

    Raises `LidarError`, with the row, for a zero vector.
    """
    largest = np.abs(vectors).max(axis=1, initial=0.0)
    is_extreme = (largest < 1e-100) | (largest > 1e100)  # squares would overflow or underflow
    scale = np.where(is_extreme & (largest > 0.0) & np.isfinite(largest), largest, 1.0)
    vectors = vectors / scale[:, None]
    length = np.sqrt(vectors[:, 0] ** 2 + vectors[:, 1] ** 2 + vectors[:, 2] ** 2)
    bad = np.flatnonzero(~((length > 0.0) & np.isfinite(length)))
    if len(bad):
        raise LidarError(
            f"directions[{bad[0]}] is {vectors[bad[0]].tolist()}; expected a finite vector other than 0",
            code="out_of_range",
        )
    unit: Floats = vectors / length[:, None]
    return unit
