"""Frames read back from .npz and .exr files, to be viewed and compared."""

from __future__ import annotations

import json
import os
import struct
import zipfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from .. import _core
from ..camera import Camera
from ..errors import CameraError, FormatError, Notice
from ..render.frame import CHANNELS, Frame, channel_form, is_channel, is_pass

__all__ = ["ENDINGS", "is_frame", "load_frame"]

Planes = dict[str, npt.NDArray[Any]]

MOST_HEADER = 16 << 20
"""Maximum number of header bytes that are read."""

TOGETHER = ("RGB", "rgb", "XYZ", "xyz", "UV", "uv", "XY")
"""Last letters of EXR channels that together form one plane, if all of these channels exist."""


def is_frame(path: str | os.PathLike[str]) -> bool:
    """True for the extension of a frame's file."""
    return Path(path).suffix.lower() in ENDINGS


def load_frame(path: str | os.PathLike[str]) -> Frame:
    """Returns the frame in an .npz or .exr file.

    The file is from `Frame.save`, or it is a single-part .exr file of another program.

    Channels of other programs keep their names; related channels of a layer are combined, such as `beauty.RGB` from
    `beauty.R`, `beauty.G` and `beauty.B`. R, G and B without a layer are `color`, A is `alpha`. Floats of .exr files
    are float32 [h, w] or [h, w, n], integers int32, or float64 if they are larger. The frame's region is the
    data window.

    Raises `FormatError` for other files, and `OSError` if the file cannot be read.
    """
    try:
        return ENDINGS[Path(path).suffix.lower()](path)
    except KeyError:
        raise FormatError(
            f"{os.fspath(path)}: not a saved frame; expected {' or '.join(ENDINGS)}", code="unknown_format"
        ) from None


def _load_npz(path: str | os.PathLike[str]) -> Frame:
    try:
        with open(path, "rb") as file:
            if not zipfile.is_zipfile(file):
                raise ValueError
            file.seek(0)
            with np.load(file, allow_pickle=False) as saved:
                arrays: dict[str, Any] = {name: saved[name] for name in saved.files}
    except (ValueError, zipfile.BadZipFile, EOFError):
        raise FormatError(
            f"{os.fspath(path)}: not an .npz file written by raycam", code="unknown_format"
        ) from None
    names = [*(name for name in CHANNELS if name in arrays), *filter(is_pass, arrays)]
    channels = {name: arrays[name] for name in dict.fromkeys(names)}
    if not channels or "size" not in arrays or "region" not in arrays:
        raise FormatError(
            f"{os.fspath(path)}: this .npz file does not contain a frame of raycam", code="wrong_format"
        )
    width, height = (int(side) for side in arrays["size"])
    x, y, columns, rows = (int(side) for side in arrays["region"])
    for name, array in channels.items():
        if array.shape[:2] != (rows, columns) or array.dtype != channel_form(name)[0]:
            raise FormatError(
                f"{os.fspath(path)}: channel {name} is {array.dtype.name} {list(array.shape)}; expected "
                f"{channel_form(name)[0].name} [{rows}, {columns}, ...]",
                code="wrong_shape",
            )
    camera = _camera(path, str(arrays["camera"])) if "camera" in arrays else None
    return Frame(channels, camera=camera, size=(width, height), region=(x, y, columns, rows))


def _load_exr(path: str | os.PathLike[str]) -> Frame:
    channels = _core.read_exr(path)
    try:
        windows, notes = _header(path)
    except (ValueError, KeyError, struct.error):
        raise FormatError(
            f"{os.fspath(path)}: the header cannot be read; save the file again", code="damaged_data"
        ) from None
    size, region, notices = _places(path, windows, notes)
    planes = _planes({name: _numbers(name, whole, bits) for name, whole, bits in channels})
    notices += [
        Notice("the values are float32, because EXR files cannot contain float64", "rounded_values", [name])
        for name, array in planes.items()
        if is_channel(name) and channel_form(name)[0] != array.dtype
    ]
    camera = _camera(path, notes["raycam.camera"]) if "raycam.camera" in notes else None
    return Frame(planes, camera=camera, size=size, region=region, notices=notices)


ENDINGS: dict[str, Callable[[str | os.PathLike[str]], Frame]] = {".npz": _load_npz, ".exr": _load_exr}
"""The readers of frames by the endings of their files."""


def _camera(path: str | os.PathLike[str], text: str) -> Camera:
    try:
        return Camera.from_dict(json.loads(text))
    except (ValueError, TypeError, CameraError) as fault:
        raise FormatError(
            f"{os.fspath(path)}: the camera cannot be read: {fault}", code="invalid_camera"
        ) from None


