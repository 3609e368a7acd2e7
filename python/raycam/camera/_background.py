"""The picture behind what a camera sees."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from ..errors import CameraError, nearest
from ..io.oriented_photo import ORIENTATIONS, Orientation
from ._geometry import CameraGeometry

__all__ = ["Background", "Fit"]

Fit = Literal["exact", "cover"]
FITS = ["exact", "cover"]


@dataclass(frozen=True, eq=False)
class Background:
    """The picture behind what a camera sees: a photograph that it took, or any other.

    With `fit="exact"`, a photograph of the camera's size is used pixel by pixel. One that another `camera` took, as an
    undistorted photograph and its pinhole, is warped: both cameras stand at one place with the same axes, and sizes,
    intrinsics and lenses count. One of the same shape, but larger or smaller, is resampled. With `fit="cover"`, a
    picture is enlarged and cut evenly until it covers the frame.

    Raises `CameraError` for another `fit` or `orientation`, and for a camera of a picture that covers the frame.
    """

    image: Any
    """The path of a PNG, JPEG or other image, or an array or tensor [h, w, 3]: linear floats or sRGB integers."""
    camera: CameraGeometry | None = None
    """The camera that took the picture; None for the one that has it."""
    fit: Fit = "exact"
    """"exact" or "cover"."""
    orientation: Orientation = "auto"
    """Use of the EXIF orientation: "apply", "ignore", or "auto", which turns the picture if it fits only then."""

    def __post_init__(self) -> None:
        """Checks the fit."""
        if self.fit not in FITS:
            raise CameraError(nearest("fit of a background", str(self.fit), FITS), code="unknown_name")
        if self.orientation not in ORIENTATIONS:
            raise CameraError(
                nearest("orientation of a background", str(self.orientation), ORIENTATIONS),
                code="unknown_name",
            )
        if self.fit == "cover" and self.camera is not None:
            raise CameraError(
                'fit is "cover", of a picture that no camera took: give it without camera',
                code="conflicting_values",
            )

    @property
    def file(self) -> str:
        """The path of the picture; raises `CameraError` for an array, which no camera keeps."""
        if isinstance(self.image, np.ndarray) or not isinstance(self.image, str | os.PathLike):
            raise CameraError(
                "a camera keeps the path of its background: give an array to raycam.render(..., background=array)",
                code="wrong_type",
            )
        return os.fspath(self.image)
