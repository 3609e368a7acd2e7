"""Packing of planes: every filter restores every bit."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
from raycam.viewer.wire import BEST, DTYPES, FILTERS, pack, reduced, unpack
from support.raises import raises


@pytest.mark.parametrize("filter", FILTERS)
@pytest.mark.parametrize("dtype", DTYPES)
@given(data=st.data())
def test_packed_planes_are_restored_bit_for_bit(filter: str, dtype: str, data: st.DataObject) -> None:
    height, width, components = (data.draw(st.integers(1, n)) for n in (7, 9, 4))
    bits = arrays.arrays(f"u{np.dtype(dtype).itemsize}", (height, width, components))
    values = data.draw(bits).view(dtype)
    for level in (0, 1, 6):
        header, packed = pack("x", values, level=level, filter=filter)
        assert unpack(header, packed).tobytes() == values.tobytes()


def test_planes_without_a_component_axis_have_one_component() -> None:
    header, packed = pack("depth", np.full((2, 3), np.inf, np.float32))
    assert (header["components"], header["filter"]) == (1, BEST["depth"])
    assert unpack(header, packed).shape == (2, 3, 1)


def test_non_contiguous_arrays_are_packed() -> None:
    values = np.arange(24, dtype=np.int32).reshape(4, 6)[::2, ::3]
    header, packed = pack("x", values)
    assert unpack(header, packed)[..., 0].tolist() == values.tolist()


def test_unsupported_dtypes_are_refused() -> None:
    with raises(ValueError, mentions=["int64"]):
        pack("x", np.zeros((1, 1), np.int64))


def test_rounding_changes_finite_numbers_little_and_keeps_nan_and_infinities() -> None:
    rng = np.random.default_rng(1)
    values = (rng.normal(size=(50, 60)) * 10.0 ** rng.integers(-30, 30, (50, 60))).astype(np.float32)
    values[0, :4] = [np.nan, np.inf, -np.inf, 0]
    found = reduced(values)
    finite = np.isfinite(values)
    assert np.array_equal(np.isnan(found), np.isnan(values))
    assert np.array_equal(found[~finite & ~np.isnan(values)], values[~finite & ~np.isnan(values)])
    error = np.abs(found[finite].astype(float) - values[finite])
    assert (error <= 2.0**-13 * np.abs(values[finite].astype(float))).all()
    assert (found.view(np.uint32)[finite] & 0x7FF == 0).all()
    assert error.any()


def test_whole_numbers_are_not_rounded() -> None:
    ids = np.arange(1 << 20, dtype=np.int32).reshape(1024, 1024)
    assert reduced(ids) is ids
