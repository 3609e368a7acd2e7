"""Backgrounds of frames: photographs of a camera, images that cover a frame, and colours."""

from __future__ import annotations

import math
import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from .. import _core
from ..arguments import Bools, Floats, is_tensor, numbers
from ..camera import Background, Camera, check_camera
from ..errors import FormatError, Notice, SettingsError, WorldError
from ..io.oriented_photo import linear_pixels, read_oriented
from ..one_line import counted
from ..srgb import linear_from_srgb, srgb_from_linear

__all__ = ["numpy_background", "picture_behind"]

Colors = npt.NDArray[np.float32]
PICTURES = (".png", ".jpg", ".jpeg", ".webp", ".bmp", ".tif", ".tiff", ".exr", ".hdr")
MAX_SUBPIXELS = 8
"""Maximum number of samples per pixel side when a larger image is resampled."""


def numpy_background(given: Any) -> Any:
    """Returns a background with tensors converted to NumPy arrays; other values are unchanged.

    Tensors may be from PyTorch, JAX, TensorFlow or another library with DLPack. Raises `SettingsError` for tensors that
    are not in the CPU's memory, or that require a gradient.
    """
    if isinstance(given, Background) and is_tensor(given.image):
        return replace(given, image=numbers("background", given.image))
    return numbers("background", given) if is_tensor(given) else given


def picture_behind(given: Any, camera: Camera | None, size: tuple[int, int]) -> tuple[Colors, list[Notice]]:
    """Returns the image behind a frame, [h, w, 3] in linear light, and notices.

    `size` is (width, height). `given` is a colour, the path of an image, an array or CPU tensor [h, w, 3] of that size
    (uint8 and uint16 are sRGB, floats linear), or a `Background`. An image file of the frame's size is used pixel by
    pixel; any other image is scaled until it covers the frame.

    Raises `SettingsError` for other types and for photographs of another size, and `FormatError` or `OSError` for
    files.
    """
    width, height = size
    given = numpy_background(given)
    if isinstance(given, str) and Path(given).suffix.lower() not in PICTURES:
        return np.broadcast_to(_color(given), (height, width, 3)).astype(np.float32), []
    if isinstance(given, str | os.PathLike):
        pixels, notices = _read(given, size, "auto")
        if pixels.shape == (height, width, 3):
            return pixels, notices
        message = (
            f"{os.fspath(given)} ({_size(pixels)} pixels) is scaled and cropped to the frame's {width} x {height} "
            "pixels, so it does not match the world's perspective; use a photograph of the camera's size, or a "
            "raycam.Background with its own camera"
        )
        notices.append(Notice(message, "resampled_background"))
        return _covering(pixels, size), notices
    if isinstance(given, Background):
        return _behind(given, camera, size)
    if isinstance(given, np.ndarray) and given.ndim == 3:
        pixels = _linear(given)
        if pixels.shape != (height, width, 3):
            raise SettingsError(
                f"background has the shape {list(given.shape)}; expected the frame's shape, [{height}, {width}, 3]",
                code="wrong_shape",
            )
        return pixels, []
    return np.broadcast_to(_color(given), (height, width, 3)).astype(np.float32), []


