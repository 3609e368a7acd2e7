"""Waveforms against the sum of Gaussians."""

from __future__ import annotations

import numpy as np
import pytest
import raycam
from lidar.conftest import beams, quad
from raycam.lidar.pulse_tracer import PulseTracer
from support.raises import raises

LIGHT = 299792458.0


def screens() -> raycam.World:
    """Screens of 50 % opacity, white, at 10 m, 10.4 m and 25 m."""
    world = raycam.World()
    for distance in (10.0, 10.4, 25.0):
        white = {"color": [1.0] * 3, "opacity": 0.5, "alpha": "blend"}
        quad(world, [distance, 0, 0], [0, -5, 0], [0, 0, 5], f"at{distance}", **white)
    return world


def test_waveform_is_the_sum_of_the_pulses_that_the_screens_return() -> None:
    """Screen k returns E = 0.5 (0.25)^k / L².

    The pulses are 4 ns wide at half of their maximum.
    """
    scan = raycam.scan(screens(), beams(2, returns="all", noise=False, waveform=True, pulse_length=4e-9))
    assert scan["waveform"].shape == (4, 65)
    assert scan["waveform"].dtype == np.float32
    fwhm = 4e-9 * LIGHT / 2
    np.testing.assert_allclose(scan.waveform_offsets[[0, 32, 64]], [-2 * fwhm, 0, 2 * fwhm])
    at = scan["distance"][:, None] + scan.waveform_offsets
    expected = sum(
        0.5 * 0.25**k / d**2 * 0.5 ** (4 * ((at - d) / fwhm) ** 2) for k, d in enumerate((10.0, 10.4, 25.0))
    )
    np.testing.assert_allclose(scan["waveform"], expected, rtol=1e-5, atol=1e-12)
    assert (scan["waveform"].argmax(axis=1) == 32).all()


def test_waveform_of_a_wide_beam_sums_its_rays(yard: raycam.World) -> None:
    lidar = raycam.Lidar("os1-16", mode="512x10", beam_samples=7, noise=False, waveform=True, range_10=None)
    lidar = lidar.placed([0, 0, 1.8])
    scan = raycam.scan(yard, lidar)
    found = PulseTracer(yard, lidar, scan.pattern, 0, None).trace(range(len(scan.pattern)))
    sigma = lidar.pulse_extent / 2.3548200450309493
    mixed = np.flatnonzero(scan["purity"] < 0.9)[:20]
    assert len(mixed) > 3
    for row in mixed.tolist():
        own = found.pulse == scan["pulse"][row]
        offset = lidar.pattern().range_offset[scan["pulse"][row]]
        for sample in (0, 20, 32, 50):
            r = scan["distance"][row] - offset + scan.waveform_offsets[sample]
            value = sum(
                e * np.exp(-0.5 * ((r - x) / sigma) ** 2)
                for x, e in zip(found.length[own], found.energy[own], strict=True)
            )
            assert scan["waveform"][row, sample] == pytest.approx(value, rel=1e-4, abs=1e-15)


def test_waveform_of_a_lost_pulse_is_nan_and_is_absent_without_the_setting() -> None:
    lidar = beams(1, waveform=True, noise=False).placed([0, 0, 0], yaw=180)
    scan = raycam.scan(screens(), lidar, keep_lost=True)
    assert np.isnan(scan["waveform"]).all()
    assert "waveform" not in raycam.scan(screens(), beams(1))


def test_waveform_requires_a_pulse_with_a_length() -> None:
    with raises(raycam.LidarError, code="conflicting_values", mentions=["pulse_length"]):
        beams(1, waveform=True, pulse_length=0)
