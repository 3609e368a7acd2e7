"""Hesai's patterns."""

from __future__ import annotations

import numpy as np
from raycam.lidar.hesai import hesai_pattern


def test_hesai_channels_fire_at_their_documented_times_and_azimuths() -> None:
    """At time t, the rotor has turned clockwise by 360 rate t degrees.

    The channel's azimuth is added to this angle.
    """
    pattern = hesai_pattern([10.0, -20.0], [1.5, -3.0], [2e-6, 5e-6], columns=100, rate=20)
    assert pattern.shape == (2, 100)
    np.testing.assert_allclose(pattern.times.reshape(100, 2)[:, 1], np.arange(100) / 2000 + 5e-6)
    azimuth = np.degrees(np.arctan2(-pattern.directions[:, 1], pattern.directions[:, 0]))
    expected = 360 * 20 * pattern.times + np.tile([1.5, -3.0], 100)
    np.testing.assert_allclose((azimuth - expected + 180) % 360 - 180, 0, atol=1e-9)
    np.testing.assert_allclose(
        np.degrees(np.arcsin(pattern.directions[:, 2])), np.tile([10, -20], 100), atol=1e-9
    )
