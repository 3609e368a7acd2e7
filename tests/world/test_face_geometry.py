"""Normals and areas of triangles."""

from __future__ import annotations

import numpy as np
from raycam.world.face_geometry import face_areas, face_normals, unique_rows

CORNERS = np.array(
    [[[0, 0, 0], [2, 0, 0], [0, 3, 0]], [[0, 0, 0], [0, 0, 4], [0, 1, 0]], [[0, 0, 0]] * 3], float
)


def test_face_normals_follow_the_winding_and_are_zero_without_area() -> None:
    assert face_normals(CORNERS).tolist() == [[0, 0, 1], [-1, 0, 0], [0, 0, 0]]


def test_face_areas_are_half_the_base_times_the_height() -> None:
    assert face_areas(CORNERS).tolist() == [3, 2, 0]


def test_unique_rows_equal_numpys() -> None:
    rows = np.random.default_rng(0).integers(-1, 2, (200, 3)) * 0.5
    rows[::7] *= -1.0  # +0 and -0 are the same corner
    found, number = unique_rows(rows)
    expected, inverse = np.unique(rows, axis=0, return_inverse=True)
    np.testing.assert_array_equal(found, expected)
    np.testing.assert_array_equal(number, inverse.reshape(-1))
