"""Samples of faces in cameras, against brute force over all samples, cameras and triangles with OpenCV's lenses."""

from __future__ import annotations

from dataclasses import fields

import cv2
import numpy as np
import pytest
import raycam
from raycam.photos.face_samples import MAX_SAMPLES, MIN_SAMPLES, sample_pattern
from raycam.photos.face_sight import FaceSight, find_face_sight
from raycam.photos.sight import find_sight
from support.box_table import ring, table

FISHEYE = {"model": "fisheye", "distortion": [0.02, -0.01, 0.003, -0.001]}


def project(camera: raycam.Camera, points: np.ndarray) -> np.ndarray:
    """Pixels [n, 2], NaN behind the camera."""
    rotation = cv2.Rodrigues(camera.R)[0]
    if camera.model == "fisheye":
        pixels = cv2.fisheye.projectPoints(points[None], rotation, camera.t, camera.K, camera.distortion)[0][
            0
        ]
    else:
        pixels = cv2.projectPoints(points, rotation, camera.t, camera.K, np.zeros(4))[0][:, 0]
    pixels[(points - camera.C) @ camera.R[2] <= 0] = np.nan
    return pixels


def blocked(origin: np.ndarray, point: np.ndarray, corners: np.ndarray) -> bool:
    """True if a triangle is between origin and point (Möller and Trumbore 1997)."""
    way = point - origin
    a, e, f = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    p = np.cross(way, f)
    with np.errstate(divide="ignore", invalid="ignore"):
        d = 1 / (e * p).sum(axis=1)
        s = origin - a
        u = (s * p).sum(axis=1) * d
        q = np.cross(s, e)
        v = (q @ way) * d
        t = (f * q).sum(axis=1) * d
        return bool(((u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0) & (t < 1 - 1e-9)).any())


def resolution(camera: raycam.Camera, point: np.ndarray, normal: np.ndarray) -> float:
    """The smaller singular value of the derivative of the pixel along the surface, in pixels per metre."""
    _, _, tangents = np.linalg.svd(normal[None])
    step = 1e-5
    offsets = step * np.concatenate([tangents[1:], -tangents[1:]])
    ahead_a, ahead_b, behind_a, behind_b = project(camera, point + offsets)
    jacobian = np.stack([ahead_a - behind_a, ahead_b - behind_b], axis=1) / (2 * step)
    return float(np.linalg.svd(jacobian, compute_uv=False)[-1])


def sample_numbers(corners: np.ndarray, cameras: list[raycam.Camera], least: np.ndarray) -> np.ndarray:
    """The number of samples of each face: its largest area in pixels, from its minimum to 256."""
    numbers = least.astype(int)
    for camera in cameras:
        pixels = project(camera, corners.reshape(-1, 3)).reshape(-1, 3, 2)
        low, high = pixels.min(axis=1), pixels.max(axis=1)
        shown = (high >= -0.5).all(axis=1) & (low <= np.array(camera.size) - 0.5).all(axis=1)
        a, b = pixels[:, 1] - pixels[:, 0], pixels[:, 2] - pixels[:, 0]
        area = np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / 2
        large = shown & (area > 4)
        numbers[large] = np.maximum(numbers[large], np.minimum(np.ceil(area[large]), MAX_SAMPLES).astype(int))
    return numbers


@pytest.mark.parametrize("facing", ["front", "both"])
@pytest.mark.parametrize("lens", [{}, FISHEYE])
def test_samples_equal_brute_force(lens: dict, facing: str) -> None:
    world = raycam.World()
    world.add_object(plane={"size": [4, 4]})
    world.add_object(box={"size": [0.6, 0.4, 0.5]}, location=[0.8, 0.2, 0.25], yaw=30)
    world.add_object(sphere={"radius": 0.25, "level": 2}, location=[-0.4, -0.3, 0.5])
    cameras = ring(3, **lens)
    corners = world.triangles()
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    least = np.full(len(corners), MIN_SAMPLES, np.uint16)
    least[::7] = 9
    pattern = sample_pattern(MAX_SAMPLES)
    found, brief = (
        find_face_sight(world, cameras, corners, least, pattern, facing=facing, pairs=pairs)
        for pairs in (True, False)
    )
    numbers = sample_numbers(corners, cameras, least)
    np.testing.assert_array_equal(found.samples, numbers)
    assert numbers.max() == MAX_SAMPLES
    assert (numbers == MIN_SAMPLES).any()
    owner = np.repeat(np.arange(len(corners)), numbers)
    weights = np.concatenate([pattern[:number] for number in numbers])
    points = np.einsum("nk,nkj->nj", weights, corners[owner])
    seen = np.zeros((len(points), len(cameras)), bool)
    cosines = np.zeros(seen.shape)
    for number, camera in enumerate(cameras):
        pixels = project(camera, points)
        inside = (pixels >= -0.5).all(axis=1) & (pixels < np.array(camera.size) - 0.5).all(axis=1)
        towards = camera.C - points
        cosine = (towards * normals[owner]).sum(axis=1) / np.linalg.norm(towards, axis=1)
        cosines[:, number] = np.abs(cosine) if facing == "both" else cosine
        for sample in np.flatnonzero(inside & (cosines[:, number] > 0)):
            seen[sample, number] = not blocked(camera.C, points[sample], corners)
    assert 0.1 < seen.mean() < 0.6
    np.testing.assert_array_equal(found.is_shown, seen.any(axis=1))
    first = np.cumsum(numbers) - numbers
    shown = np.add.reduceat(seen, first, axis=0, dtype=int)
    np.testing.assert_array_equal(found.views, (shown > 0).sum(axis=1))
    np.testing.assert_array_equal(found.faces_shown, (shown > 0).sum(axis=0))
    face, camera_index = np.nonzero(shown)
    np.testing.assert_array_equal(found.pairs, np.stack([face, camera_index, shown[shown > 0]], axis=1))
    best = np.zeros(shown.shape)
    for i, j in zip(face, camera_index, strict=True):
        sample = first[i] + np.flatnonzero(seen[owner == i, j])[0]
        best[i, j] = resolution(cameras[j], points[sample], normals[i])
        if found.best_view[i] == j:
            assert found.best_cosine[i] == pytest.approx(cosines[sample, j], abs=1e-12)
    np.testing.assert_allclose(found.best_resolution, best.max(axis=1), rtol=1e-4)
    is_clear = np.sort(best, axis=1)[:, -2] < (1 - 1e-3) * best.max(axis=1)
    assert is_clear.sum() > 40
    np.testing.assert_array_equal(found.best_view[is_clear], best.argmax(axis=1)[is_clear])
    assert (found.best_view[found.views == 0] == -1).all()
    # Samples that cannot change the result are omitted without pairs.
    for name in (
        "samples",
        "is_shown",
        "views",
        "best_view",
        "best_resolution",
        "best_cosine",
        "faces_shown",
    ):
        np.testing.assert_array_equal(getattr(brief, name), getattr(found, name))
    assert brief.pairs.shape == (0, 3)


