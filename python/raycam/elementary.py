"""Elementary functions with the same bits on every processor.

NumPy and C libraries select code for the processor, and the last bit of their results depends on it.
"""

from __future__ import annotations

from typing import Literal, TypeAlias

import numpy as np
import numpy.typing as npt

from . import _core
from .arguments import Floats

__all__ = ["acos", "cos", "exp", "log", "sin", "tan"]

_Function: TypeAlias = Literal["acos", "cos", "exp", "log", "sin", "tan"]


def _apply(function: _Function, x: npt.ArrayLike) -> Floats:
    return _core.elementary(function, np.asarray(x, float, order="C"))


def acos(x: npt.ArrayLike) -> Floats:
    """Returns the angles, 0 to pi, whose cosines are `x`, in the same shape; NaN beyond [-1, 1]."""
    return _apply("acos", x)


def cos(x: npt.ArrayLike) -> Floats:
    """Returns the cosines of angles in radians, same shape."""
    return _apply("cos", x)


def exp(x: npt.ArrayLike) -> Floats:
    """Returns e to the power of each number, same shape."""
    return _apply("exp", x)


def log(x: npt.ArrayLike) -> Floats:
    """Returns natural logarithms, same shape; -inf for 0, NaN below 0."""
    return _apply("log", x)


def sin(x: npt.ArrayLike) -> Floats:
    """Returns the sines of angles in radians, same shape."""
    return _apply("sin", x)


def tan(x: npt.ArrayLike) -> Floats:
    """Returns the tangents of angles in radians, same shape."""
    return _apply("tan", x)
