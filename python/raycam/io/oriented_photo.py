"""Photographs rotated by their EXIF orientation."""

from __future__ import annotations

import os
from typing import Literal, get_args

import numpy as np
import numpy.typing as npt

from .. import _core
from ..arguments import one_of
from ..errors import Notice

__all__ = ["ORIENTATIONS", "Orientation", "StoredPixels", "linear_pixels", "read_oriented"]

Orientation = Literal["auto", "apply", "ignore"]
"""Use of a photograph's EXIF orientation."""
ORIENTATIONS = list(get_args(Orientation))
StoredPixels = npt.NDArray[np.uint8] | npt.NDArray[np.float32]
"""Colours and opacity [h, w, 4]: uint8 is sRGB with linear opacity, float32 is linear."""


def read_oriented(
    path: str | os.PathLike[str], size: tuple[int, int] | None, orientation: str = "auto"
) -> tuple[StoredPixels, list[Notice]]:
    """Returns the colours and opacity [h, w, 4] of a photograph, and notices.

    Photographs of 8 bits are not converted to linear colours, because this takes four times as much memory.
    `size` is the (width, height) of the camera that took the photograph. With `orientation` "auto", the photograph is
    rotated by its EXIF orientation if only the rotated photograph has the camera's aspect ratio. A notice reports the
    rotation, or why the photograph is not rotated. "apply" always rotates the photograph, like `cv2.imread`, and
    "ignore" never rotates it.

    Raises `SettingsError` for another `orientation`, `FormatError` and `OSError` for the file.
    """
    one_of("orientation", orientation, ORIENTATIONS)
    pixels, exif, notices = _core.read_photo(path)
    if exif == 1:
        return pixels, list(notices)
    notices = [notice for notice in notices if notice.code != "ignored_orientation"]
    turned = _turn(pixels, exif)
    if orientation != "auto":
        return (turned if orientation == "apply" else pixels), notices
    stored_fits, turned_fits = _fits(pixels, size), _fits(turned, size)
    name = os.fspath(path)
    if turned_fits and not stored_fits:
        text = (
            f"photo rotated by its EXIF orientation ({exif}), because its camera has {_text(turned)} pixels"
        )
        return turned, [*notices, Notice(text, "applied_orientation", [name], 1)]
    which = (
        f"the pixels as stored ({_text(pixels)}) fit the camera"
        if stored_fits and not turned_fits
        else f"both the stored and the rotated pixels ({_text(turned)}) fit the camera"
        if stored_fits
        else f"neither the stored ({_text(pixels)}) nor the rotated pixels ({_text(turned)}) have the camera's shape"
        if size is not None
        else "the photograph's camera is unknown"
    )
    text = (
        f'the EXIF orientation ({exif}) is not applied: {which}; orientation="apply" rotates the photograph'
    )
    return pixels, [*notices, Notice(text, "ignored_orientation", [name], 1)]


def linear_pixels(pixels: StoredPixels) -> npt.NDArray[np.float32]:
    """Returns linear colours and opacity [h, w, 4]."""
    if pixels.dtype != np.uint8:
        return np.asarray(pixels, np.float32)
    found = np.empty(pixels.shape, np.float32)
    found[..., :3] = _core.linear_from_srgb8(np.ascontiguousarray(pixels[..., :3], np.uint8))
    found[..., 3] = pixels[..., 3] / np.float32(255)
    return found


def _turn(pixels: StoredPixels, exif: int) -> StoredPixels:
    """The upright photograph. Source: CIPA DC-008 (EXIF 2.32), tag Orientation."""
    if exif in (5, 6, 7, 8):
        pixels = pixels.swapaxes(0, 1)
    if exif in (3, 4, 7, 8):
        pixels = pixels[::-1]
    if exif in (2, 3, 6, 7):
        pixels = pixels[:, ::-1]
    return np.ascontiguousarray(pixels)  # type: ignore[return-value]


def _fits(pixels: StoredPixels, size: tuple[int, int] | None) -> bool:
    """True if a photograph has the camera's shape, up to its scale and one pixel."""
    if size is None:
        return False
    own: tuple[int, int] = (pixels.shape[1], pixels.shape[0])
    width, height = size
    return abs(own[0] * height - own[1] * width) <= max(size) * max(1.0, own[0] / width)


def _text(pixels: StoredPixels) -> str:
    return f"{pixels.shape[1]} x {pixels.shape[0]}"
