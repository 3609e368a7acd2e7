"""Random numbers that depend only on the seed, the frame, the purpose and the pulse."""

from __future__ import annotations

import numpy as np

from ..arguments import Floats

__all__ = ["standard_normals", "uniform_numbers"]

USES = {"distance": 1, "detection": 2, "azimuth": 3, "beam": 4}
"""Uses of random numbers; each has its own stream."""


def _generator(seed: int, frame: int, use: str, echo: int) -> np.random.Generator:
    mask = (1 << 64) - 1
    key = np.array([seed & mask, ((frame & 0xFFFFFFFF) << 32) | (USES[use] << 16) | echo], dtype=np.uint64)
    return np.random.Generator(np.random.Philox(key=key))


def standard_normals(count: int, seed: int, frame: int, use: str, echo: int = 0) -> Floats:
    """Returns one standard normal number per pulse or column, for an echo, float64 [count]."""
    return _generator(seed, frame, use, echo).standard_normal(count)


def uniform_numbers(count: int, seed: int, frame: int, use: str) -> Floats:
    """Returns one number from 0 to 1 per pulse, float64 [count]."""
    return _generator(seed, frame, use, 0).random(count)
