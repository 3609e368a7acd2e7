"""Textures composed of one photograph for each face, with levelled seams."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..arguments import Floats
from ..world.face_geometry import interpolate, unique_rows
from .face_views import FaceTotals, choose_views, neighbor_faces
from .photo_set import PART_TEXELS, BlendedTexels, PhotoSet
from .seam_levels import SeamSamples, TexelLinks, level_texels, level_vertices, link_texels
from .surface_views import SurfacePart
from .survey import ViewedPhotograph

__all__ = ["Composite", "add_detail", "compose"]

Ints = npt.NDArray[np.int64]
Ids = npt.NDArray[np.int32]
Single = npt.NDArray[np.float32]

EDGE_PLACES = (0.0, 0.5, 1.0)
"""Places on an edge between two photographs, as fractions of its length, at which their colours are compared."""
EDGE_INSET = 0.01
"""Distance of the compared points from the edge, as a fraction of the way to the face's centroid."""
EDGE_WIDTH_TEXELS = 0.25
"""Width over which the compared colours are averaged. Half of the width lies beyond the edge, where the surface bends
away from the face's plane; a width of 1 texel would shift the mean by a tenth of a texel."""
FINE_TEXELS, COARSE_TEXELS = 8, 32
"""Radii of the averages that separate three bands."""


@dataclass(frozen=True, eq=False)
class Composite:
    """The colours and photographs of the texels [n] of a composed texture."""

    colors: Single
    """Linear colours [n, 3]."""
    view: Ids
    """The photograph of each texel [n]; -1 for blended texels, and for texels that are not visible to any camera."""


class _Lookups:
    """Points [m] of the surface, each looked up in one photograph; -1 means no photograph."""

    def __init__(self, view: Ids, part: Callable[[Ints], SurfacePart], weighted: bool = False) -> None:
        self.colors = np.full((len(view), 3), np.nan, np.float32)
        self.weights = np.zeros(len(view), np.float32)
        self._weighted = weighted
        self._order = np.argsort(view, kind="stable")
        self._sorted, self._part = view[self._order], part

    def add(self, photos: PhotoSet, number: int, photo: ViewedPhotograph) -> None:
        """Looks up the points that belong to one photograph."""
        low, high = np.searchsorted(self._sorted, [number, number + 1])
        for start in range(int(low), int(high), PART_TEXELS):
            some = self._order[start : min(start + PART_TEXELS, high)]
            view = photos.view(number, photo, self._part(some), weighted=self._weighted)
            self.colors[some[view.index]] = view.colors
            self.weights[some[view.index]] = view.weight


def _look_up(photos: PhotoSet, *lookups: _Lookups) -> list[Single]:
    """Returns the colours [m, 3] of each of the lookups; reads each photograph once.

    The colours are NaN if the photograph does not show the point.
    """
    for number, photo in photos.photographs():
        for each in lookups:
            each.add(photos, number, photo)
    return [each.colors for each in lookups]


@dataclass(frozen=True, eq=False)
class _FaceViews:
    """The photograph of each face, and the vertices that faces share."""

    view: Ids
    """Photographs [f], -1 for faces without texels."""
    vertices: Ints
    """Numbers of the corners' positions [f, 3]."""
    seams: Ints
    """Pairs [m, 2] of neighbouring faces with different photographs."""


def compose(photos: PhotoSet, blended: BlendedTexels, totals: FaceTotals) -> Composite:
    """Chooses a photograph for each face, and levels the seams between them.

    Texels that are visible only in other photographs than their face's photograph have the blended colour. Sources:
    Lempitsky and Ivanov, Seamless mosaicing of image-based texture maps, 2007; Waechter, Moehrle and Goesele, Let there
    be color! Large-scale texturing of 3D reconstructions, 2014.
    """
    surface = photos.surface
    texels = surface.texels
    faces = _choose(photos, totals)
    view = np.where(blended.views > 0, faces.view[texels.face], -1).astype(np.int32)
    edges = _SeamEdges.between(faces)
    at_edges = _Lookups(*edges.points(photos, faces), weighted=True)
    own, edge_colors = _look_up(photos, _Lookups(view, surface.part), at_edges)
    missing = np.isnan(own[:, 0])
    view[missing] = -1
    own[missing] = blended.colors[missing]
    colors = own.astype(np.float64)
    corner, adjustment = _adjustments(photos, faces, edges, edge_colors, at_edges.weights)
    shown = np.flatnonzero(~missing)
    for start in range(0, len(shown), PART_TEXELS):
        some = shown[start : start + PART_TEXELS]
        at_corners = adjustment[corner[texels.face[some]]]
        colors[some] += interpolate(texels.weights(some), at_corners)
    seen = np.flatnonzero(blended.views > 0)
    whole = surface.part(seen)
    links = link_texels(texels.index[seen], texels.size, whole.points, whole.spacing)
    row, column = np.divmod(texels.index, texels.size[0])
    links = TexelLinks(seen[links.first], seen[links.second], row, column)
    wanted = _wanted_steps(photos, links, view, own, blended)
    levelled = level_texels(colors, view, links, wanted)
    return Composite(np.maximum(levelled, 0).astype(np.float32), view)


