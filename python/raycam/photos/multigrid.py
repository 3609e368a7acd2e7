"""Poisson's equation on a subset of a grid's texels.

It is solved with a hierarchy of coarser grids.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from ..arguments import Floats
from .conjugate_gradients import conjugate_gradients

__all__ = ["GridLinks", "solve_poisson"]

Ints = npt.NDArray[np.int64]
Single = npt.NDArray[np.float32]

RIDGE = 1e-6
"""Weight of the additional equations value = 0, which select one solution for texels without a boundary."""
DAMPING = 0.85
"""Damping factor of the Jacobi smoother."""
COARSE_STIFFNESS = 0.5
"""Factor of the links of coarser grids. It corrects piecewise constant interpolation, which makes the equations of a
surface twice too stiff (Braess 1995)."""


@dataclass(frozen=True, eq=False)
class GridLinks:
    """Texels [n] and their links [m] to neighbours in the grid."""

    row: Ints
    """The row of each texel in the image."""
    column: Ints
    """The column of each texel in the image."""
    first: Ints
    """The index of the first texel of each link [m]."""
    second: Ints
    """The next texel in the same row or column."""
    fixed: Floats
    """The number of links of each texel [n] to neighbours whose value is zero."""


class _Level:
    """Poisson's equation on one grid of the multigrid cycle.

    The grid's cells are texels or squares of 2 x 2 cells of the finer level.
    """

    def __init__(self, links: GridLinks, weight: Floats, mass: Floats) -> None:
        self.links, self.weight, self.mass = links, weight, mass
        count = len(links.row)
        across = links.row[links.first] == links.row[links.second]
        diagonal = links.fixed + mass
        self.neighbors: list[tuple[npt.NDArray[np.int32], Single]] = []
        for here, there in ((links.first, links.second), (links.second, links.first)):
            diagonal = diagonal + np.bincount(here, weights=weight, minlength=count)
            for some in (across, ~across):
                place = np.full(count, count, np.int32)  # index of the zero after the last value
                factor = np.zeros((count, 1), np.float32)
                place[here[some]], factor[here[some], 0] = there[some], weight[some]
                self.neighbors.append((place, factor))
        self.is_finest = bool((weight == 1).all())
        self.diagonal = diagonal[:, None]
        self.inverse = (DAMPING / self.diagonal).astype(np.float32)
        self.parent: npt.NDArray[np.int32] = np.zeros(0, np.int32)

    def times(self, x: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """Returns the product of the level's matrix with x [n, k], in the precision of x."""
        padded = np.concatenate([x, np.zeros((1, x.shape[1]), x.dtype)])
        found: npt.NDArray[Any] = self.diagonal.astype(x.dtype) * x
        for place, factor in self.neighbors:
            value = padded.take(place, axis=0)
            found -= value if self.is_finest else factor * value
        return found

    def coarser(self) -> _Level:
        """Returns the coarser level, whose values are constant in squares of 2 x 2 cells."""
        links = self.links
        row, column = links.row >> 1, links.column >> 1
        wide = int(column.max(initial=0)) + 1
        key = row * wide + column
        known = np.zeros(int(key.max(initial=0)) + 1, bool)
        known[key] = True
        keys = np.flatnonzero(known)
        self.parent = (np.cumsum(known) - 1).astype(np.int32)[key]
        count = len(keys)
        first, second = self.parent[links.first], self.parent[links.second]
        rows = keys // wide
        pairs = []
        for some in (rows[first] == rows[second], rows[first] != rows[second]):
            some &= first != second
            total = np.bincount(first[some], weights=self.weight[some], minlength=count)
            there = np.zeros(count, np.int64)
            there[first[some]] = second[some]
            here = np.flatnonzero(total)
            pairs.append((here, there[here], total[here]))
        here, there = (np.concatenate([pair[i] for pair in pairs]) for i in (0, 1))
        weight: Floats = np.concatenate([pair[2] for pair in pairs]).astype(np.float64)
        fixed, mass = (
            np.bincount(self.parent, weights=each, minlength=count).astype(np.float64)
            for each in (COARSE_STIFFNESS * links.fixed, self.mass)
        )
        return _Level(GridLinks(rows, keys % wide, here, there, fixed), COARSE_STIFFNESS * weight, mass)

    def sums_in_squares(self, values: Single, count: int) -> Single:
        """The sums [count, k] of values [n, k] in each square of the coarser level."""
        sums = [np.bincount(self.parent, weights=each, minlength=count) for each in values.T]
        return np.stack(sums, axis=1).astype(np.float32)


def solve_poisson(links: GridLinks, right: Floats) -> Floats:
    """Solves Poisson's equation on linked texels, in the least squares sense.

    For each texel, the differences of the returned values [n, k] to linked neighbours sum to `right` [n, k].

    The method is conjugate gradients, with a multigrid cycle in float32 as the preconditioner. Sources: Briggs, Henson
    and McCormick, A multigrid tutorial, 2000; Braess, Towards algebraic multigrid for elliptic problems of second
    order, 1995.
    """
    count = len(links.row)
    levels = [_Level(links, np.ones(len(links.first)), np.full(count, RIDGE))]
    while len(levels[-1].weight):
        levels.append(levels[-1].coarser())

    def cycle(number: int, residual: Single) -> Single:
        level = levels[number]
        if number == len(levels) - 1:  # a level without links is the coarsest level
            return np.asarray(residual / level.diagonal, np.float32)
        x: Single = level.inverse * residual
        rest = level.sums_in_squares(
            residual - level.times(x).astype(np.float32), len(levels[number + 1].diagonal)
        )
        x += cycle(number + 1, rest).take(level.parent, axis=0)
        x += level.inverse * (residual - level.times(x).astype(np.float32))
        return x

    def times(x: Floats) -> Floats:
        return levels[0].times(x).astype(np.float64)

    return conjugate_gradients(
        times, right, lambda residual: cycle(0, residual.astype(np.float32)).astype(np.float64)
    )
