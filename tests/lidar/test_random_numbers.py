"""Random numbers of scans."""

from __future__ import annotations

import numpy as np
import pytest
from raycam.lidar.random_numbers import PulseNumbers, standard_normals


def test_random_numbers_of_a_pulse_do_not_depend_on_the_number_of_pulses() -> None:
    few, many = standard_normals(10, 1, 2, "distance"), standard_normals(1000, 1, 2, "distance")
    np.testing.assert_array_equal(few, many[:10])


@pytest.mark.parametrize(
    "other", [(2, 2, "distance", 0), (1, 3, "distance", 0), (1, 2, "detection", 0), (1, 2, "distance", 1)]
)
def test_streams_differ_by_seed_frame_use_and_echo(other: tuple[int, int, str, int]) -> None:
    first = standard_normals(10_000, 1, 2, "distance", 0)
    second = standard_normals(10_000, *other)
    assert abs(np.corrcoef(first, second)[0, 1]) < 0.03


def test_uniform_numbers_fill_the_unit_interval() -> None:
    found = PulseNumbers(0, 0).uniforms("beam", 0, 10_000)
    counts = np.histogram(found, 10, (0, 1))[0]
    assert ((counts - 1000) ** 2 / 1000).sum() < 27.9  # chi² with 9 degrees of freedom, p = 0.001


def test_numbers_of_a_pulse_do_not_depend_on_the_range() -> None:
    expected = standard_normals(1000, 3, 4, "distance", 1)
    numbers = PulseNumbers(3, 4)
    for first, stop in ((0, 10), (10, 300), (300, 301), (350, 350), (500, 1000), (20, 40)):
        found = numbers.normals("distance", 1, first, stop)
        np.testing.assert_array_equal(found, expected[first:stop])
        other = numbers.normals("distance", 0, first, stop)
        assert not np.isin(other, expected).any()
    np.testing.assert_array_equal(
        np.concatenate([numbers.uniforms("beam", i, i + 7) for i in range(0, 70, 7)]),
        PulseNumbers(3, 4).uniforms("beam", 0, 70),
    )