def _choose(photos: PhotoSet, totals: FaceTotals) -> _FaceViews:
    """The photograph of each face."""
    corners = photos.surface.mesh.corners
    vertices = unique_rows(corners.reshape(-1, 3))[1].reshape(-1, 3)
    candidates = totals.candidates(photos.gains)
    pairs = neighbor_faces(vertices)
    place = np.full(len(corners), -1, np.int64)
    place[candidates.faces] = np.arange(len(candidates.faces))
    pairs = pairs[(place[pairs] >= 0).all(axis=1)]
    view = np.full(len(corners), -1, np.int32)
    view[candidates.faces] = choose_views(candidates, place[pairs])
    return _FaceViews(view, vertices, pairs[view[pairs[:, 0]] != view[pairs[:, 1]]])


@dataclass(frozen=True, eq=False)
class _SeamEdges:
    """Edges [m] between faces with different photographs."""

    first: Ints
    """The face on one side of each edge."""
    second: Ints
    """The face on the other side of each edge."""
    ends: Ints
    """The corners [m, 2] of the first face at the edge's ends."""
    others: Ints
    """The corners [m, 2] of the second face at the same ends."""

    @classmethod
    def between(cls, faces: _FaceViews) -> _SeamEdges:
        """Returns the edges between `faces` with different photographs."""
        first, second = faces.seams.T
        equal = faces.vertices[first][:, :, None] == faces.vertices[second][:, None, :]
        ends = np.argsort(~equal.any(axis=2), axis=1, kind="stable")[:, :2]
        return cls(first, second, ends, np.take_along_axis(equal.argmax(axis=2), ends, axis=1))

    def points(self, photos: PhotoSet, faces: _FaceViews) -> tuple[Ids, Callable[[Ints], SurfacePart]]:
        """Returns photographs and points for each position on the edges.

        At each position, the points for the first faces are followed by the points for the second faces.
        """
        face, points = [], []
        rows = np.arange(len(self.first))
        for place in EDGE_PLACES:
            for own, at in ((self.first, self.ends), (self.second, self.others)):
                corners = photos.surface.mesh.corners[own]
                on_edge = (1 - place) * corners[rows, at[:, 0]] + place * corners[rows, at[:, 1]]
                points.append((1 - EDGE_INSET) * on_edge + EDGE_INSET * corners.mean(axis=1))
                face.append(own)
        every = np.concatenate(face)
        return faces.view[every], _part_of(photos, every, np.concatenate(points))


def _adjustments(
    photos: PhotoSet, faces: _FaceViews, edges: _SeamEdges, colors: Single, weights: Single
) -> tuple[Ints, Floats]:
    """The unknowns [f, 3] of the faces' corners, and their additive adjustments [unknowns, 3].

    `colors` and `weights` are those of `_SeamEdges.points`. Points with less than the median weight count less: near
    silhouettes, photographs mix the surface with its background.
    """
    key = faces.vertices * (len(photos.cameras) + 1) + (faces.view + 1)[:, None]
    unknowns, corner = np.unique(key, return_inverse=True)
    corner = corner.reshape(-1, 3)
    count = len(edges.first)
    if not count:
        return corner, np.zeros((len(unknowns), 3))
    pairs = colors.astype(np.float64).reshape(len(EDGE_PLACES), 2, count, 3)
    difference = (pairs[:, 0] - pairs[:, 1]).reshape(-1, 3)
    weight = weights.astype(np.float64).reshape(len(EDGE_PLACES), 2, count).min(axis=1).reshape(-1)
    known = np.isfinite(difference).all(axis=1) & (weight > 0)
    if not known.any():
        return corner, np.zeros((len(unknowns), 3))

    def every(unknown: Ints) -> Ints:
        repeated: Ints = np.tile(unknown, (len(EDGE_PLACES), 1))[known]
        return repeated

    links = np.stack([corner, np.roll(corner, -1, axis=1)], axis=2)[faces.view >= 0].reshape(-1, 2)
    seam_samples = SeamSamples(
        every(corner[edges.first[:, None], edges.ends]),
        every(corner[edges.second[:, None], edges.others]),
        np.repeat(EDGE_PLACES, count)[known],
        difference[known],
        np.minimum(weight[known] / np.median(weight[known]), 1.0),
    )
    return corner, level_vertices(len(unknowns), links, seam_samples)


