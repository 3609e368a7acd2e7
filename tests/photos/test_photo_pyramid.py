"""Colours of a photograph at fractional pixels: means over areas of pixels."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
import raycam
from raycam._core import PhotoPyramid
from raycam.io.oriented_photo import linear_pixels
from support.raises import raises


def test_areas_of_one_and_two_pixels_have_the_means_of_their_pixels() -> None:
    photo = np.random.default_rng(3).random((20, 30, 4)).astype(np.float32)
    pyramid = PhotoPyramid(photo)
    u, v = np.meshgrid(np.arange(30), np.arange(20))
    centers = np.stack([u, v], axis=2).reshape(-1, 2) + 0.5
    found = pyramid.mean_colors(centers, np.tile(np.eye(2), (600, 1, 1)), None)
    np.testing.assert_allclose(found.reshape(20, 30, 4), photo, atol=1e-6)
    u, v = np.meshgrid(np.arange(15), np.arange(10))
    centers = np.stack([u, v], axis=2).reshape(-1, 2) * 2.0 + 1
    found = pyramid.mean_colors(centers, np.tile(2 * np.eye(2), (150, 1, 1)), None)
    expected = cv2.resize(photo, (15, 10), interpolation=cv2.INTER_AREA)
    np.testing.assert_allclose(found.reshape(10, 15, 4), expected, atol=1e-6)


@pytest.mark.parametrize("degrees", [0, 25, 60, 90, 130, 170])
def test_long_area_blurs_waves_along_its_axis_only(degrees: int) -> None:
    turn = np.radians(degrees)
    axis = np.array([np.cos(turn), np.sin(turn)])
    u, v = np.meshgrid(np.arange(128) + 0.5, np.arange(128) + 0.5)

    def contrast(direction: np.ndarray) -> float:
        wave = np.sin((u * direction[0] + v * direction[1]) * 2 * np.pi / 8)
        pyramid = PhotoPyramid(np.repeat(wave[..., None], 4, axis=2).astype(np.float32))
        places = 64 + np.arange(8)[:, None] * direction
        area = np.stack([8 * axis, np.array([-axis[1], axis[0]])], axis=1)
        return float(np.ptp(pyramid.mean_colors(places, np.tile(area, (8, 1, 1)), None)[:, 0]))

    assert contrast(np.array([-axis[1], axis[0]])) > 1.2
    assert contrast(axis) < 0.5


def test_area_that_is_not_finite_has_the_color_of_its_pixel() -> None:
    photo = np.random.default_rng(4).random((6, 5, 4)).astype(np.float32)
    found = PhotoPyramid(photo).mean_colors(np.array([[2.5, 3.5]]), np.full((1, 2, 2), np.nan), None)
    np.testing.assert_allclose(found[0], photo[3, 2], atol=1e-6)


@pytest.mark.parametrize("shape", [(4,), (4, 4), (4, 4, 3), (2, 2, 4, 4), (0, 4, 4)])
def test_photograph_of_another_shape_is_refused(shape: tuple[int, ...]) -> None:
    with raises(raycam.SettingsError):
        PhotoPyramid(np.zeros(shape, np.float32))


def test_areas_and_places_of_different_numbers_are_refused() -> None:
    with raises(raycam.SettingsError):
        PhotoPyramid(np.zeros((4, 4, 4), np.float32)).mean_colors(np.zeros((3, 2)), np.zeros((2, 2, 2)), None)


def test_srgb_photograph_has_the_same_colors_as_its_linear_pixels() -> None:
    stored = np.random.default_rng(5).integers(0, 256, (21, 34, 4)).astype(np.uint8)
    random = np.random.default_rng(6)
    places, areas = random.uniform(0, 34, (500, 2)), random.uniform(-6, 6, (500, 2, 2))
    found = PhotoPyramid(stored).mean_colors(places, areas, None)
    np.testing.assert_array_equal(found, PhotoPyramid(linear_pixels(stored)).mean_colors(places, areas, None))
