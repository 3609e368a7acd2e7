"""Levelled seams: additive adjustments on a mesh, and Poisson's equation in the texels along the seams."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..arguments import Floats

__all__ = ["SeamSamples", "TexelLinks", "level_texels", "level_vertices", "link_texels"]

Ints = npt.NDArray[np.int64]
Ids = npt.NDArray[np.int32]

SMOOTHNESS = 0.1
"""Weight of equal adjustments at neighbouring vertices, relative to equal colours at seams."""
RIDGE = 1e-4
"""Weight of adjustments of zero."""
BAND_TEXELS = 20
"""Texels from a seam within which colours change."""
MAX_ITERATIONS = 300
"""Iterations of conjugate gradients."""
TOLERANCE = 1e-4
"""Residual, relative to the first, at which conjugate gradients stop."""
MAX_STEP = 4.0
"""Distance of neighbouring texels on the surface, in texel widths, above which they belong to different islands."""


@dataclass(frozen=True, eq=False)
class SeamSamples:
    """Points [m] on edges between faces of different photographs, where both show a colour."""

    first: Ints
    """Unknowns [m, 2] of one photograph at the edge's ends."""
    second: Ints
    """Unknowns [m, 2] of the other."""
    place: Floats
    """Place on the edge [m], from 0 to 1."""
    difference: Floats
    """Colour of the first minus colour of the second photograph [m, 3]."""


def level_vertices(count: int, links: Ints, samples: SeamSamples) -> Floats:
    """Adjustments [count, 3] that make colours equal at seams and vary little along `links` [k, 2].

    Source: Lempitsky and Ivanov, Seamless mosaicing of image-based texture maps, 2007.
    """
    column = np.concatenate([samples.first, samples.second], axis=1)
    share = np.stack([1 - samples.place, samples.place], axis=1)
    row = np.concatenate([share, -share], axis=1)

    def spread(columns: Ints, values: Floats) -> Floats:
        flat = columns.ravel()
        return np.stack(
            [np.bincount(flat, weights=values[..., i].ravel(), minlength=count) for i in range(3)], axis=1
        )

    def matrix(x: Floats) -> Floats:
        seams = np.einsum("mk,mkc->mc", row, x[column])
        along = x[links[:, 0]] - x[links[:, 1]]
        return (
            spread(column, row[..., None] * seams[:, None, :])
            + SMOOTHNESS * (spread(links[:, 0], along) - spread(links[:, 1], along))
            + RIDGE * x
        )

    right = -spread(column, row[..., None] * samples.difference[:, None, :])
    return conjugate_gradients(matrix, right)


@dataclass(frozen=True, eq=False)
class TexelLinks:
    """Pairs [m] of neighbouring texels on the same island."""

    first: Ints
    """The left or upper texel."""
    second: Ints
    """The right or lower texel."""


def link_texels(index: Ints, size: tuple[int, int], points: Floats, spacing: Floats) -> TexelLinks:
    """The pairs of texels that are neighbours in the texture and on the surface; `index` is as in `Texels`."""
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
    return TexelLinks(first[near], second[near])


def level_texels(colors: Floats, label: Ids, links: TexelLinks, wanted: Floats) -> Floats:
    """Colours [n, 3] without steps at seams: links between texels with different labels have the step `wanted`.

    `wanted` [m, 3] is used for these links only. Other steps are kept in the least squares sense, and texels more than
    20 texels from a seam keep their colour. Source: Pérez, Gangnet and Blake, Poisson image editing, 2003.
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
    place = np.cumsum(near) - 1
    count = int(near.sum())
    a, b = np.where(near[first], place[first], count), np.where(near[second], place[second], count)

    def spread(values: Floats) -> Floats:
        found = [
            np.bincount(a, weights=values[:, i], minlength=count + 1)
            - np.bincount(b, weights=values[:, i], minlength=count + 1)
            for i in range(3)
        ]
        return np.stack(found, axis=1)[:count]

    def matrix(x: Floats) -> Floats:
        padded = np.concatenate([x, np.zeros((1, 3))])  # texels outside of the band do not change
        return spread(padded[a] - padded[b]) + 1e-9 * x

    levelled = colors.astype(np.float64)
    levelled[near] += conjugate_gradients(matrix, spread(step))
    return levelled


def conjugate_gradients(matrix: Callable[[Floats], Floats], right: Floats) -> Floats:
    """The solution of a symmetric positive system for each column of `right` [n, k]."""
    x = np.zeros_like(right)
    residual = right.copy()
    direction = residual.copy()
    squared = (residual**2).sum(axis=0)
    limit = TOLERANCE**2 * squared
    for _ in range(MAX_ITERATIONS):
        if (squared <= limit).all():
            break
        image = matrix(direction)
        below = (direction * image).sum(axis=0)
        alpha = np.divide(squared, below, out=np.zeros_like(squared), where=below > 0)
        x += alpha * direction
        residual -= alpha * image
        before, squared = squared, (residual**2).sum(axis=0)
        beta = np.divide(squared, before, out=np.zeros_like(squared), where=before > 0)
        direction = residual + beta * direction
    return x