def _part_of(photos: PhotoSet, face: Ints, points: Floats) -> Callable[[Ints], SurfacePart]:
    """Returns a function that selects a part of the points [m, 3] on faces [m] by their indices.

    Photographs are averaged over `EDGE_WIDTH_TEXELS` around these points.
    """
    surface = photos.surface
    wide = EDGE_WIDTH_TEXELS * surface.spacing

    def part(some: Ints) -> SurfacePart:
        return SurfacePart(face[some].astype(np.int32), points[some], surface.normals, wide)

    return part


def _wanted_steps(
    photos: PhotoSet, links: TexelLinks, view: Ids, own: Single, blended: BlendedTexels
) -> Floats:
    """Returns the colour steps [m, 3] between linked texels, measured in photographs.

    A step between different photographs is the mean of the steps that the two photographs show. The step is 0
    if neither shows both texels, and for texels of the same photograph.
    """
    wanted = np.zeros((len(links.first), 3))
    seam = np.flatnonzero(view[links.first] != view[links.second])
    total, count = np.zeros((len(seam), 3)), np.zeros((len(seam), 1))
    ways = [(links.first[seam], links.second[seam], 1.0), (links.second[seam], links.first[seam], -1.0)]

    def lookups(here: Ints, there: Ints) -> _Lookups:
        return _Lookups(view[here], lambda some: photos.surface.part(there[some]))

    found = _look_up(photos, *(lookups(here, there) for here, there, _ in ways))
    for (here, there, sign), across in zip(ways, found, strict=True):
        blend = view[here] < 0
        across[blend] = blended.colors[there[blend]]
        known = np.isfinite(across[:, 0])
        total[known] += sign * (own[here[known]].astype(np.float64) - across[known])
        count[known] += 1
    wanted[seam] = total / np.maximum(count, 1)
    return wanted


def add_detail(
    best: Single, blended: Single, known: npt.NDArray[np.bool_], index: Ints, size: tuple[int, int]
) -> Single:
    """Colours [n, 3] that combine the details of `best` with the coarse colours of `blended`.

    Low spatial frequencies come from `blended`, high frequencies from `best`; frequencies in between are the mean of
    both.

    Sources: Burt and Adelson, A multiresolution spline with application to image mosaics, 1983; Allène, Pons and
    Keriven, Seamless image-based texture atlases using multi-band blending, 2008.
    """
    wide, high = size
    difference = np.zeros((wide * high, 3))
    mask = np.zeros((wide * high, 1))
    difference[index[known]] = blended[known].astype(np.float64) - best[known]
    mask[index[known]] = 1
    total = np.zeros_like(difference)
    for radius in (FINE_TEXELS, COARSE_TEXELS):
        sums, weight = (
            smooth(array.reshape(high, wide, -1), radius).reshape(wide * high, -1)
            for array in (difference, mask)
        )
        total += 0.5 * sums / np.maximum(weight, 1e-9)
    found = best.copy()
    found[known] = np.maximum(best[known] + total[index[known]], 0)
    return found


def smooth(image: Floats, radius: int) -> Floats:
    """The image [h, w, k] after three box averages, which approximate a Gaussian.

    The boxes have sides of about 2 `radius` / 3 + 1 texels; the image is 0 outside.
    """
    reach = max(1, round(2 * radius / 3 / 2))
    for axis in (0, 1):
        for _ in range(3):
            padding = [(0, 0)] * 3
            padding[axis] = (reach + 1, reach)
            sums = np.cumsum(np.pad(image, padding), axis=axis)
            length = image.shape[axis]
            image = (
                np.take(sums, np.arange(length) + 2 * reach + 1, axis=axis)
                - np.take(sums, np.arange(length), axis=axis)
            ) / (2 * reach + 1)
    return image
