"""Normals and areas of triangles."""

from __future__ import annotations

import numpy as np
from raycam.world.face_geometry import face_areas, face_normals

CORNERS = np.array(
    [[[0, 0, 0], [2, 0, 0], [0, 3, 0]], [[0, 0, 0], [0, 0, 4], [0, 1, 0]], [[0, 0, 0]] * 3], float
)


def test_face_normals_follow_the_winding_and_are_zero_without_area() -> None:
    assert face_normals(CORNERS).tolist() == [[0, 0, 1], [-1, 0, 0], [0, 0, 0]]


def test_face_areas_are_half_the_base_times_the_height() -> None:
    assert face_areas(CORNERS).tolist() == [3, 2, 0]
