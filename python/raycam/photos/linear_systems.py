"""Solutions of small linear systems and least squares problems, bit-identical on every processor.

LAPACK and BLAS libraries use different orders of summation on different processors.
"""

from __future__ import annotations

import numpy as np

from ..arguments import Floats

__all__ = ["remove_projection", "solve_positive_definite"]

MIN_LENGTH = 1e-6
"""Length below which a vector counts as a linear combination of the others, relative to the longest vector."""


def solve_positive_definite(matrix: Floats, right: Floats) -> Floats:
    """Returns the solution [n, k] of matrix x = `right` [n, k] for a symmetric positive definite matrix [n, n].

    Gaussian elimination does not need pivots for such a matrix. Rows with a zero in the column of the current unknown
    are skipped, so that sparse matrices take less time.
    """
    rows = np.concatenate([matrix, right], axis=1)
    count = len(matrix)
    for i in range(count):
        below = i + 1 + np.flatnonzero(rows[i + 1 :, i])
        factor = rows[below, i] / rows[i, i]
        rows[below, i + 1 :] -= factor[:, None] * rows[i, i + 1 :]
    found = rows[:, count:]
    for i in reversed(range(count)):
        found[i] -= (rows[i, i + 1 : count, None] * found[i + 1 :]).sum(axis=0)
        found[i] /= rows[i, i]
    return found


def remove_projection(basis: Floats, vectors: Floats) -> Floats:
    """Returns the parts of `vectors` [m, n] that are orthogonal to the vectors of `basis` [k, n].

    The result is the residual of the least squares problem that explains each vector by a combination of the basis.
    Vectors of the basis that depend on others are ignored. Source: Björck, Numerics of Gram-Schmidt orthogonalization,
    1994 (modified Gram-Schmidt method with pivoting).
    """
    rows = np.concatenate([basis, vectors])
    count, longest = len(basis), 0.0
    for i in range(count):
        lengths = np.sqrt((rows[i:count] ** 2).sum(axis=1))
        pivot = int(lengths.argmax())
        length = float(lengths[pivot])
        longest = max(longest, length)
        if length <= MIN_LENGTH * longest:
            break
        rows[[i, i + pivot]] = rows[[i + pivot, i]]
        direction = rows[i] / length
        others = rows[i + 1 :]
        others -= (others * direction).sum(axis=1)[:, None] * direction
    return rows[count:]
