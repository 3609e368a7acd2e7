"""Sub-rays of a beam against the moments of the Gaussian."""

from __future__ import annotations

import math

import numpy as np
import pytest
import raycam
from lidar.conftest import quad
from raycam.lidar.beam import beam_rays, hexagonal_set


@pytest.mark.parametrize("samples", [7, 19, 37])
def test_beam_samples_have_the_second_moment_of_the_gaussian(samples: int) -> None:
    """For exp(-2 r²), the mean of r² is 1/2, and the mean of x² and of y² is 1/4.

    The samples are centred.
    """
    points, weights = hexagonal_set(samples)
    assert points.shape == (samples, 2)
    assert weights.sum() == pytest.approx(1)
    np.testing.assert_allclose(weights @ points, 0, atol=1e-12)
    np.testing.assert_allclose(points.T @ (weights[:, None] * points), np.eye(2) / 4, atol=1e-12)
    np.testing.assert_array_equal(points[0], 0)


def test_footprint_is_exit_width_plus_range_times_divergence() -> None:
    """The widths at 1/e² are compared in both directions.

    The root mean square of the samples' offsets is a quarter of the width.
    """
    ones = np.array([[1.0, 0, 0]])
    starts, ways, _ = beam_rays(
        np.zeros((1, 3)), ones, np.eye(3)[None], (0.01, 0.004), (3e-3, 1e-3), 37, np.zeros(1)
    )
    at = starts[0] + ways[0] * (50 / ways[0, :, 0])[:, None]
    horizontal, vertical = 0.01 + 50 * 3e-3, 0.004 + 50 * 1e-3
    np.testing.assert_allclose(2 * 2 * np.sqrt((at[:, 1] ** 2).mean()), horizontal, rtol=1e-5)
    np.testing.assert_allclose(2 * 2 * np.sqrt((at[:, 2] ** 2).mean()), vertical, rtol=1e-5)


def test_single_beam_sample_is_the_axis() -> None:
    starts, ways, weights = beam_rays(
        np.ones((2, 3)),
        np.array([[1.0, 0, 0], [0, 0, 1.0]]),
        np.eye(3)[None],
        (0.1, 0.1),
        (0.1, 0.1),
        1,
        np.zeros(2),
    )
    np.testing.assert_array_equal(ways[:, 0], [[1, 0, 0], [0, 0, 1]])
    np.testing.assert_array_equal(starts[:, 0], np.ones((2, 3)))
    assert weights.tolist() == [1.0]


@pytest.mark.parametrize("offset", [0.0, 0.25, 0.5, 1.0])
def test_step_edge_splits_the_energy_like_the_gaussian(offset: float) -> None:
    """The near surface returns the share Phi(2 offset / w), with the radius w at 1/e².

    Random rotations of the samples are averaged.
    """
    count = 400
    radius = 20 * math.tan(0.01)  # the full divergence is 20 mrad
    world = raycam.World()
    quad(world, [20, -50 + offset * radius, 0], [0, -50, 0], [0, 0, 50], "near")
    quad(world, [30, 0, 0], [0, -500, 0], [0, 0, 500], "far")
    lidar = raycam.Lidar.of(
        np.tile([1.0, 0, 0], (count, 1)), beam_samples=37, beam_divergence=0.02, noise=False, returns="all"
    )
    scan = raycam.scan(world, lidar)
    near = scan["instance"] == 0
    share = scan["reflectivity"][near].sum() / 0.5 / count
    expected = 0.5 * (1 + math.erf(2 * offset / math.sqrt(2)))
    assert share == pytest.approx(expected, abs=0.02)
    assert (scan["purity"] == 1).all()
