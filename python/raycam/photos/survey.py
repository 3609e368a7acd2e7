"""Views of selected texels in all photographs.

The photographs' gains and shifts are estimated from these views.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from .._core import PhotoPyramid
from ..arguments import Floats, product
from ..camera import Camera
from ..srgb import LUMINANCE
from ..world import World
from .depth_edges import DepthEdges, find_depth_edges
from .images import PhotoSource
from .sight import Facing
from .surface_views import BORDER_WIDTH_PX, TexturedSurface, view_part

__all__ = ["Survey", "SurveyBuilder", "ViewedPhotograph"]

Single = npt.NDArray[np.float32]

MAX_POINTS = 1 << 14
"""Number of texels in a survey."""
MAX_VIEWS = 1 << 20
"""Maximum number of views in a survey, 48 MB."""
COLUMNS: tuple[tuple[type[np.generic], tuple[int, ...]], ...] = (
    (np.int32, ()),
    (np.int32, ()),
    (np.float32, (3,)),
    (np.float32, ()),
    (np.float32, ()),
    (np.float32, (2,)),
    (np.float32, (2,)),
)
"""Types and shapes of a survey's arrays."""


class ViewedPhotograph:
    """A photograph and its depth jumps, both computed on first use."""

    def __init__(
        self, world: World, camera: Camera, source: PhotoSource, name: str, threads: int | None
    ) -> None:
        self.camera = camera
        self._world, self._source, self._name, self._threads = world, source, name, threads
        self._pyramid: PhotoPyramid | None = None
        self._edges: DepthEdges | None = None

    def pyramid(self) -> PhotoPyramid:
        """The photograph at full, half, quarter, ... size."""
        if self._pyramid is None:
            self._pyramid = PhotoPyramid(self._source.read(self._name, self.camera))
        return self._pyramid

    def edges(self) -> DepthEdges:
        """The distances from jumps of depth."""
        if self._edges is None:
            self._edges = find_depth_edges(self._world, self.camera, BORDER_WIDTH_PX, self._threads)
        return self._edges


@dataclass(frozen=True, eq=False)
class Survey:
    """Views [m]: points of the surface that photographs show."""

    points: int
    """The number of points."""
    cameras: int
    """The number of photographs."""
    point: npt.NDArray[np.int32]
    """The index of the point of each view [m]."""
    camera: npt.NDArray[np.int32]
    """The index of the photograph of each view [m], ascending."""
    color: Single
    """Linear colours [m, 3]."""
    weight: Single
    """The weights of the views [m]."""
    footprint: Single
    """Pixels of the photograph for each side of a texel."""
    place: Single
    """The pixel coordinates [m, 2], measured from the image's top left corner."""
    slope: Single
    """Derivatives [m, 2] of the photograph's luminance by its pixels, at the texel's resolution."""


class SurveyBuilder:
    """Collects views of evenly chosen texels, at most `MAX_VIEWS`, photograph by photograph.

    If there are more views, every other texel is dropped until the number is small enough.
    """

    def __init__(self, world: World, surface: TexturedSurface, facing: Facing, threads: int | None) -> None:
        self._world, self._surface, self._facing, self._threads = world, surface, facing, threads
        count = len(surface.texels.index)
        self._chosen = np.arange(0, count, max(1, -(-count // MAX_POINTS)))
        self._columns: list[npt.NDArray[Any]] = [np.zeros((0, *shape), kind) for kind, shape in COLUMNS]

    def add(self, number: int, photo: ViewedPhotograph) -> None:
        """Adds the views in a photograph; numbers ascend."""
        view = view_part(
            self._world,
            photo.camera,
            photo.pyramid,
            self._surface.part(self._chosen),
            facing=self._facing,
            edges=photo.edges,
            threads=self._threads,
        )
        if not len(view.index):
            return
        row = (
            self._chosen[view.index].astype(np.int32),
            np.full(len(view.index), number, np.int32),
            view.colors,
            view.weight,
            view.footprint,
            view.places.astype(np.float32),
            _slopes(photo.pyramid(), view.places, view.footprint, self._threads),
        )
        self._columns = [np.concatenate(pair) for pair in zip(self._columns, row, strict=True)]
        while len(self._columns[0]) > MAX_VIEWS and len(self._chosen) > 1:
            self._chosen = self._chosen[::2]
            kept = np.isin(self._columns[0], self._chosen)
            self._columns = [column[kept] for column in self._columns]

    def survey(self, cameras: int) -> Survey:
        """Returns the views that were added, of `cameras` photographs."""
        point = np.searchsorted(self._chosen, self._columns[0]).astype(np.int32)
        return Survey(len(self._chosen), cameras, point, *self._columns[1:])


def _slopes(pyramid: PhotoPyramid, places: Floats, footprint: Single, threads: int | None) -> Single:
    """Returns central differences [n, 2] of the luminance over a texel, but at least two pixels."""
    areas = footprint[:, None, None] * np.eye(2)
    reach = np.maximum(footprint, 1.0).astype(np.float64)
    found = np.empty((len(places), 2), np.float32)
    for axis in range(2):
        step = np.zeros((len(places), 2))
        step[:, axis] = reach
        ahead, behind = (
            product(pyramid.mean_colors(places + sign * step, areas, threads)[:, :3], LUMINANCE)
            for sign in (1, -1)
        )
        found[:, axis] = (ahead - behind) / (2 * reach)
    return found
