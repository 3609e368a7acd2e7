"""Columns that are filled block by block."""

from __future__ import annotations

import numpy as np
import pytest
from raycam.lidar.column_buffer import ColumnBuffer


@pytest.mark.parametrize("capacity", [0, 10, 100, 10_000])
def test_column_buffer_contains_all_rows_in_order(capacity: int) -> None:
    random = np.random.default_rng(3)
    points, numbers = random.random((1000, 3)), np.arange(1000, dtype=np.int32)
    buffer, start = ColumnBuffer(capacity), 0
    for count in (0, 7, 100, 0, 893):
        own = slice(start, start + count)
        buffer.append({"position": points[own], "number": numbers[own]})
        start += count
    found = buffer.finish()
    assert list(found) == ["position", "number"]
    np.testing.assert_array_equal(found["position"], points)
    np.testing.assert_array_equal(found["number"], numbers)
    assert found["number"].dtype == np.int32
    assert all(array.flags.owndata and array.flags.c_contiguous for array in found.values())
