"""Random numbers of scans."""

from __future__ import annotations

import numpy as np
import pytest
from raycam.lidar.random_numbers import standard_normals, uniform_numbers


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
    found = uniform_numbers(10_000, 0, 0, "beam")
    counts = np.histogram(found, 10, (0, 1))[0]
    assert ((counts - 1000) ** 2 / 1000).sum() < 27.9  # chi² with 9 degrees of freedom, p = 0.001
