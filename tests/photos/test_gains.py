"""Gains of photographs are recovered for any number and overlap."""

from __future__ import annotations

import numpy as np
import pytest
import raycam
from raycam import _core
from raycam.photos.gains import estimate_gains
from raycam.photos.survey import Survey
from support.textured_panel import inner, panel, pattern, psnr, ring_of_places, shots


def survey(point: np.ndarray, camera: np.ndarray, color: np.ndarray, points: int, cameras: int) -> Survey:
    one = np.ones(len(point), np.float32)
    two = np.zeros((len(point), 2), np.float32)
    ids = point.astype(np.int32), camera.astype(np.int32)
    return Survey(points, cameras, *ids, color.astype(np.float32), one, one, two, two)


def test_random_gains_of_photographs_are_recovered_within_half_a_percent() -> None:
    world = panel()
    cameras, photos = shots(world, ring_of_places(5), size=(200, 200))
    gains = np.random.default_rng(4).uniform(0.6, 1.25, (5, 3))
    gains /= np.exp(np.log(gains).mean(axis=0))
    dimmed = {
        name: np.rint(
            255 * srgb(np.clip(_core.linear_from_srgb8(photo) * gains[i].astype(np.float32), 0, 1))
        ).astype(np.uint8)
        for i, (name, photo) in enumerate(photos.items())
    }
    result = raycam.texture_from_photos(world, cameras, dimmed, size=64)
    found = np.array([fit.gain for fit in result.photographs])
    np.testing.assert_allclose(found, gains, rtol=0.005)
    assert psnr(inner(result.texture), inner(pattern())) > 40
    # Without the gains, the mean of the photographs is wrong.
    off = raycam.texture_from_photos(world, cameras, dimmed, size=64, exposure="off")
    assert all(fit.gain == (1, 1, 1) for fit in off.photographs)
    assert psnr(inner(off.texture), inner(pattern())) < psnr(inner(result.texture), inner(pattern())) - 3


def srgb(linear: np.ndarray) -> np.ndarray:
    """The sRGB values of linear light (IEC 61966-2-1)."""
    return np.where(
        linear <= 0.0031308, 12.92 * linear, 1.055 * np.maximum(linear, 1e-9) ** (1 / 2.4) - 0.055
    )


def test_highlights_of_a_fifth_of_the_views_do_not_change_the_gains() -> None:
    random = np.random.default_rng(1)
    point, camera = (each.ravel() for each in np.meshgrid(np.arange(900), np.arange(4), indexing="ij"))
    truth = np.array([0.8, 1.25, 1.1, 1 / 1.1])
    color = random.uniform(0.05, 0.4, (900, 3))[point] * truth[camera][:, None]
    color[(random.random(len(point)) < 0.2) & (camera == 2)] *= 1.8
    np.testing.assert_allclose(
        estimate_gains(survey(point, camera, color, 900, 4)), truth[:, None].repeat(3, 1), rtol=0.01
    )


def test_gains_equal_the_least_squares_solution_with_all_unknowns() -> None:
    random = np.random.default_rng(2)
    point, camera = np.nonzero(random.random((60, 7)) < 0.5)
    color = random.uniform(0.1, 0.5, (60, 3))[point] * random.uniform(0.9, 1.1, (7, 3))[camera]
    color *= random.normal(1, 0.002, color.shape)
    matrix = np.zeros((len(point), 67))
    matrix[np.arange(len(point)), point] = 1
    matrix[np.arange(len(point)), 60 + camera] = 1
    # Each point has the weight 1, whatever the number of its views.
    weight = 1 / np.sqrt(np.bincount(point, minlength=60)[point])
    expected = np.linalg.lstsq(matrix * weight[:, None], np.log(color) * weight[:, None], rcond=None)[0][60:]
    expected -= expected.mean(axis=0)
    found = np.log(estimate_gains(survey(point, camera, color, 60, 7)))
    np.testing.assert_allclose(found, expected, atol=3e-4)


@pytest.mark.parametrize("color", [0.999, 0.0001])
def test_photographs_without_overlap_and_clipped_photographs_have_the_gain_1(color: float) -> None:
    point, camera = np.array([0, 0, 1]), np.array([0, 1, 2])
    colors = np.full((3, 3), color)
    assert (estimate_gains(survey(point, camera, colors, 2, 3)) == 1).all()
    apart = estimate_gains(survey(np.arange(3), camera, np.full((3, 3), 0.3), 3, 3))
    assert (apart == 1).all()


def test_each_group_of_overlapping_photographs_has_the_mean_gain_1() -> None:
    point = np.repeat(np.arange(40), 2)
    camera = np.where(np.repeat(np.arange(40), 2) < 20, 0, 2) + np.tile([0, 1], 40)
    truth = np.array([2.0, 0.5, 1.2, 1 / 1.2])
    color = np.full((80, 3), 0.2) * truth[camera][:, None]
    found = estimate_gains(survey(point, camera, color, 40, 4))
    np.testing.assert_allclose(found, truth[:, None].repeat(3, 1), rtol=1e-5)
