"""Surface points that are visible to a camera, compared with OpenCV's projection."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
import raycam
from raycam.photos.sight import find_sight

OPENCV = {"model": "opencv", "distortion": [0.1, -0.05, 0.001, -0.002, 0.01]}


def looking_down(**lens: object) -> raycam.Camera:
    return raycam.Camera.look_at([0.3, -0.2, 3], [0, 0, 0], up=[0, 1, 0], fov=50, size=(320, 240), **lens)


def scattered(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Points around the origin and unit normals, both random."""
    random = np.random.default_rng(5)
    normals = random.normal(size=(count, 3))
    return random.uniform(-1.5, 1.5, (count, 3)), normals / np.linalg.norm(normals, axis=1, keepdims=True)


@pytest.mark.parametrize("lens", [{}, OPENCV])
def test_pixels_and_footprints_equal_opencv(lens: dict) -> None:
    camera, (points, normals) = looking_down(**lens), scattered(500)
    sight = find_sight(raycam.World(), camera, points, normals, footprints=True)
    shown = points[sight.index]
    pixels, derivatives = cv2.projectPoints(
        shown, cv2.Rodrigues(camera.R)[0], camera.t, camera.K, np.array(lens.get("distortion", [0.0] * 5))
    )
    assert 100 < len(shown) < 400
    np.testing.assert_allclose(sight.pixels, pixels[:, 0], atol=1e-9)
    # The derivatives of a pixel by the translation equal those by the point in camera axes.
    by_point = derivatives[:, 3:6].reshape(-1, 2, 3) @ camera.R
    towards = camera.C - shown
    cosine = (towards * normals[sight.index]).sum(axis=1) / np.linalg.norm(towards, axis=1)
    np.testing.assert_allclose(sight.cosine, cosine, atol=1e-12)
    # J Jᵀ does not depend on the choice of the two surface directions.
    n = normals[sight.index]
    on_surface = by_point @ (np.eye(3) - n[:, :, None] * n[:, None])
    expected = on_surface @ on_surface.transpose(0, 2, 1)
    found = sight.footprints @ sight.footprints.transpose(0, 2, 1)
    np.testing.assert_allclose(found, expected, rtol=1e-4, atol=1e-4 * expected.max())


@pytest.mark.parametrize("facing", ["front", "both"])
@pytest.mark.parametrize("rolling", [False, True])
def test_sight_equals_projection_and_visibility(facing: str, rolling: bool) -> None:
    world = raycam.World()
    world.add_object(sphere={"radius": 0.6})
    camera, (points, normals) = looking_down(**OPENCV), scattered(2000)
    if rolling:
        other = raycam.Camera.look_at(
            [0.6, 0.1, 3], [0, 0, 0], up=[0, 1, 0], fov=50, size=(320, 240), **OPENCV
        )
        camera = camera.moving(other, readout=0.03)
    pixels, is_shown = camera.project(points)
    is_shown &= (pixels >= -0.5).all(axis=1) & (pixels < np.array(camera.size) - 0.5).all(axis=1)
    origins = np.full_like(points, np.nan)
    origins[is_shown], _ = camera.rays(pixels[is_shown])
    cosine = ((origins - points) * normals).sum(axis=1) / np.linalg.norm(origins - points, axis=1)
    cosine = np.abs(cosine) if facing == "both" else cosine
    is_shown &= cosine > 0.1
    is_shown[is_shown] = world.visible(points[is_shown], origins[is_shown])
    sight = find_sight(world, camera, points, normals, facing=facing, min_cosine=0.1)
    np.testing.assert_array_equal(sight.index, np.flatnonzero(is_shown))
    np.testing.assert_array_equal(sight.pixels, pixels[is_shown])
    np.testing.assert_array_equal(sight.origins, origins[is_shown])
    assert sight.footprints.shape == (0, 2, 2)
    assert 200 < len(sight.index) < 1500
