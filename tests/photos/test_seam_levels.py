"""Levelled seams against SciPy's sparse solver and closed forms."""

from __future__ import annotations

import numpy as np
import scipy.sparse
import scipy.sparse.linalg
from raycam.photos.seam_levels import SeamSamples, TexelLinks, level_texels, level_vertices, link_texels


def grid_links(height: int, width: int) -> TexelLinks:
    index = np.arange(height * width)
    y, x = index // width, index % width
    points = np.stack([x, y, 0 * x], axis=1).astype(float)
    return link_texels(index, (width, height), points, np.ones(height * width))


def test_linked_texels_are_neighbours_on_the_surface() -> None:
    points = np.array([[0, 0, 0], [1, 0, 0], [50, 0, 0], [0, 1, 0], [1, 1, 0], [50, 1, 0]], float)
    links = link_texels(np.arange(6), (3, 2), points, np.ones(6))
    found = set(zip(links.first.tolist(), links.second.tolist(), strict=True))
    assert found == {(0, 1), (3, 4), (0, 3), (1, 4), (2, 5)}  # the third column belongs to another island


def test_vertex_adjustments_equal_scipys_least_squares_solution() -> None:
    random = np.random.default_rng(0)
    first, second = random.integers(0, 10, (30, 2)), random.integers(10, 20, (30, 2))
    place, difference, weight = random.random(30), random.normal(size=(30, 3)), random.random(30)
    links = np.stack([np.arange(19), np.arange(1, 20)], axis=1)
    links = links[links[:, 0] != 9]
    found = level_vertices(20, links, SeamSamples(first, second, place, difference, weight))
    seam, smooth = np.zeros((30, 20)), np.zeros((len(links), 20))
    for row in range(30):
        for column, share in ((first, 1), (second, -1)):
            seam[row, column[row, 0]] += share * (1 - place[row])
            seam[row, column[row, 1]] += share * place[row]
    smooth[np.arange(len(links)), links[:, 0]], smooth[np.arange(len(links)), links[:, 1]] = 1, -1
    seam, difference = (np.sqrt(weight)[:, None] * each for each in (seam, difference))
    stacked = np.concatenate([seam, np.sqrt(0.1) * smooth, np.sqrt(1e-4) * np.eye(20)])
    right = np.concatenate([-difference, np.zeros((len(links) + 20, 3))])
    np.testing.assert_allclose(found, np.linalg.lstsq(stacked, right, rcond=None)[0], atol=2e-3)


def test_texels_equal_the_sparse_solution_of_poissons_equation() -> None:
    height, width = 6, 60
    links = grid_links(height, width)
    random = np.random.default_rng(1)
    column = np.tile(np.arange(width), height)
    label = (column >= 30).astype(np.int32)
    colors = random.random((height * width, 3)) + 0.4 * label[:, None]
    wanted = 0.1 * random.normal(size=(len(links.first), 3))
    found = level_texels(colors, label, links, wanted)
    near = (column >= 9) & (column < 51)  # the texels of the seam, and 20 more texels on each side
    seam = label[links.first] != label[links.second]
    step = np.where(seam[:, None], wanted - (colors[links.first] - colors[links.second]), 0)
    rows = np.arange(len(links.first))
    matrix = scipy.sparse.csr_matrix(
        (
            np.repeat([1.0, -1.0], len(rows)),
            (np.tile(rows, 2), np.concatenate([links.first, links.second])),
        )
    )[:, near]
    expected = colors.copy()
    expected[near] += scipy.sparse.linalg.spsolve((matrix.T @ matrix).tocsc(), matrix.T @ step)
    np.testing.assert_allclose(found, expected, atol=2e-3)
    np.testing.assert_array_equal(found[~near], colors[~near])


def test_step_between_constant_halves_vanishes() -> None:
    links = grid_links(4, 80)
    label = (np.tile(np.arange(80), 4) >= 40).astype(np.int32)
    colors = np.where(label[:, None] == 1, 0.6, 0.4) * np.ones((320, 3))
    found = level_texels(colors, label, links, np.zeros((len(links.first), 3))).reshape(4, 80, 3)
    assert np.abs(np.diff(found, axis=1)).max() < 0.006  # a step of 0.2 is distributed over 40 texels
    same = level_texels(colors, np.zeros(320, np.int32), links, np.zeros((len(links.first), 3)))
    np.testing.assert_array_equal(same, colors)
