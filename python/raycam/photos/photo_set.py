"""Posed photographs of a surface, and the robust means of its texels."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from .._core import TexelViews
from ..arguments import Floats
from ..camera import Camera
from ..world import World
from .blending import write_means
from .face_views import FaceTotals
from .gains import estimate_gains
from .images import PhotoSource
from .sight import Facing
from .surface_views import PartView, SurfacePart, TexturedSurface, view_part
from .survey import Survey, SurveyBuilder, ViewedPhotograph

__all__ = ["PART_TEXELS", "BlendedTexels", "PhotoSet", "blend_texels"]

PART_TEXELS = 1 << 16
"""Number of texels looked up in a photograph at a time."""


@dataclass(frozen=True, eq=False)
class PhotoSet:
    """Photographs, their gains [cameras, 3], and the surface that they show."""

    world: World
    cameras: Mapping[str, Camera]
    source: PhotoSource
    surface: TexturedSurface
    facing: Facing
    gains: Floats
    threads: int | None

    def photographs(self) -> Iterator[tuple[int, ViewedPhotograph]]:
        """Iterates over the photographs with their numbers.

        A photograph is read when its colours are first used.
        """
        for number, (name, camera) in enumerate(self.cameras.items()):
            yield number, ViewedPhotograph(self.world, camera, self.source, name, self.threads)

    def view(
        self, number: int, photo: ViewedPhotograph, part: SurfacePart, weighted: bool = True
    ) -> PartView:
        """Returns the points of `part` that the photograph shows, with colours divided by its gain.

        Without `weighted`, weights do not fall towards jumps of depth, which takes less time.
        """
        found = view_part(
            self.world,
            photo.camera,
            photo.pyramid,
            part,
            facing=self.facing,
            edges=photo.edges if weighted else None,
            threads=self.threads,
        )
        return replace(found, colors=found.colors / self.gains[number].astype(np.float32))


@dataclass(frozen=True, eq=False)
class BlendedTexels:
    """Robust means of texels [n]."""

    colors: npt.NDArray[np.float32]
    """Linear colours [n, 3]; 0 for texels that are not visible to any camera."""
    views: npt.NDArray[np.int32]
    """The number of photographs that show the texel [n]."""
    spread: npt.NDArray[np.float32]
    """The relative spread of luminance [n]."""
    texels: npt.NDArray[np.int64]
    """The number of texels that each photograph shows."""
    survey: Survey
    """Views of a part of the texels."""
    gains: Floats
    """The gains [cameras, 3] by which the photographs' colours were divided."""


def blend_texels(
    photos: PhotoSet, memory: int, totals: FaceTotals | None, *, equalise: bool
) -> BlendedTexels:
    """The robust means of all texels. The gains of `photos` must be 1.

    Views use at most `memory` bytes at a time. If `totals` is given, the sums for each face are added to it. Gains are
    estimated if `equalise` is True: from the survey, which is taken while photographs are read for the first time.
    """
    count = len(photos.surface.texels.index)
    builder = SurveyBuilder(photos.world, photos.surface, photos.facing, photos.threads)
    colors, spread = np.zeros((count, 3), np.float32), np.zeros(count, np.float32)
    number_of_views, texels = np.zeros(count, np.int32), np.zeros(len(photos.cameras), np.int64)
    survey, gains = None, np.ones_like(photos.gains)
    step = max(PART_TEXELS, memory // (TexelViews.TEXEL_BYTES + SurfacePart.BYTES))
    for first in range(0, max(count, 1), step):
        inside = slice(first, min(first + step, count))
        views = TexelViews(inside.stop - first)
        starts = range(first, inside.stop, PART_TEXELS)
        parts = [photos.surface.part(slice(start, min(start + PART_TEXELS, inside.stop))) for start in starts]
        for number, photo in photos.photographs():
            if survey is None:
                builder.add(number, photo)
            for start, part in zip(starts, parts, strict=True):
                view = photos.view(number, photo, part)
                views.add(number, view.index + (start - first), view.weight, view.colors)
                texels[number] += len(view.index)
                if totals is not None:
                    totals.add(number, part.face[view.index], view.weight, view.colors)
        if survey is None:
            survey = builder.survey(len(photos.cameras))
            gains = estimate_gains(survey) if equalise else gains
        number_of_views[inside] = views.counts()
        write_means(views, gains, colors[inside], spread[inside])
    assert survey is not None
    return BlendedTexels(colors, number_of_views, spread, texels, survey, gains)
