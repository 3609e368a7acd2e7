"""Velodyne's patterns.

Times and angles are compared with the manual, corrections with the ROS driver.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
import raycam
from raycam.lidar.velodyne import Laser, velodyne_pattern, velodyne_rings
from support.velodyne_driver import driver_point


def test_vlp16_fires_every_2304_nanoseconds_in_cycles_of_55296() -> None:
    times = raycam.Lidar("vlp16", rate=10).pattern().times.reshape(-1, 16)
    np.testing.assert_allclose(np.diff(times, axis=1), 2.304e-6, atol=1e-15)
    np.testing.assert_allclose(np.diff(times[:, 0]), 55.296e-6, atol=1e-12)
    assert len(times) == 1808  # the number of complete firing cycles in 0.1 s


@pytest.mark.parametrize("rate", [5, 10, 20])
def test_vlp16_azimuth_advances_between_the_lasers_of_a_column(rate: float) -> None:
    pattern = raycam.Lidar("vlp16", rate=rate).pattern()
    turn = np.unwrap(np.arctan2(pattern.directions[:, 1], pattern.directions[:, 0]))
    np.testing.assert_allclose(turn, -2 * math.pi * rate * pattern.times, atol=1e-9)


def test_vlp16_elevations_heights_and_rings_equal_the_manual() -> None:
    pattern = raycam.Lidar("vlp16").pattern()
    elevation = np.degrees(np.arcsin(pattern.directions[:16, 2]))
    np.testing.assert_allclose(elevation, [-15, 1, -13, 3, -11, 5, -9, 7, -7, 9, -5, 11, -3, 13, -1, 15])
    assert pattern.rings[:16].tolist() == [0, 8, 1, 9, 2, 10, 3, 11, 4, 12, 5, 13, 6, 14, 7, 15]
    millimetres = [11.2, -0.7, 9.7, -2.2, 8.1, -3.7, 6.6, -5.1, 5.1, -6.6, 3.7, -8.1, 2.2, -9.7, 0.7, -11.2]
    np.testing.assert_allclose(pattern.origins[:16] * 1000, np.outer(millimetres, [0, 0, 1]), atol=1e-12)


@pytest.mark.parametrize("two_point", [False, True])
@pytest.mark.parametrize("raw", [3.0, 8.5, 40.0, 100.0])
def test_corrected_pattern_passes_through_the_drivers_points(raw: float, two_point: bool) -> None:
    rng = np.random.default_rng(4)
    lasers = [
        Laser(
            vert_correction=math.radians(float(elevation)),
            rot_correction=float(rng.uniform(-0.15, 0.15)),
            dist_correction=float(rng.uniform(0.9, 1.4)),
            vert_offset_correction=float(rng.uniform(0.1, 0.22)),
            horiz_offset_correction=float(rng.choice([-0.026, 0.026])),
            dist_correction_x=float(rng.uniform(0.9, 1.4)) if two_point else None,
            dist_correction_y=float(rng.uniform(0.9, 1.4)) if two_point else None,
        )
        for elevation in rng.uniform(-24, 2, 8)
    ]
    offsets = np.arange(8) * 1e-5
    pattern = velodyne_pattern(lasers, offsets.tolist(), 1e-3, 10)
    along = (raw - pattern.range_offset) / pattern.range_scale
    points = pattern.origins + along[:, None] * pattern.directions
    azimuths = 2 * math.pi * 10 * pattern.times
    laser_of = pattern.lasers.tolist()
    expected = [driver_point(lasers[i], a, raw) for i, a in zip(laser_of, azimuths.tolist(), strict=True)]
    # The driver's formula uses absolute values of x and y, so points near an axis deviate from a straight beam.
    apart = np.abs(points - np.array(expected)).max(axis=1)
    crossing = np.abs(np.array(expected)[:, :2]).min(axis=1) < 0.3
    assert apart[~crossing].max() < 1e-9
    assert apart.max() < (0.02 if two_point else 1e-9)
    np.testing.assert_allclose(np.linalg.norm(pattern.directions, axis=1), 1, atol=1e-12)


def test_rings_are_counted_from_the_lowest_elevation() -> None:
    lasers = [Laser(0.1), Laser(-0.3), Laser(0.0)]
    assert velodyne_rings(lasers) == [2, 0, 1]