def _behind(given: Background, camera: Camera | None, size: tuple[int, int]) -> tuple[Colors, list[Notice]]:
    """A `Background` in linear light, and notices."""
    array = isinstance(given.image, np.ndarray)
    taken = size if given.camera is None else given.camera.size
    pixels, notices = (_linear(given.image), []) if array else _read(given.image, taken, given.orientation)
    name, own = "the background" if array else os.fspath(given.image), (pixels.shape[1], pixels.shape[0])
    if given.fit == "cover":
        return (pixels if own == size else _covering(pixels, size)), notices
    taker = None if given.camera is None else check_camera(given.camera)
    if taker is None:
        if own == size:
            return pixels, notices
        if (
            abs(own[0] * size[1] - own[1] * size[0]) > max(size) * max(1.0, own[0] / size[0])
            or camera is None
        ):
            raise SettingsError(
                f"{name} has {_size(pixels)} pixels, but the camera has {size[0]} x {size[1]}; pass the camera that "
                'took the photograph, raycam.Background(image, camera=...), or crop it with fit="cover"',
                code="wrong_shape",
            )
        taker = camera.resized(own)
        message = f"{name} of {_size(pixels)} is resampled to the camera's {size[0]} x {size[1]} pixels"
        notices.append(Notice(message, "resampled_background"))
    if own != taker.size:
        raise SettingsError(
            f"{name} has {_size(pixels)} pixels, but the camera that took it has {taker.size[0]} x {taker.size[1]}; "
            "both sizes must be equal; camera.resized((width, height)) returns the camera of a scaled photograph",
            code="wrong_shape",
        )
    if camera is None:
        raise SettingsError(
            "a background photograph with its own camera requires a frame with a camera; this frame has none",
            code="unsupported_camera",
        )
    if taker.with_background(None) == camera.with_background(None):
        return pixels, notices
    return _warped(pixels, _lying(taker), _lying(camera), name, notices)


def _lying(camera: Camera) -> Camera:
    """The camera at rest at the origin, without rotation."""
    return camera.with_background(None).still().at_pose(np.eye(3), np.zeros(3))


def _warped(
    pixels: Colors, taker: Camera, camera: Camera, name: str, notices: list[Notice]
) -> tuple[Colors, list[Notice]]:
    """Returns the image of `taker`, warped to `camera`, and notices about black pixels.

    The result is black outside of the image of `taker`. Between pixels, stored values are interpolated
    linearly, as in OpenCV's `remap`.
    """
    if camera.is_parallel or taker.is_parallel:
        raise SettingsError(
            "a background photograph cannot be warped to or from a camera with parallel rays",
            code="unsupported_camera",
        )
    width, height = camera.size
    shown = srgb_from_linear(pixels)
    centers = camera._centers().reshape(-1, 2)

    def mapped(offset: Floats) -> Floats:
        origins, directions = camera.rays(centers + offset)
        known: Bools = np.asarray(np.isfinite(directions).all(axis=1))
        found, seen = taker.project(np.where(known[:, None], origins + directions, [0.0, 0.0, 1.0]))
        return np.where((known & seen)[:, None], found, np.nan) - (taker.corner + 0.5)

    middle = mapped(np.zeros(2))
    steps = np.abs(np.diff(middle.reshape(height, width, 2), axis=1)).max(axis=2, initial=0)
    step = float(np.nanmedian(steps)) if np.isfinite(steps).any() else 1.0
    total, weight = _sampled(shown, mapped, middle, _subpixels(step))
    outside = int(np.count_nonzero(weight == 0))
    if outside:
        share = 100 * outside / weight.size
        message = (
            f"{name} does not cover {counted(outside, 'pixel')} ({share:.3g} %) of the frame; these pixels are "
            "black"
        )
        notices.append(Notice(message, "uncovered_background"))
    seen = (total / np.maximum(weight, 1)[:, None]).astype(np.float32).reshape(height, width, 3)
    return linear_from_srgb(seen), notices


