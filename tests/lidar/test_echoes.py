"""Echoes against the waveform, sampled finely."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest
from raycam.lidar.echoes import FWHM_TO_SIGMA, find_echoes
from raycam.lidar.paths import Contributions


def contributions(
    lengths: npt.ArrayLike, energies: npt.ArrayLike, pulses: npt.ArrayLike = 0
) -> Contributions:
    length = np.asarray(lengths, float)
    count = len(length)
    numbers = np.arange(count, dtype=np.int32)
    return Contributions(
        np.broadcast_to(np.asarray(pulses, np.int64), length.shape).copy(),
        np.arange(count, dtype=np.int64),
        length,
        np.broadcast_to(np.asarray(energies, float), length.shape).copy(),
        np.zeros(count, np.int32),
        numbers,
        np.zeros(count),
        np.zeros((count, 3)),
        length,
        {"instance": numbers},
        np.zeros(1, bool),
    )


def sampled_maxima(lengths: npt.ArrayLike, energies: npt.ArrayLike, sigma: float) -> npt.NDArray[np.float64]:
    length, energy = np.asarray(lengths, float), np.asarray(energies, float)
    r = np.arange(length.min() - 3 * sigma, length.max() + 3 * sigma, sigma / 2000)
    wave = (energy * np.exp(-0.5 * ((r[:, None] - length) / sigma) ** 2)).sum(axis=1)
    top = np.flatnonzero((wave[1:-1] > wave[:-2]) & (wave[1:-1] >= wave[2:])) + 1
    return r[top]


@pytest.mark.parametrize("gap", [0.1, 0.5, 1.0, 1.9, 2.1, 2.5, 3.0, 5.0])
def test_two_equal_surfaces_merge_below_two_standard_deviations(gap: float) -> None:
    sigma = 0.6 * FWHM_TO_SIGMA
    lengths = [10.0, 10.0 + gap * sigma]
    found = find_echoes(contributions(lengths, 1.0), 0.6)
    assert len(found.pulse) == (1 if gap < 2 else 2)
    np.testing.assert_allclose(found.length, sampled_maxima(lengths, [1, 1], sigma), atol=sigma / 1000)
    if gap < 2:
        assert found.length[0] == pytest.approx(np.mean(lengths), abs=1e-9)
    assert found.energy.sum() == pytest.approx(2)


def test_random_waveforms_have_the_maxima_of_their_samples() -> None:
    rng = np.random.default_rng(8)
    for _ in range(100):
        sigma = 0.25
        lengths = np.sort(rng.uniform(5, 9, rng.integers(2, 9)))
        energies = rng.uniform(0.2, 1, len(lengths))
        found = find_echoes(contributions(lengths, energies), sigma / FWHM_TO_SIGMA)
        expected = sampled_maxima(lengths, energies, sigma)
        np.testing.assert_allclose(found.length, expected, atol=1e-3)
        assert found.energy.sum() == pytest.approx(energies.sum())


def test_surfaces_beyond_the_pulse_length_are_separate_echoes() -> None:
    found = find_echoes(contributions([5.0, 9.0, 30.0], [1, 2, 3]), 0.6)
    np.testing.assert_allclose(found.length, [5, 9, 30], atol=1e-6)
    np.testing.assert_allclose(found.energy, [1, 2, 3])
    assert found.main.tolist() == [0, 1, 2]
    assert found.purity.tolist() == [1, 1, 1]


def test_purity_is_the_energy_share_of_the_strongest_surface() -> None:
    found = find_echoes(contributions([5.0, 5.01], [1, 3]), 0.6)
    assert found.purity[0] == pytest.approx(0.75)
    assert found.main.tolist() == [1]


def test_echoes_of_different_pulses_are_independent() -> None:
    found = find_echoes(contributions([5.0, 5.01, 5.02], 1.0, [0, 1, 1]), 0.6)
    assert found.pulse.tolist() == [0, 1]


def test_empty_waveforms_have_no_echoes() -> None:
    assert len(find_echoes(contributions([], []), 0.6).pulse) == 0
