"""Preconditioned conjugate gradients, and symmetric sparse matrices for them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..arguments import Floats

__all__ = ["SparseSymmetric", "conjugate_gradients"]

Ints = npt.NDArray[np.int64]

MAX_ITERATIONS = 300
"""Iterations of conjugate gradients."""
TOLERANCE = 1e-4
"""Residual, relative to the first, at which conjugate gradients stop."""


@dataclass(frozen=True, eq=False)
class SparseSymmetric:
    """A symmetric matrix without empty rows, in compressed row storage."""

    values: Floats
    """The entries [m], row by row."""
    column: npt.NDArray[np.int32]
    """The column of each entry [m]."""
    starts: Ints
    """The index of the first entry of each row [n]."""
    diagonal: Floats
    """The diagonal [n]."""

    @classmethod
    def sum_of(cls, size: int, row: Ints, column: Ints, values: Floats) -> SparseSymmetric:
        """Returns the matrix [size, size] with the entries `values` at `row` and `column`, [m] each.

        Entries with the same row and column are added. Each row must have a value on the diagonal.
        """
        key = row * size + column
        order = np.argsort(key, kind="stable")
        key = key[order]
        first = np.flatnonzero(np.diff(key, prepend=-1))
        total = np.add.reduceat(values[order], first)
        rows, columns = key[first] // size, key[first] % size
        starts = np.flatnonzero(np.diff(rows, prepend=-1))
        return cls(total, columns.astype(np.int32), starts, total[rows == columns])

    def times(self, x: Floats) -> Floats:
        """The product of the matrix with each column of x [n, k]."""
        found: Floats = np.stack(
            [
                np.add.reduceat(self.values * each.take(self.column), self.starts)
                for each in np.ascontiguousarray(x.T)
            ],
            axis=1,
        )
        return found

    def parts(self) -> Ints:
        """The number of each row's connected component [n]; an entry connects its row and column."""
        label = np.arange(len(self.starts))
        while True:
            lower = np.minimum.reduceat(label.take(self.column), self.starts)
            lower = np.minimum(lower, lower[lower])
            if (lower == label).all():
                return label
            label = lower


def conjugate_gradients(
    matrix: Callable[[Floats], Floats], right: Floats, precondition: Callable[[Floats], Floats]
) -> Floats:
    """Returns the solution [n, k] of matrix(solution) = `right` [n, k], column by column.

    `matrix` multiplies vectors [n, k] by a symmetric positive definite matrix. `precondition` multiplies
    residuals by a symmetric positive definite matrix that is close to the inverse. Source: Shewchuk, An
    introduction to the conjugate gradient method without the agonizing pain, 1994.
    """
    x = np.zeros_like(right)
    residual = right.copy()
    direction, before = np.zeros_like(right), np.zeros(right.shape[1])
    limit = TOLERANCE**2 * _products(right, right)
    for _ in range(MAX_ITERATIONS):
        if (_products(residual, residual) <= limit).all():
            break
        better = precondition(residual)
        now = _products(residual, better)
        direction = better + np.divide(now, before, out=np.zeros_like(now), where=before > 0) * direction
        image = matrix(direction)
        below = _products(direction, image)
        step = np.divide(now, below, out=np.zeros_like(now), where=below > 0)
        x += step * direction
        residual -= step * image
        before = now
    return x


def _products(a: Floats, b: Floats) -> Floats:
    """The scalar products [k] of the columns of a and b [n, k]."""
    found: Floats = (a * b).sum(axis=0)
    return found
