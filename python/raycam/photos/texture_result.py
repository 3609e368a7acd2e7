"""The result of a texture from photographs."""

from __future__ import annotations

import os
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from ..arguments import Bools
from ..io.atomic_files import write
from ..one_line import one_line
from ..world import World
from .photo_set import PhotoSet
from .photograph_fit import PhotographFit
from .texture_report import report_page

__all__ = ["PhotoTexture"]


@one_line
@dataclass(frozen=True, eq=False)
class PhotoTexture:
    """The result of `texture_from_photos`; maps are [h, w]."""

    world: World
    """The textured object, with unlit colours, under its name."""
    texture: npt.NDArray[np.uint8]
    """The texture, sRGB uint8 [h, w, 3], with gutters."""
    seen: Bools
    """True for texels that are visible to a camera; other texels of faces have the colour of the nearest texel at the
    border of the visible regions."""
    covered: Bools
    """True for texels whose centre is in a face."""
    views: npt.NDArray[np.int32]
    """The number of cameras to which the texel is visible."""
    disagreement: npt.NDArray[np.float32]
    """The weighted standard deviation of luminance between views over its mean; high where poses are wrong."""
    view: npt.NDArray[np.int32]
    """The texel's photograph, as an index of `photographs`; -1 for texels that are blended, not visible or outside
    faces."""
    photographs: tuple[PhotographFit, ...] = field(repr=False)
    """Each photograph's gain, shift and disagreement, in the order of names."""
    _photos: PhotoSet = field(repr=False)
    _object: int

    def save_report(self, path: str | os.PathLike[str]) -> None:
        """Writes a page with maps, fits of photographs, and comparisons with the textured model.

        The page is one HTML file that works offline. It compares three photographs, with the largest, the median and
        the smallest disagreement. Raises `OSError` if the file cannot be written.
        """
        write(path, report_page(self, self._photos, self._object).encode())
