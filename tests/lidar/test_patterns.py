"""Patterns of all devices and families."""

from __future__ import annotations

import numpy as np
import pytest
import raycam
from raycam.lidar import device_names
from raycam.lidar.pattern import MAX_PULSES
from support.raises import raises


@pytest.mark.parametrize("name", device_names())
def test_every_device_has_a_pattern_of_unit_vectors_within_its_frame(name: str) -> None:
    lidar = raycam.Lidar(name)
    pattern = lidar.pattern()
    np.testing.assert_allclose(np.linalg.norm(pattern.directions, axis=1), 1, atol=1e-12)
    assert pattern.times.min() >= 0
    assert pattern.times.max() < 1 / lidar.rate + 1e-4
    assert len(pattern) == len(pattern.rings) == len(pattern.columns) == len(pattern.range_scale)
    assert lidar.sources, "each device lists the sources of its numbers"


def test_golden_pattern_covers_the_field_of_view_evenly() -> None:
    """Equal areas of the sphere receive equal numbers of pulses."""
    pattern = raycam.Lidar("livox-hap").pattern()
    up = pattern.directions[:, 2]
    azimuth = np.arctan2(pattern.directions[:, 1], pattern.directions[:, 0])
    counts, _, _ = np.histogram2d(up, azimuth, bins=(6, 8))
    expected = len(pattern) / 48
    assert np.abs(counts / expected - 1).max() < 0.05


def test_frame_with_too_many_pulses_is_refused_before_allocation() -> None:
    lidar = raycam.Lidar("livox-mid40", rate=1e-4, force_rate=True)
    with raises(MemoryError, mentions=["1000000000", "GiB"]):
        lidar.pattern()
    assert MAX_PULSES < 10**9


def test_pattern_with_too_many_directions_is_refused_before_allocation() -> None:
    directions = np.broadcast_to(np.array([1.0, 0, 0]), (10**15, 3))
    with raises(MemoryError, mentions=["1000000000000000", "GiB"]):
        raycam.Lidar.of(directions)


def test_directions_of_extreme_lengths_become_unit_vectors() -> None:
    lengths = np.array([1e-300, 1e-5, 1.0, 1e200])
    pattern = raycam.Lidar.of(np.outer(lengths, [0.6, 0, 0.8])).pattern()
    np.testing.assert_allclose(pattern.directions, np.tile([0.6, 0, 0.8], (4, 1)), rtol=1e-14)


def test_scan_line_has_the_steps_of_the_manual() -> None:
    """Hokuyo C-42-03320B, table 2.

    A turn has 1440 steps and takes 25 ms. Steps 0 to 1080 are measured, counterclockwise; step 540 is in
    front.
    """
    lidar = raycam.Lidar("hokuyo-utm30lx")
    pattern = lidar.pattern()
    azimuth = np.degrees(np.arctan2(pattern.directions[:, 1], pattern.directions[:, 0]))
    np.testing.assert_allclose(azimuth, np.linspace(-135, 135, 1081), atol=1e-12)
    np.testing.assert_allclose(pattern.times, np.arange(1081) * 0.025 / 1440, atol=1e-15)
    assert pattern.shape == (1, 1081)
    assert not pattern.directions[:, 2].any()
    world = raycam.World()
    world.add_object(box={"size": [8, 6, 2]}, name="room", color=[0.5] * 3)
    scan = raycam.scan(world, lidar)
    turn = np.radians(azimuth)
    with np.errstate(divide="ignore"):
        expected = np.minimum(4 / np.abs(np.cos(turn)), 3 / np.abs(np.sin(turn)))
    np.testing.assert_allclose(scan["distance"], expected, atol=0.0005 + 1e-12)
    np.testing.assert_allclose(scan["distance"] * 1000, np.rint(scan["distance"] * 1000), atol=1e-9)
