"""Colours as in pyrender: integers are relative to 255, floats are used unchanged."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
import numpy.typing as npt

import raycam

__all__ = ["format_color_array", "format_color_vector", "format_texture_source"]

CHANNELS = {"R": 1, "RG": 2, "GB": 2, "RGB": 3, "RGBA": 4}


def format_color_vector(value: Any, length: int) -> npt.NDArray[np.float32]:
    """Returns a colour with `length` channels, float32.

    One number sets all channels, and missing channels are 1. Gives a notice for integers in 0 to 1, which
    look like fractions. Raises `ValueError` for more than one dimension.
    """
    array = np.asarray(value)
    whole = array.dtype.kind in "iu"
    if whole and array.size > 0 and array.max() == 1:
        said = (
            f"the colour {array.tolist()} is nearly black, because integers are read as 0 to 255; use floats"
        )
        warnings.warn(raycam.Notice(said, "implausible"), stacklevel=2)
    color = array.astype(np.float64) / (255.0 if whole else 1.0)
    if color.ndim == 0:
        color = np.repeat(color, length)
    color = color.squeeze()
    if color.ndim != 1:
        raise ValueError(
            f"a colour has the shape {list(array.shape)}: expected one number or a list of {length}"
        )
    return np.concatenate([color, np.ones(max(0, length - len(color)))])[:length].astype(np.float32)


def format_color_array(value: Any, shape: tuple[int, int]) -> npt.NDArray[np.float32]:
    """Returns colours [n, c] with `shape[1]` channels, float32; missing channels are 1.

    One colour [3] or [4] applies to all `shape[0]` vertices. Raises `ValueError` for other shapes.
    """
    array = np.asarray(value)
    color = array.astype(np.float64) / (255.0 if array.dtype.kind in "iu" else 1.0)
    if (color.ndim == 1 and len(color) in (3, 4)) or (color.ndim == 2 and len(color) == 1):
        color = np.broadcast_to(color, (shape[0], color.shape[-1]))
    if color.ndim != 2 or len(color) != shape[0]:
        raise ValueError(f"colours have the shape {list(array.shape)}: expected [{shape[0]}, {shape[1]}]")
    missing = np.ones((len(color), max(0, shape[1] - color.shape[1])))
    return np.concatenate([color, missing], axis=1)[:, : shape[1]].astype(np.float32)


def format_texture_source(texture: Any, target_channels: str = "RGB") -> npt.NDArray[np.uint8] | None:
    """Returns the image of a texture, uint8 [h, w] for "R", else [h, w, c]; None for None.

    `texture` is a PIL image or an array [h, w] or [h, w, c], of floats up to 1 or integers up to 255.
    `target_channels` are "R", "RG", "GB", "RGB" or "RGBA". Raises `ValueError` for other channels, and `TypeError` if
    `texture` is not an image.
    """
    if texture is None:
        return None
    if target_channels not in CHANNELS:
        raise ValueError(f"target_channels is {target_channels!r}: expected one of {', '.join(CHANNELS)}")
    if hasattr(texture, "convert") and texture.mode == "P":
        texture = texture.convert("RGBA" if target_channels == "RGBA" else "RGB")
    array = np.asarray(texture)
    if array.dtype.kind not in "fiub" or array.ndim not in (2, 3):
        raise TypeError(
            f"a texture has the type {type(texture).__name__}: expected an image [h, w] or [h, w, c]"
        )
    image = (array * 255.0 if array.dtype.kind in "fb" else array).astype(np.uint8)
    image = image[..., np.newaxis] if image.ndim == 2 else image
    given, wanted = image.shape[2], CHANNELS[target_channels]
    if target_channels == "R":
        return np.asarray(image[..., 0])
    if given == 1:
        image = np.repeat(image, wanted, axis=2)
        image[..., 3:] = 255
    elif target_channels == "GB":
        image = image[..., 1:3] if given > 2 else image
    elif given < min(wanted, 3):
        raise ValueError(f"an image with {given} channels does not contain {target_channels}")
    elif given < wanted:
        image = np.concatenate([image, np.full_like(image[..., :1], 255)], axis=2)
    return np.ascontiguousarray(image[..., :wanted])
