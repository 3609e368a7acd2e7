"""Linear systems and projections without LAPACK, compared with NumPy's."""

from __future__ import annotations

import numpy as np
import pytest
from raycam.photos.linear_systems import remove_projection, solve_positive_definite


@pytest.mark.parametrize("count", [1, 2, 7, 40])
@pytest.mark.parametrize("sparse", [False, True])
def test_solution_equals_the_solution_of_lapack(count: int, sparse: bool) -> None:
    random = np.random.default_rng(count)
    links = random.random((count, count)) * (random.random((count, count)) < (0.1 if sparse else 1.0))
    links = links + links.T
    matrix = np.diag(links.sum(axis=1) + 0.1) - links
    right = random.normal(size=(count, 3))
    found = solve_positive_definite(matrix, right)
    np.testing.assert_allclose(found, np.linalg.solve(matrix, right), rtol=1e-9, atol=1e-11)


def test_arguments_are_unchanged() -> None:
    matrix, right = np.array([[2.0, 1.0], [1.0, 3.0]]), np.array([[1.0], [2.0]])
    solve_positive_definite(matrix, right)
    np.testing.assert_array_equal(matrix, [[2, 1], [1, 3]])
    np.testing.assert_array_equal(right, [[1], [2]])


@pytest.mark.parametrize("dependent", [0, 2])
def test_residuals_equal_those_of_least_squares(dependent: int) -> None:
    random = np.random.default_rng(3)
    basis = random.normal(size=(6, 50)) * np.logspace(0, -3, 6)[:, None]
    basis = np.concatenate([basis, basis[:dependent] * 3 + basis[1 : dependent + 1]])
    vectors = random.normal(size=(3, 50))
    weights = np.linalg.lstsq(basis.T, vectors.T, rcond=1e-6)[0]
    np.testing.assert_allclose(remove_projection(basis, vectors), vectors - (basis.T @ weights).T, atol=1e-10)


def test_residuals_of_a_basis_of_zeros_are_the_vectors() -> None:
    vectors = np.random.default_rng(4).normal(size=(2, 9))
    np.testing.assert_array_equal(remove_projection(np.zeros((3, 9)), vectors), vectors)
