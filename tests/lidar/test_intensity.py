"""Intensities as the lidars of different manufacturers report them."""

from __future__ import annotations

import numpy as np
from raycam.lidar.intensity import device_intensity


def test_velodyne_and_ouster_intensities_are_at_most_100_for_diffuse_targets_and_above_for_retroreflectors() -> (
    None
):
    values = np.array([0, 0.1, 0.5, 1.0, 1.01, 30.0, 1e6], np.float32)
    for family in ("velodyne", "ouster"):
        found = device_intensity(family, values)
        assert found.dtype == np.uint8
        assert found[:4].tolist() == [0, 10, 50, 100]
        assert 101 <= found[4] < found[5] < found[6] == 255


def test_hesai_intensities_are_linear_up_to_255() -> None:
    assert device_intensity("hesai", np.array([0, 0.2, 1.0, 2.0], np.float32)).tolist() == [0, 51, 255, 255]
