"""Photographs with a pose error of one pixel are detected."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import raycam
from raycam.notices import collected
from support.textured_panel import noise, panel, ring_of_places, shots


def area_under_roc(scores: np.ndarray, wrong: np.ndarray) -> float:
    """The share of (wrong, correct) photograph pairs in which the wrong one scores higher."""
    a, b = scores[wrong][:, None], scores[~wrong][None]
    return float(((a > b) + 0.5 * (a == b)).mean())


def turned(camera: raycam.Camera, pixels: float, seed: int) -> raycam.Camera:
    """The camera turned about a random axis so that the image shifts or rotates by `pixels`."""
    random = np.random.default_rng(seed)
    axis = random.normal(size=3)
    axis /= np.linalg.norm(axis)
    angle = pixels / camera.K[0, 0] / max(np.hypot(*axis[:2]), 0.5)
    cross = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    rotation = np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
    return camera.at_pose(rotation @ camera.R, camera.location)


@pytest.mark.parametrize("pixels", [1.0, 2.0])
def test_poses_off_by_a_pixel_are_found(pixels: float) -> None:
    scores, wrong = [], []
    for seed in range(2):
        world = panel(noise(128, seed))
        cameras, photos = shots(world, ring_of_places(10, radius=0.9), size=(160, 160), samples=8)
        bad = [name for i, name in enumerate(cameras) if i % 5 == seed]
        given = {n: turned(c, pixels, int(n[:2])) if n in bad else c for n, c in cameras.items()}
        with collected() as notices:
            result = raycam.texture_from_photos(world, given, photos, size=128)
        scores += [fit.shift_px for fit in result.photographs]
        wrong += [fit.name in bad for fit in result.photographs]
        [notice] = [notice for notice in notices if notice.code == "misaligned_photographs"]
        assert all(name in str(notice) for name in bad)
        assert notice.count == len(bad)
    assert area_under_roc(np.array(scores), np.array(wrong)) > 0.95


def test_shift_is_measured_in_pixels_of_the_photograph() -> None:
    world = panel(noise(128))
    cameras, photos = shots(world, ring_of_places(8), size=(160, 160), samples=8)
    matrix = cameras["03.png"].K.copy()
    matrix[:2, 2] += [0.6, -0.8]
    with collected():
        result = raycam.texture_from_photos(
            world, {**cameras, "03.png": cameras["03.png"].replace(K=matrix)}, photos, size=128
        )
    shifts = np.array([fit.shift_px for fit in result.photographs])
    assert shifts[3] == pytest.approx(1, abs=0.2)
    assert np.delete(shifts, 3).max() < 0.4


def test_correct_poses_and_uniform_surfaces_give_no_notice() -> None:
    for texture in (noise(128), np.full((8, 8, 3), 120, np.uint8)):
        world = panel(texture)
        cameras, photos = shots(world, ring_of_places(4), size=(120, 120), samples=8)
        with collected() as notices:
            raycam.texture_from_photos(world, cameras, photos, size=64)
        assert [notice for notice in notices if notice.code == "misaligned_photographs"] == []


def small_repeated_photographs(
    seed: int, repeats: int
) -> tuple[raycam.World, dict[str, raycam.Camera], dict[str, np.ndarray], int]:
    """A panel, cameras with small photographs of it that are given `repeats` times, and a size of the texture."""
    random = np.random.default_rng(seed)
    count, size = int(random.integers(8, 25)), int(random.choice([32, 40, 64, 96]))
    samples, texture_size = int(random.choice([1, 2, 4])), int(random.choice([32, 64, 128]))
    world = panel() if seed % 3 else panel(noise(32, seed))
    places = ring_of_places(count, radius=random.uniform(0.3, 1.1))
    cameras, photos = shots(world, places, size=(size, size), samples=samples)
    names = [(f"{repeat}-{name}", name) for repeat in range(repeats) for name in cameras]
    given = {new: cameras[name] for new, name in names}
    return world, given, {new: photos[name] for new, name in names}, texture_size


@pytest.mark.parametrize("seed", range(8))
def test_correct_poses_of_small_repeated_photographs_give_no_notice(seed: int) -> None:
    """In small photographs, many views are at the panel's edge, where pixels mix the panel with the background."""
    world, cameras, photos, size = small_repeated_photographs(seed, 1 + seed % 2)
    with collected() as notices:
        raycam.texture_from_photos(world, cameras, photos, size=size)
    assert [str(notice) for notice in notices if notice.code == "misaligned_photographs"] == []


@pytest.mark.parametrize("pixels", [1.0, 2.0])
def test_poses_off_by_a_pixel_have_large_shifts_in_small_photographs(pixels: float) -> None:
    scores, wrong = [], []
    for seed in range(4):
        world, cameras, photos, size = small_repeated_photographs(seed, 1)
        bad = [i % 6 == seed for i in range(len(cameras))]
        given = {
            name: turned(camera, pixels, 100 * seed + i) if bad[i] else camera
            for i, (name, camera) in enumerate(cameras.items())
        }
        with collected():
            result = raycam.texture_from_photos(world, given, photos, size=size)
        scores += [fit.shift_px for fit in result.photographs]
        wrong += bad
    assert area_under_roc(np.array(scores), np.array(wrong)) > 0.95


def grey(photo: np.ndarray) -> np.ndarray:
    return np.repeat(photo @ [[0.2126], [0.7152], [0.0722]], 3, axis=2)


def with_gamma(photo: np.ndarray) -> np.ndarray:
    return 255 * (photo / 255) ** 1.6


def with_dark_corners(photo: np.ndarray) -> np.ndarray:
    height, width = photo.shape[:2]
    y, x = np.mgrid[:height, :width]
    radius = np.hypot(y / height - 0.5, x / width - 0.5)
    return photo * (1 - 0.8 * radius**2)[..., None]


@pytest.mark.parametrize("look", [grey, with_gamma, with_dark_corners])
def test_correct_pose_of_a_photograph_with_another_look_gives_no_notice(
    look: Callable[[np.ndarray], np.ndarray],
) -> None:
    """The pattern is smooth, so that another look resembles a shift."""
    world = panel()
    cameras, photos = shots(world, ring_of_places(9), size=(160, 160), samples=8)
    photos["02.png"] = np.rint(look(photos["02.png"])).astype(np.uint8)
    with collected() as notices:
        raycam.texture_from_photos(world, cameras, photos, size=128)
    assert [notice for notice in notices if notice.code == "misaligned_photographs"] == []


def test_single_photograph_has_no_shift() -> None:
    world = panel()
    cameras, photos = shots(world, ring_of_places(1), size=(80, 80), samples=1)
    [fit] = raycam.texture_from_photos(world, cameras, photos, size=32).photographs
    assert np.isnan(fit.shift_px)
    assert np.isnan(fit.disagreement)
    assert fit.texels > 900
