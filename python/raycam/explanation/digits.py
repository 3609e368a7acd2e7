"""Numbers and vectors of explanations as text."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from .. import _core

__all__ = ["DIGITS", "number", "srgb", "vector"]

DIGITS = 6


def number(value: float, digits: int = DIGITS) -> str:
    """Returns a number with `digits` significant digits as text; -0.0 becomes 0."""
    return f"{value + 0.0:.{digits}g}"


def vector(values: npt.ArrayLike, digits: int = DIGITS) -> str:
    """A vector as (x, y, z); components that are only rounding noise become 0."""
    array = np.asarray(values, dtype=np.float64)
    array = np.where(np.abs(array) < 1e-14 * np.abs(array).max(), 0.0, array)
    return "(" + ", ".join(number(value, digits) for value in array) + ")"


def srgb(linear: npt.NDArray[np.float64]) -> list[int]:
    """Converts linear RGB to 8-bit sRGB."""
    return [int(value) for value in _core.srgb_from_linear(linear.astype(np.float32), 1.0, 8, "standard")]