def _header(path: str | os.PathLike[str]) -> tuple[list[list[int]], dict[str, str]]:
    """Returns the windows and texts in the header of a complete file.

    The data window and the display window are given as x, y, columns and rows. The texts are returned by
    name.

    The magic number and the version are followed by attributes (name, 0, type, 0, length, value). A 0 ends
    the attributes.
    """
    with open(path, "rb") as file:
        data = file.read(MOST_HEADER)
    windows: dict[str, list[int]] = {}
    texts: dict[str, str] = {}
    at = 8
    while data[at : at + 1] not in (b"", b"\0"):
        name_end = data.index(b"\0", at)
        kind_end = data.index(b"\0", name_end + 1)
        name, kind = data[at:name_end].decode(errors="replace"), data[name_end + 1 : kind_end]
        (length,) = struct.unpack_from("<i", data, kind_end + 1)
        at = kind_end + 5 + length
        value = data[kind_end + 5 : at]
        if kind == b"box2i":
            left, top, right, bottom = struct.unpack("<4i", value)
            windows[name] = [left, top, right - left + 1, bottom - top + 1]
        elif kind == b"string":
            texts[name] = value.decode(errors="replace")
    return [windows["dataWindow"], windows["displayWindow"]], texts


def _places(
    path: str | os.PathLike[str], windows: list[list[int]], notes: Mapping[str, str]
) -> tuple[tuple[int, int], tuple[int, int, int, int], list[Notice]]:
    """Returns the size and region of the frame, and notices.

    The size and the region are taken from raycam's own attributes, or else from the file's windows.
    """
    (left, top, columns, rows), (x, y, width, height) = windows
    region, size = (left - x, top - y, columns, rows), (width, height)
    if "raycam.region" in notes and "raycam.size" in notes:
        try:
            own_x, own_y, *_ = region = tuple(map(int, notes["raycam.region"].split()))  # type: ignore[assignment]
            width, height = size = tuple(map(int, notes["raycam.size"].split()))  # type: ignore[assignment]
            left, top = own_x + x, own_y + y
        except ValueError:
            region = (0, 0, 0, 0)
        if region[2:] != (columns, rows):
            raise FormatError(
                f"{os.fspath(path)}: the header contains raycam.region {notes['raycam.region']!r} and raycam.size "
                f"{notes['raycam.size']!r}, which do not fit the file's {columns} x {rows} pixels",
                code="wrong_shape",
            )
    is_within = 0 <= left - x <= width - columns and 0 <= top - y <= height - rows
    if is_within:
        return size, region, []
    message = (
        "the data window extends beyond the display window; pixel positions are relative to the data window's "
        "upper left corner"
    )
    return (columns, rows), (0, 0, columns, rows), [Notice(message, "ignored_feature")]


def _numbers(name: str, whole: bool, bits: npt.NDArray[np.uint32]) -> npt.NDArray[Any]:
    """The samples of a channel: float32, int32, or float64 for integers beyond int32."""
    if not whole:
        return bits.view(np.float32)
    is_id = name.endswith(".id")  # an id channel of raycam, in which -1 is stored as 4294967295
    return bits.view(np.int32) if is_id or bits.max() < 1 << 31 else bits.astype(np.float64)


def _planes(channels: Mapping[str, npt.NDArray[Any]]) -> Planes:
    """Returns the planes of a file's channels.

    Related channels are combined, with raycam's names if possible.
    """
    layers: dict[str, dict[str, npt.NDArray[Any]]] = {}
    for name, array in channels.items():
        layer, _, letters = name.rpartition(".")
        layers.setdefault(layer, {})[letters] = array
    planes: Planes = {}
    for layer, parts in layers.items():
        named: Planes = {}
        for letters in TOGETHER:
            together = [parts.get(letter) for letter in letters]
            if all(part is not None and part.dtype == np.float32 for part in together):
                named[letters] = np.stack([parts.pop(letter) for letter in letters], axis=2)
        named |= parts
        for letters, array in named.items():
            own = layer or {"RGB": "color", "A": "alpha"}.get(letters, letters)
            planes[own if _fits(own, array) and own not in planes else _joined(layer, letters)] = array
    first = [name for name in CHANNELS if name in planes]
    return {name: planes[name] for name in [*first, *(name for name in planes if name not in first)]}


def _joined(layer: str, letters: str) -> str:
    return f"{layer}.{letters}" if layer else letters


def _fits(name: str, array: npt.NDArray[Any]) -> bool:
    """Returns True if the array has the form of the channel of this name.

    Only the precision of floats may differ.
    """
    if not is_channel(name):
        return False
    dtype, components = channel_form(name)
    return array.dtype.kind == dtype.kind and array.shape[2:] == ((components,) if components > 1 else ())
