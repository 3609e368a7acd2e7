"""Poisson's equation by multigrid against SciPy's sparse solver."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse
import scipy.sparse.linalg
from raycam.photos import conjugate_gradients
from raycam.photos.multigrid import RIDGE, GridLinks, solve_poisson


def holes(size: int, share: float, seed: int) -> tuple[GridLinks, scipy.sparse.csr_matrix]:
    """Texels of a grid with holes; a third of the holes are texels with the value 0."""
    random = np.random.default_rng(seed)
    kind = np.where(random.random((size, size)) < share, random.integers(1, 4, (size, size)), 0)
    number = np.full((size, size), -1)
    number[kind == 0] = np.arange((kind == 0).sum())
    row, column = np.nonzero(kind == 0)
    first, second, fixed = [], [], np.zeros(len(row))
    for dy, dx in ((0, 1), (1, 0)):
        a, b = number[: size - dy, : size - dx], number[dy:, dx:]
        both = (a >= 0) & (b >= 0)
        first.append(a[both])
        second.append(b[both])
        ka, kb = kind[: size - dy, : size - dx], kind[dy:, dx:]
        fixed += np.bincount(a[(a >= 0) & (kb == 1)], minlength=len(row))
        fixed += np.bincount(b[(b >= 0) & (ka == 1)], minlength=len(row))
    links = GridLinks(row, column, np.concatenate(first), np.concatenate(second), fixed)
    ends, each = np.stack([links.first, links.second]), np.arange(len(links.first))
    signs = np.repeat([1.0, -1.0], len(each))
    steps = scipy.sparse.csr_matrix((signs, (np.tile(each, 2), ends.ravel())), shape=(len(each), len(row)))
    return links, steps.T @ steps + scipy.sparse.diags(fixed + RIDGE)


@pytest.mark.parametrize(("size", "share"), [(40, 0.0), (64, 0.1), (97, 0.3), (33, 0.7)])
def test_solution_equals_scipys_sparse_solution(size: int, share: float) -> None:
    links, matrix = holes(size, share, seed=size)
    right = np.random.default_rng(0).normal(size=(len(links.row), 3))
    # Without a fixed texel, the differences between texels determine all values except for their mean.
    if share == 0:
        right -= right.mean(axis=0)
    expected = scipy.sparse.linalg.spsolve(matrix.tocsc(), right)
    found = solve_poisson(links, right)
    np.testing.assert_allclose(found, expected, atol=2e-3 * np.abs(expected).max())


@pytest.mark.parametrize("size", [32, 128])
def test_iterations_do_not_grow_with_the_grid(size: int, monkeypatch: pytest.MonkeyPatch) -> None:
    # Without coarser grids, a grid of 128 x 128 needs more than 200 iterations.
    monkeypatch.setattr(conjugate_gradients, "MAX_ITERATIONS", 40)
    links, matrix = holes(size, 0.02, seed=1)
    right = np.random.default_rng(0).normal(size=(len(links.row), 1))
    found = solve_poisson(links, right)
    assert np.linalg.norm(right - matrix @ found) <= 1.1e-4 * np.linalg.norm(right)
