"""Conjugate gradients and sparse matrices against SciPy."""

from __future__ import annotations

import numpy as np
import scipy.sparse
import scipy.sparse.csgraph
from raycam.photos.conjugate_gradients import SparseSymmetric, conjugate_gradients


def test_solution_and_products_equal_those_of_scipy() -> None:
    random = np.random.default_rng(0)
    row, column, values = *random.integers(0, 50, (2, 300)), random.normal(size=300)
    each = np.arange(50)
    rows, columns = np.concatenate([row, column, each]), np.concatenate([column, row, each])
    entries = np.concatenate([values, values, np.full(50, 60.0)])
    expected = scipy.sparse.csr_matrix((entries, (rows, columns)))
    matrix = SparseSymmetric.sum_of(50, rows, columns, entries)
    x = random.normal(size=(50, 3))
    np.testing.assert_allclose(matrix.times(x), expected @ x, atol=1e-12)
    np.testing.assert_allclose(matrix.diagonal, expected.diagonal())
    right = random.normal(size=(50, 3))
    right[:, 1] = 0
    found = conjugate_gradients(matrix.times, right, lambda residual: residual / matrix.diagonal[:, None])
    np.testing.assert_allclose(found, np.linalg.solve(expected.toarray(), right), atol=1e-4)
    assert (found[:, 1] == 0).all()


def test_parts_equal_scipys_connected_components() -> None:
    random = np.random.default_rng(1)
    path = np.stack([np.arange(99), np.arange(1, 100)])
    pairs = np.concatenate([path, 100 + random.integers(0, 60, (2, 30))], axis=1)
    shuffle = random.permutation(160)
    a, b = shuffle[pairs]
    each = np.arange(160)
    rows, columns = np.concatenate([a, b, each]), np.concatenate([b, a, each])
    found = SparseSymmetric.sum_of(160, rows, columns, np.ones(len(rows))).parts()
    matrix = scipy.sparse.csr_matrix((np.ones(len(rows)), (rows, columns)))
    count, expected = scipy.sparse.csgraph.connected_components(matrix)
    assert len(np.unique(found)) == count
    assert len(np.unique(np.stack([found, expected]), axis=1).T) == count
