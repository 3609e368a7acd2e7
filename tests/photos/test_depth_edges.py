"""Distances from jumps of depth against OpenCV's distance transform of the exact silhouette."""

from __future__ import annotations

import cv2
import numpy as np
import raycam
from raycam.photos.depth_edges import find_depth_edges


def test_edge_distances_of_a_box_above_a_floor_equal_those_to_its_outline() -> None:
    world = raycam.World()
    world.add_object(plane={"size": [40, 40]})
    world.add_object(box={"size": [1, 0.6, 1]}, location=[0.2, 0, 0.5])
    camera = raycam.Camera.look_at([0, 0, 4], [0, 0, 0], up=[0, 1, 0], fov=50, size=(200, 160))
    edges = find_depth_edges(world, camera, 32)
    top = raycam.render(world, camera, samples=1, channels=["depth"])["depth"] < 3.5
    kernel = np.ones((3, 3), np.uint8)
    outline = cv2.dilate(top.astype(np.uint8), kernel) != cv2.erode(top.astype(np.uint8), kernel)
    expected = np.minimum(cv2.distanceTransform((~outline).astype(np.uint8), cv2.DIST_L2, 5), 32)
    u, v = np.meshgrid(np.arange(200) + 0.5, np.arange(160) + 0.5)
    found = edges.at(np.stack([u.ravel(), v.ravel()], axis=1)).reshape(160, 200)
    # The sides of the box are hidden from above, except for a few pixels by perspective.
    far = np.abs(expected - 16) < 12
    np.testing.assert_allclose(found[far], expected[far], atol=8)
    assert np.abs(found - expected).mean() < 3


def test_slanted_plane_has_depth_edges_only_at_its_outline() -> None:
    world = raycam.World()
    world.add_object(plane={"size": [400, 400]})
    camera = raycam.Camera.look_at([0, 0, 1], [1.5, 0, 0], fov=40, size=(90, 60))
    assert (find_depth_edges(world, camera, 32).distance == 32).all()
    small = raycam.World()
    small.add_object(plane={"size": [1, 1]})
    above = raycam.Camera.look_at([0, 0, 3], [0, 0, 0], up=[0, 1, 0], fov=40, size=(90, 60))
    assert find_depth_edges(small, above, 32).distance.min() == 0