def _sampled(shown: Colors, mapped: Any, middle: Floats, points: int) -> tuple[Floats, Floats]:
    """Returns sums [n, 3] of stored values in each pixel, and the counts [n] of the values.

    Each pixel has `points` x `points` positions.
    """
    total, weight = np.zeros((len(middle), 3)), np.zeros(len(middle))
    for i in range(points * points):
        offset = (np.array([i % points, i // points]) + 0.5) / points - 0.5
        values, there = _interpolated(shown, middle if points == 1 else mapped(offset))
        total += values
        weight += there
    return total, weight


def _covering(pixels: Colors, size: tuple[int, int]) -> Colors:
    """An image that covers a frame of `size`, cropped evenly along its longer direction."""
    own_height, own_width = pixels.shape[:2]
    width, height = size
    scale = max(width / own_width, height / own_height)
    columns, rows = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
    places = np.stack([columns.ravel() - width / 2, rows.ravel() - height / 2], axis=1)
    half = np.array([own_width, own_height]) / 2 - 0.5

    def mapped(offset: Floats) -> Floats:
        found: Floats = (places + offset) / scale + half
        return found

    total, weight = _sampled(srgb_from_linear(pixels), mapped, mapped(np.zeros(2)), _subpixels(1 / scale))
    seen = (total / np.maximum(weight, 1)[:, None]).astype(np.float32).reshape(height, width, 3)
    return linear_from_srgb(seen)


def _subpixels(step: float) -> int:
    """The number of lookups along each side of a pixel that covers `step` pixels of the image."""
    return min(MAX_SUBPIXELS, max(1, math.ceil(step - 0.05)))


def _interpolated(shown: Colors, places: Floats) -> tuple[Floats, Bools]:
    """Interpolated values [n, 3] of an image, 0 outside, and True [n] inside."""
    height, width = shown.shape[:2]
    with np.errstate(invalid="ignore"):
        within = (places >= -0.5 - 1e-9) & (places <= np.array([width, height]) - 0.5 + 1e-9)
    inside: Bools = np.asarray(within.all(axis=1))
    x, y = np.where(inside[:, None], np.clip(places, 0, [width - 1, height - 1]), 0).T
    left, top = np.floor(x).astype(int), np.floor(y).astype(int)
    right, bottom = np.minimum(left + 1, width - 1), np.minimum(top + 1, height - 1)
    u, v = (x - left)[:, None], (y - top)[:, None]
    above = shown[top, left] * (1 - u) + shown[top, right] * u
    below = shown[bottom, left] * (1 - u) + shown[bottom, right] * u
    return np.where(inside[:, None], above * (1 - v) + below * v, 0.0), inside


def _read(
    path: str | os.PathLike[str], size: tuple[int, int], orientation: str
) -> tuple[Colors, list[Notice]]:
    """Returns the pixels of an image file in linear light, and notices.

    `size` is the size of the camera that took the photo, which determines whether the EXIF orientation is
    applied.

    Raises `FormatError` for a malformed file, and `OSError` if the file cannot be read.
    """
    try:
        pixels, notices = read_oriented(path, size, orientation)
    except FormatError as fault:
        raise FormatError(
            f"{fault}; expected a PNG or JPEG image as a background", code="unknown_format"
        ) from None
    return np.ascontiguousarray(linear_pixels(pixels)[..., :3]), list(notices)


def _linear(array: npt.NDArray[Any]) -> Colors:
    if array.ndim != 3 or array.shape[2] != 3:
        raise SettingsError(
            f"background has the shape {list(array.shape)}: expected [height, width, 3]", code="wrong_shape"
        )
    if array.dtype == np.uint8:
        return _core.linear_from_srgb8(np.ascontiguousarray(array))
    if array.dtype == np.uint16:
        return linear_from_srgb((array / 65535).astype(np.float32))
    if array.dtype.kind != "f":
        raise SettingsError(
            f"background of dtype {array.dtype}: expected uint8, uint16 or floats", code="wrong_type"
        )
    return array.astype(np.float32)


def _size(pixels: Colors) -> str:
    return f"{pixels.shape[1]} x {pixels.shape[0]}"


def _color(color: Any) -> Colors:
    """A colour as linear red, green, blue."""
    if isinstance(color, str) and color == "transparent":
        raise SettingsError(
            "background 'transparent' is not a colour; use transparent_background=True", code="wrong_type"
        )
    probe = _core.World("z", "", None)
    try:
        _core.world_add_object(probe, {"box": {}, "color": color}, None)
    except WorldError as fault:
        raise SettingsError(
            f"background {color!r} is neither a colour nor a .png or .jpg image: {str(fault).splitlines()[0]}",
            code="wrong_type",
        ) from None
    found: Colors = probe.triangle_colors()[0]
    return found
