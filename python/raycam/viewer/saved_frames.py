"""Frames read back from .npz files, to be looked at and compared."""

from __future__ import annotations

import json
import os
import zipfile
from typing import Any

import numpy as np

from ..camera import Camera
from ..errors import FormatError
from ..render.frame import CHANNELS, Frame

__all__ = ["load_frame"]


def load_frame(path: str | os.PathLike[str]) -> Frame:
    """The frame that `Frame.save` wrote to an .npz file. Raises `FormatError` for other files, and `OSError`."""
    try:
        with open(path, "rb") as file:
            if not zipfile.is_zipfile(file):
                raise ValueError
            file.seek(0)
            with np.load(file, allow_pickle=False) as saved:
                arrays: dict[str, Any] = {name: saved[name] for name in saved.files}
    except (ValueError, zipfile.BadZipFile, EOFError):
        raise FormatError(f"{os.fspath(path)}: this is no .npz file of raycam") from None
    channels = {name: arrays[name] for name in CHANNELS if name in arrays}
    if not channels or "size" not in arrays or "region" not in arrays:
        raise FormatError(f"{os.fspath(path)}: this .npz file has no frame of raycam")
    width, height = (int(side) for side in arrays["size"])
    x, y, columns, rows = (int(side) for side in arrays["region"])
    for name, array in channels.items():
        if array.shape[:2] != (rows, columns) or array.dtype != CHANNELS[name][0]:
            raise FormatError(f"{os.fspath(path)}: {name} is {array.dtype.name} {list(array.shape)}")
    camera = Camera.from_dict(json.loads(str(arrays["camera"]))) if "camera" in arrays else None
    return Frame(channels, camera=camera, size=(width, height), region=(x, y, columns, rows))
