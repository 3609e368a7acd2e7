"""Elementary functions that have the same bits on every processor.

`tests/lidar/test_scan_bytes.py` compares bytes with those of other processors.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt
import pytest
from raycam import elementary

ANGLES = np.linspace(-20.0, 20.0, 4001)
POSITIVE = np.geomspace(1e-300, 1e300, 4001)


@pytest.mark.parametrize(
    ("function", "judge", "x"),
    [
        (elementary.acos, np.arccos, np.linspace(-1.0, 1.0, 4001)),
        (elementary.cos, np.cos, ANGLES),
        (elementary.exp, np.exp, np.linspace(-700.0, 700.0, 4001)),
        (elementary.log, np.log, POSITIVE),
        (elementary.sin, np.sin, ANGLES),
        (elementary.tan, np.tan, ANGLES),
    ],
)
def test_values_agree_with_numpy_within_two_roundings(
    function: Callable[[npt.ArrayLike], npt.NDArray[np.float64]], judge: np.ufunc, x: npt.NDArray[np.float64]
) -> None:
    expected = judge(x)
    assert np.all(np.abs(function(x) - expected) <= 2.0 * np.spacing(np.abs(expected)))


def test_results_have_the_shape_of_the_argument() -> None:
    assert elementary.cos(0.0).shape == ()
    assert elementary.sin([[0.0, 1.0, 2.0]]).shape == (1, 3)
    assert elementary.exp(np.zeros((0, 2))).shape == (0, 2)
    table = np.arange(12.0).reshape(3, 4)
    np.testing.assert_array_equal(elementary.sin(table.T), elementary.sin(table).T)


def test_results_beyond_the_domain_are_nan_or_infinite() -> None:
    assert np.isnan(elementary.acos([-1.1, 1.1, np.nan])).all()
    np.testing.assert_array_equal(elementary.log([-1.0, 0.0]), [np.nan, -np.inf])
    np.testing.assert_array_equal(elementary.exp([1000.0, -1000.0]), [np.inf, 0.0])
