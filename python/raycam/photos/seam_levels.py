"""Levelled seams between photographs.

Adjustments are added on the mesh; Poisson's equation is then solved in the texels along the seams.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..arguments import Floats
from .conjugate_gradients import SparseSymmetric, conjugate_gradients
from .multigrid import GridLinks, solve_poisson

__all__ = ["SeamSamples", "TexelLinks", "level_texels", "level_vertices", "link_texels"]

Ints = npt.NDArray[np.int64]
Ids = npt.NDArray[np.int32]

SMOOTHNESS = 0.1
"""Weight of equal adjustments at neighbouring vertices, relative to equal colours at seams."""
RIDGE = 1e-4
"""Weight of the additional equations adjustment = 0."""
BAND_TEXELS = 20
"""Distance from a seam, in texels, within which colours change."""
MAX_STEP = 4.0
"""Distance of neighbouring texels on the surface, in texel widths, above which they belong to different islands."""


@dataclass(frozen=True, eq=False)
class SeamSamples:
    """Points [m] on edges between faces of different photographs, where both show a colour."""

    first: Ints
    """Indices [m, 2] of the first photograph's unknowns at the edge's ends."""
    second: Ints
    """Indices [m, 2] of the second photograph's unknowns at the edge's ends."""
    place: Floats
    """Place on the edge [m], from 0 to 1."""
    difference: Floats
    """Colour of the first minus colour of the second photograph [m, 3]."""
    weight: Floats
    """Weight of equal colours at the point [m], from 0 to 1."""


def level_vertices(count: int, links: Ints, samples: SeamSamples) -> Floats:
    """Adjustments [count, 3] that equalise colours at seams and vary little along links.

    `links` [k, 2] are pairs of unknowns.

    Source: Lempitsky and Ivanov, Seamless mosaicing of image-based texture maps, 2007.
    """
    column = np.concatenate([samples.first, samples.second], axis=1)
    share = np.stack([1 - samples.place, samples.place], axis=1)
    factor = np.concatenate([share, -share], axis=1)
    weighted = factor * samples.weight[:, None]
    first, second = links.T
    smooth, each = np.full(len(links), SMOOTHNESS), np.arange(count)
    matrix = SparseSymmetric.sum_of(
        count,
        np.concatenate([np.repeat(column, 4, axis=1).ravel(), first, second, first, second, each]),
        np.concatenate([np.tile(column, (1, 4)).ravel(), first, second, second, first, each]),
        np.concatenate(
            [
                (weighted[:, :, None] * factor[:, None, :]).ravel(),
                *(smooth, smooth, -smooth, -smooth),
                np.full(count, RIDGE),
            ]
        ),
    )
    right = -np.stack(
        [
            np.bincount(column.ravel(), weights=(weighted * channel[:, None]).ravel(), minlength=count)
            for channel in samples.difference.T
        ],
        axis=1,
    ).astype(np.float64)
    # Colour differences do not determine the mean adjustment of a connected part; it is set to 0.
    part = matrix.parts()
    members = np.maximum(np.bincount(part, minlength=count), 1)

    def precondition(residual: Floats) -> Floats:
        scaled = residual / matrix.diagonal[:, None]
        for column in range(scaled.shape[1]):
            mean = np.bincount(part, weights=scaled[:, column], minlength=count) / members
            scaled[:, column] -= mean[part]
        return scaled

    return conjugate_gradients(matrix.times, right, precondition)


@dataclass(frozen=True, eq=False)
class TexelLinks:
    """Pairs [m] of neighbouring texels on the same island."""

    first: Ints
    """The index of the left or upper texel of each link."""
    second: Ints
    """The index of the right or lower texel of each link."""
    row: Ints
    """The row of each texel [n] in the texture."""
    column: Ints
    """The column of each texel [n]."""


def link_texels(index: Ints, size: tuple[int, int], points: Floats, spacing: Floats) -> TexelLinks:
    """The pairs of texels that are neighbours both in the texture and on the surface.

    `index` is as in `Texels`.
    """
    wide, high = size
    number = np.full(wide * high, -1, np.int64)
    number[index] = np.arange(len(index))
    grid = number.reshape(high, wide)
    pairs = []
    for a, b in ((grid[:, :-1], grid[:, 1:]), (grid[:-1], grid[1:])):
        both = (a >= 0) & (b >= 0)
        pairs.append(np.stack([a[both], b[both]], axis=1))
    first, second = np.concatenate(pairs).T
    apart = np.sqrt(((points[first] - points[second]) ** 2).sum(axis=1))
    near = apart <= MAX_STEP * np.maximum(spacing[first], spacing[second])
    return TexelLinks(first[near], second[near], index // wide, index % wide)


def level_texels(colors: Floats, label: Ids, links: TexelLinks, wanted: Floats) -> Floats:
    """Colours [n, 3] without steps at seams.

    A seam is a link between texels with different labels. There, the colour difference becomes `wanted` [m, 3]. Other
    differences are kept in the least squares sense, and texels more than 20 texels from a seam keep their colour.
    Source: Pérez, Gangnet and Blake, Poisson image editing, 2003.
    """
    seam = label[links.first] != label[links.second]
    if not seam.any():
        return colors
    near = np.zeros(len(colors), bool)
    near[links.first[seam]] = near[links.second[seam]] = True
    for _ in range(BAND_TEXELS):
        grown = near.copy()
        grown[links.first[near[links.second]]] = True
        grown[links.second[near[links.first]]] = True
        near = grown
    kept = near[links.first] | near[links.second]
    first, second, seam = links.first[kept], links.second[kept], seam[kept]
    step = np.zeros((len(first), 3))
    step[seam] = wanted[kept][seam] - (colors[first[seam]] - colors[second[seam]])
    place, count = np.cumsum(near) - 1, int(near.sum())
    a, b = np.where(near[first], place[first], count), np.where(near[second], place[second], count)
    right = np.stack(
        [
            np.bincount(a, weights=channel, minlength=count + 1)
            - np.bincount(b, weights=channel, minlength=count + 1)
            for channel in step.T
        ],
        axis=1,
    )[:count]
    inside = (a < count) & (b < count)
    edge = np.concatenate([a[~inside], b[~inside]])
    fixed = np.bincount(edge, minlength=count + 1)[:count].astype(np.float64)
    grid = GridLinks(links.row[near], links.column[near], a[inside], b[inside], fixed)
    levelled = colors.astype(np.float64)
    levelled[near] += solve_poisson(grid, right)
    return levelled
