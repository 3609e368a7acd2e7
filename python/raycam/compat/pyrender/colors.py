"""Colours as pyrender understands them: whole numbers are of 255, floats are as they are."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

__all__ = ["format_color_array", "format_color_vector"]


def format_color_vector(value: Any, length: int) -> npt.NDArray[np.float32]:
    """A colour of `length` channels, float32; one number is all channels, and missing ones are 1.

    Raises `ValueError` for more than one dimension.
    """
    array = np.asarray(value)
    whole = array.dtype.kind in "iu"
    color = array.astype(np.float64) / (255.0 if whole else 1.0)
    if color.ndim == 0:
        color = np.repeat(color, length)
    color = color.squeeze()
    if color.ndim != 1:
        raise ValueError(f"a colour of shape {list(array.shape)}: expected one number or a list of {length}")
    return np.concatenate([color, np.ones(max(0, length - len(color)))])[:length].astype(np.float32)


def format_color_array(value: Any, shape: tuple[int, int]) -> npt.NDArray[np.float32]:
    """Colours [n, c] with `shape[1]` channels, float32; missing ones are 1. Raises `ValueError`."""
    array = np.asarray(value)
    color = array.astype(np.float64) / (255.0 if array.dtype.kind in "iu" else 1.0)
    if color.ndim != 2:
        raise ValueError(f"colours of shape {list(array.shape)}: expected [n, {shape[1]}]")
    missing = np.ones((len(color), max(0, shape[1] - color.shape[1])))
    return np.concatenate([color, missing], axis=1)[:, : shape[1]].astype(np.float32)
