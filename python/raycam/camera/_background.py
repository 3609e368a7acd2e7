"""Background images of cameras."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from ..errors import CameraError, nearest
from ..io.oriented_photo import ORIENTATIONS, Orientation
from ..one_line import one_line
from ._geometry import CameraGeometry

__all__ = ["Background", "Fit"]

Fit = Literal["exact", "cover"]
FITS = ["exact", "cover"]


@one_line
@dataclass(frozen=True, eq=False)
class Background:
    """The image behind the rendered objects.

    The background is a photograph that the camera took, or any other image.

    With `fit="exact"`, a photograph of the camera's size is used pixel by pixel. A photograph with the same aspect
    ratio but another size is resampled. A photograph by another `camera`, for example an undistorted photograph,
    whose camera is a pinhole, is warped to this camera's size, intrinsics and lens. Both cameras must have the same
    position and orientation. With `fit="cover"`, the image is scaled until it covers the frame, and cropped evenly on
    opposite sides.

    Raises `CameraError` for an unknown `fit` or `orientation`, and for a `camera` together with `fit="cover"`.
    """

    image: Any
    """The path of a PNG, JPEG or other image, or an array or tensor [h, w, 3]: linear floats or sRGB integers."""
    camera: CameraGeometry | None = None
    """The camera that took the image; None if the camera that has the background took the photo."""
    fit: Fit = "exact"
    """How the image is fitted to the frame: "exact" or "cover"."""
    orientation: Orientation = "auto"
    """Use of the EXIF orientation: "apply", "ignore", or "auto", which rotates the image if it fits the camera only
    after rotation.
    """

    def __post_init__(self) -> None:
        """Checks that `fit` is "exact" or "cover"."""
        if self.fit not in FITS:
            raise CameraError(nearest("fit of a background", str(self.fit), FITS), code="unknown_name")
        if self.orientation not in ORIENTATIONS:
            raise CameraError(
                nearest("orientation of a background", str(self.orientation), ORIENTATIONS),
                code="unknown_name",
            )
        if self.fit == "cover" and self.camera is not None:
            raise CameraError(
                'fit is "cover", which cannot be combined with camera; omit one of them',
                code="conflicting_values",
            )

    @property
    def file(self) -> str:
        """The image's path; raises `CameraError` for an array, because cameras store paths only."""
        if isinstance(self.image, np.ndarray) or not isinstance(self.image, str | os.PathLike):
            raise CameraError(
                "the background of a camera must be a path; pass arrays to raycam.render(..., background=array)",
                code="wrong_type",
            )
        return os.fspath(self.image)
