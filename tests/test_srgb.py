"""The sRGB transfer function, compared with the core's conversion of bytes."""

from __future__ import annotations

import numpy as np
from raycam import _core
from raycam.srgb import linear_from_srgb, srgb_from_linear


def test_linear_from_srgb_equals_the_core_for_every_byte() -> None:
    values = np.arange(256, dtype=np.uint8).reshape(1, 256, 1).repeat(3, axis=2)
    expected = _core.linear_from_srgb8(np.ascontiguousarray(values))
    assert np.allclose(linear_from_srgb(values / 255), expected, rtol=1e-6, atol=1e-9)


def test_srgb_from_linear_inverts_linear_from_srgb() -> None:
    values = np.linspace(0, 1, 1001)
    assert np.allclose(srgb_from_linear(linear_from_srgb(values)), values, rtol=0, atol=3e-8)


def test_srgb_conversions_keep_float32() -> None:
    values = np.linspace(0, 1, 5, dtype=np.float32)
    assert linear_from_srgb(values).dtype == srgb_from_linear(values).dtype == np.float32