LENSES = {
    "pinhole": {"fov": 60},
    "opencv": {"fov": 60, "model": "opencv", "distortion": [0.1, -0.05, 0.001, -0.002, 0.01]},
    "fisheye": {"fov": 60, **FISHEYE},
    "wide fisheye": {
        "K": [[30, 0, 59.5], [0, 30, 39.5], [0, 0, 1]],
        "model": "fisheye",
        "distortion": [0] * 4,
    },
    "double sphere": {
        "K": [[40, 0, 59.5], [0, 40, 39.5], [0, 0, 1]],
        "model": "ds",
        "distortion": [-0.2, 0.6],
    },
    "panorama": {"model": "equirectangular"},
}


@pytest.mark.parametrize("facing", ["front", "both"])
@pytest.mark.parametrize("name", LENSES)
def test_faces_tested_in_blocks_equal_single_points(name: str, facing: str) -> None:
    """Blocks and single faces are in a camera's image, next to the image, or behind the camera."""
    world = raycam.World()
    world.add_object(sphere={"radius": 5, "level": 5}, scale=[1, 1, -1])
    world.add_object(sphere={"radius": 0.4, "level": 3}, location=[2, 1, 0.3])
    camera = raycam.Camera.look_at([0.3, -0.2, 0.1], [3, 1, 0.5], size=(120, 80), **LENSES[name])
    corners, pattern = world.triangles(), sample_pattern(MAX_SAMPLES)
    least = np.full(len(corners), MIN_SAMPLES, np.uint16)
    found = find_face_sight(world, [camera], corners, least, pattern, facing=facing, pairs=True)
    weights = np.concatenate([pattern[:number] for number in found.samples])
    owner = np.repeat(np.arange(len(corners)), found.samples)
    points = (weights[:, :, None] * corners[owner]).sum(axis=1)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    shown = np.zeros(len(points), bool)
    shown[find_sight(world, camera, points, normals[owner], facing=facing).index] = True
    assert 0.003 < shown.mean() < 0.95
    # Rounding decides for a point at the border of the image or behind an edge.
    assert np.count_nonzero(found.is_shown != shown) <= 3


def test_equal_views_give_the_first_camera() -> None:
    world = raycam.World()
    world.add_object(plane={"size": [1, 1]})
    found = find_face_sight(
        world, [ring(1)[0]] * 3, world.triangles(), np.array([4, 4], np.uint16), sample_pattern(MAX_SAMPLES)
    )
    np.testing.assert_array_equal(found.views, [3, 3])
    np.testing.assert_array_equal(found.best_view, [0, 0])


def test_results_have_the_same_bytes_for_any_number_of_threads_and_order_of_faces() -> None:
    world = table()
    cameras = [*ring(3, **FISHEYE), ring(1)[0].moving(ring(2)[1], readout=0.03)]
    corners = np.tile(world.triangles(), (2, 1, 1))
    least, pattern = np.full(len(corners), MIN_SAMPLES, np.uint16), sample_pattern(MAX_SAMPLES)
    one = find_face_sight(world, cameras, corners, least, pattern, pairs=True, threads=1)
    four = find_face_sight(world, cameras, corners, least, pattern, pairs=True, threads=4)
    for field in fields(FaceSight):
        assert getattr(one, field.name).tobytes() == getattr(four, field.name).tobytes()
    turned = find_face_sight(world, cameras, corners[::-1], least, pattern)
    for name in ("samples", "views", "best_view", "best_resolution", "best_cosine"):
        assert getattr(turned, name)[::-1].tobytes() == getattr(one, name).tobytes()


@pytest.mark.parametrize("numbers", [[4, 0], [4, 9], [4]])
def test_invalid_numbers_of_samples_are_refused(numbers: list[int]) -> None:
    world = raycam.World()
    world.add_object(plane={"size": [1, 1]})
    with pytest.raises(raycam.SettingsError):
        find_face_sight(world, ring(1), world.triangles(), np.array(numbers, np.uint16), sample_pattern(8))
