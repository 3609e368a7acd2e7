"""Elementary functions with the same bits on every processor.

NumPy and C libraries select code for the processor, and the last bit of their results depends on it.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from . import _core
from .arguments import Floats

__all__ = ["acos", "cos", "exp", "log", "sin", "tan"]


def acos(x: npt.ArrayLike) -> Floats:
    """Returns the angles, 0 to pi, whose cosines are `x`, in the same shape; NaN beyond [-1, 1]."""
    return _core.elementary("acos", np.asarray(x, float, order="C"))


def cos(x: npt.ArrayLike) -> Floats:
    """Returns the cosines of angles in radians, same shape."""
    return _core.elementary("cos", np.asarray(x, float, order="C"))


def exp(x: npt.ArrayLike) -> Floats:
    """Returns e to the power of each number, same shape."""
    return _core.elementary("exp", np.asarray(x, float, order="C"))


def log(x: npt.ArrayLike) -> Floats:
    """Returns natural logarithms, same shape; -inf for 0, NaN below 0."""
    return _core.elementary("log", np.asarray(x, float, order="C"))


def sin(x: npt.ArrayLike) -> Floats:
    """Returns the sines of angles in radians, same shape."""
    return _core.elementary("sin", np.asarray(x, float, order="C"))


def tan(x: npt.ArrayLike) -> Floats:
    """Returns the tangents of angles in radians, same shape."""
    return _core.elementary("tan", np.asarray(x, float, order="C"))
