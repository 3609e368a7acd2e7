"""Reading photographs, and their colours at fractional pixels."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from .. import _core
from ..arguments import Floats
from ..camera import Camera
from ..errors import SettingsError
from ..io.oriented_photo import read_oriented
from ..notices import warn_all

__all__ = ["Photos", "Pyramid", "read_photo"]

Photos = str | os.PathLike[str] | Mapping[str, Any]
"""A folder with the photographs, or paths or arrays by the photographs' names."""


def read_photo(
    photos: Photos, name: str, camera: Camera, orientation: str = "auto"
) -> npt.NDArray[np.float32]:
    """The photograph of this name, linear [h, w, 4] with opacity; `orientation` as in `texture_from_photos`.

    Raises `SettingsError` if its size is not the camera's, `FormatError` and `OSError` for its file.
    """
    given = photos[name] if isinstance(photos, Mapping) else Path(photos) / name
    if isinstance(given, np.ndarray):
        pixels = given[..., :3]
        linear = _core.linear_from_srgb8(np.ascontiguousarray(pixels)) if pixels.dtype == np.uint8 else pixels
        opaque = np.ones((*linear.shape[:2], 1), np.float32)
        found = np.concatenate([linear.astype(np.float32), opaque], axis=2)
    else:
        found, notices = read_oriented(given, camera.size, orientation)
        warn_all(notices)
    height, width = found.shape[:2]
    if (width, height) != camera.size:
        raise SettingsError(
            f"photograph {name!r} has {width} x {height} pixels, and its camera {camera.size[0]} x {camera.size[1]}; "
            "resize the camera: load_cameras(..., size=) or --size"
        )
    return found


class Pyramid:
    """A photograph with its halvings, for lookups of a footprint."""

    def __init__(self, photo: npt.NDArray[np.float32]) -> None:
        self.levels = [photo]
        while min(self.levels[-1].shape[:2]) > 1:
            last = self.levels[-1]
            height, width = (last.shape[0] // 2) * 2, (last.shape[1] // 2) * 2
            self.levels.append(
                last[:height, :width].reshape(height // 2, 2, width // 2, 2, -1).mean(axis=(1, 3))
            )

    def at(self, places: Floats, footprint: Floats) -> npt.NDArray[np.float32]:
        """Colours [n, 4] at places [n, 2] in pixels from the image's corner, averaged over `footprint` [n] pixels."""
        level = np.clip(np.log2(np.maximum(footprint, 1.0)), 0, len(self.levels) - 1)
        low = np.floor(level).astype(int)
        share = (level - low)[:, None]
        found = np.zeros((len(places), self.levels[0].shape[2]))
        for number in np.unique(low):
            some = low == number
            found[some] = (1 - share[some]) * self._bilinear(number, places[some])
            if share[some].any():
                found[some] += share[some] * self._bilinear(
                    min(number + 1, len(self.levels) - 1), places[some]
                )
        return found.astype(np.float32)

    def _bilinear(self, level: int, places: Floats) -> Floats:
        image = self.levels[level]
        height, width = image.shape[:2]
        x = np.clip(places[:, 0] / 2.0**level - 0.5, 0, width - 1)
        y = np.clip(places[:, 1] / 2.0**level - 0.5, 0, height - 1)
        left, top = np.floor(x).astype(int), np.floor(y).astype(int)
        right, bottom = np.minimum(left + 1, width - 1), np.minimum(top + 1, height - 1)
        fx, fy = (x - left)[:, None], (y - top)[:, None]
        upper = (1 - fx) * image[top, left] + fx * image[top, right]
        lower = (1 - fx) * image[bottom, left] + fx * image[bottom, right]
        found: Floats = (1 - fy) * upper + fy * lower
        return found
