"""The sRGB transfer function (IEC 61966-2-1), its inverse, and the luminance of colours."""

from __future__ import annotations

from typing import TypeVar

import numpy as np
import numpy.typing as npt

__all__ = ["LUMINANCE", "linear_from_srgb", "srgb_from_linear"]

Array = TypeVar("Array", npt.NDArray[np.float32], npt.NDArray[np.float64])

LUMINANCE = np.array([0.2126, 0.7152, 0.0722], np.float32)
"""Weights of linear red, green and blue in the luminance (Rec. ITU-R BT.709), float32 [3]."""


def linear_from_srgb(values: Array) -> Array:
    """Returns the linear values of sRGB values (1 = white), in the same shape and float type."""
    high = np.power((np.maximum(values, 0.04045) + 0.055) / 1.055, 2.4)
    return np.where(values <= 0.04045, values / 12.92, high)


def srgb_from_linear(values: Array) -> Array:
    """Returns the sRGB values of linear values (1 = white), in the same shape and float type."""
    high = 1.055 * np.power(np.maximum(values, 0.0031308), 1 / 2.4) - 0.055
    return np.where(values <= 0.0031308, 12.92 * values, high)
