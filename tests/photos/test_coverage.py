"""Coverage images: colours show the number of cameras to which a face is visible."""

from __future__ import annotations

import numpy as np
import raycam
from raycam.photos.coverage import coverage_colors, coverage_picture
from support.textured_panel import panel, ring_of_places, shots


def test_face_colors_are_viridis_and_magenta_for_unseen_faces() -> None:
    colors = coverage_colors(np.array([0, 1, 5, 9], np.int32), most=5)
    assert colors.tolist() == [[217, 0, 140], [68, 1, 84], [253, 231, 37], [253, 231, 37]]


def test_coverage_image_darkens_faces_turned_away() -> None:
    world = panel()
    cameras, _ = shots(world, ring_of_places(3), size=(40, 40), samples=1)
    seen = raycam.surface_visibility(world, cameras)
    above = raycam.Camera.look_at([0, 0, 9], [0, 0, 0], up=[0, 1, 0], fov=30, size=(60, 60))
    frame = coverage_picture(world, seen, above)
    np.testing.assert_allclose(frame.to_srgb8()[30, 30], [253, 231, 37], atol=4)
    np.testing.assert_array_equal(frame["alpha"][0, 0], 0)
    aslant = raycam.Camera.look_at([9, 0, 1], [0, 0, 0], fov=30, size=(60, 60))
    dark = coverage_picture(world, seen, aslant).to_srgb8()[30, 30].astype(float)
    cosine = 1 / np.hypot(9, 1)
    np.testing.assert_allclose(dark, np.array([253, 231, 37]) * (0.45 + 0.55 * cosine), atol=6)
