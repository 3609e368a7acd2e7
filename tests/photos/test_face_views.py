"""The choice of a photograph for each face against exhaustive search."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from raycam.photos.face_views import FaceCandidates, FaceTotals, choose_views, neighbor_faces


def candidates(random: np.random.Generator, faces: int, views: int = 3, known: int = 5) -> FaceCandidates:
    chosen = np.array([random.permutation(known)[:views] for _ in range(faces)], np.int32)
    weights = random.uniform(0.05, 1, (faces, views))
    gone = random.random((faces, views)) < 0.2
    gone[:, 0] = False
    chosen[gone], weights[gone] = -1, 0
    return FaceCandidates(np.arange(faces), chosen, weights)


def total_cost(given: FaceCandidates, view: np.ndarray, pairs: np.ndarray) -> float:
    """The cost of lost quality and of seams, computed from their definitions.

    It is inf if a photograph does not show its face.
    """
    cost = 0.0
    for row, one in enumerate(view.tolist()):
        places = np.flatnonzero(given.views[row] == one)
        if one < 0 or not len(places):
            return np.inf
        cost += 4 * (1 - given.weights[row, places[0]] / given.weights[row].max())
    return cost + sum(view[a] != view[b] for a, b in pairs)


def least_cost(given: FaceCandidates, pairs: np.ndarray) -> float:
    """The least cost over all choices."""
    each = [[view for view in row if view >= 0] for row in given.views.tolist()]
    return min(total_cost(given, np.array(choice), pairs) for choice in itertools.product(*each))


@pytest.mark.parametrize("seed", range(8))
def test_face_labels_on_a_tree_are_optimal(seed: int) -> None:
    random = np.random.default_rng(seed)
    given = candidates(random, 8)
    pairs = np.array([[int(random.integers(0, i)), i] for i in range(1, 8)])
    found = choose_views(given, pairs)
    assert total_cost(given, found, pairs) == pytest.approx(least_cost(given, pairs))


@pytest.mark.parametrize("seed", range(8))
def test_face_labels_on_a_grid_are_within_5_percent_of_the_optimum(seed: int) -> None:
    random = np.random.default_rng(seed)
    given = candidates(random, 9)
    pairs = [[i, i + 1] for i in range(9) if i % 3 < 2] + [[i, i + 3] for i in range(6)]
    found = choose_views(given, np.array(pairs))
    cost, least = total_cost(given, found, np.array(pairs)), least_cost(given, np.array(pairs))
    assert cost <= 1.05 * least + 0.1
    greedy = given.views[np.arange(9), given.weights.argmax(axis=1)]
    assert cost <= total_cost(given, greedy, np.array(pairs))


def test_faces_without_neighbours_show_their_best_photograph() -> None:
    given = candidates(np.random.default_rng(0), 6)
    expected = given.views[np.arange(6), given.weights.argmax(axis=1)]
    np.testing.assert_array_equal(choose_views(given, np.zeros((0, 2), np.int64)), expected)


def test_candidate_photographs_have_the_largest_weights_without_outliers() -> None:
    totals = FaceTotals()
    for camera, (weight, grey) in enumerate([(1, 0.5), (3, 0.51), (2, 0.9), (4, 0.5)]):
        # The samples come in two parts, as if two tiles had been read.
        for _ in range(2):
            color = np.full((2, 3), grey, np.float32)
            totals.add(camera, np.array([7, 7], np.int32), np.full(2, weight, np.float32), color)
    found = totals.candidates(np.ones((4, 3)))
    np.testing.assert_array_equal(found.faces, [7])
    assert found.views[0, :3].tolist() == [3, 1, -1]
    assert found.weights[0, :2].tolist() == [16, 12]
    assert sorted(found.views[0].tolist()) == [-1, -1, -1, 0, 1, 3]


def test_faces_that_share_an_edge_are_neighbours() -> None:
    faces = np.array([[0, 1, 2], [2, 1, 3], [1, 2, 4], [5, 6, 7]])
    pairs = {tuple(sorted(pair)) for pair in neighbor_faces(faces).tolist()}
    assert pairs in ({(0, 1), (1, 2)}, {(0, 1), (0, 2)}, {(0, 2), (1, 2)})
