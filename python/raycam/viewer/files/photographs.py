"""Photographs behind the cameras of a view."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ... import _core
from ...camera import Camera
from ...errors import SettingsError
from ...io.oriented_photo import linear_pixels
from ...notices import collected
from ...photos.images import Photos, PhotoSource
from ...render.channel_picture import encode_jpeg

__all__ = ["Photographs"]

LONGEST_SIDE = 2560
"""Maximum length in pixels of a sent photograph's longer side; larger photographs are averaged over blocks."""
QUALITY = 90


class Photographs:
    """Photographs by the names of their cameras.

    A photograph is read when a client looks through its camera.
    """

    def __init__(self, photos: Photos, cameras: Mapping[str, str]) -> None:
        """Finds the photographs of cameras.

        `photos` is a folder or a mapping. `cameras` contains the photographs' names by the cameras' names.

        Raises the errors of `PhotoSource` for missing photographs.
        """
        self._names = dict(cameras)
        self._source = PhotoSource(photos, self._names.values())

    @property
    def cameras(self) -> list[str]:
        """The names of the cameras with a photograph."""
        return list(self._names)

    def jpeg(self, name: str, camera: Camera) -> tuple[bytes, list[str]]:
        """The photograph of a camera as a JPEG file, and the notices of its file.

        Raises `SettingsError` for a camera without a photograph, and if its size is not the camera's.
        """
        if name not in self._names:
            raise SettingsError(f"camera {name} has no photograph", code="missing_photograph")
        with collected() as notices:
            pixels = linear_pixels(self._source.read(self._names[name], camera))[..., :3]
        step = -(-max(pixels.shape[:2]) // LONGEST_SIDE)
        height, width = (side // step for side in pixels.shape[:2])
        blocks = pixels[: height * step, : width * step].reshape(height, step, width, step, 3)
        linear = np.ascontiguousarray(blocks.mean(axis=(1, 3), dtype=np.float32))
        shown = np.asarray(_core.srgb_from_linear(linear, 1.0, 8, "standard"))
        return encode_jpeg(shown, QUALITY), [str(each) for each in notices]
