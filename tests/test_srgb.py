"""The sRGB transfer function, compared with the bytes that the core converts."""

from __future__ import annotations

import numpy as np
from raycam import _core
from raycam.srgb import linear_from_srgb


def test_linear_from_srgb_equals_the_core_for_every_byte() -> None:
    values = np.arange(256, dtype=np.uint8).reshape(1, 256, 1).repeat(3, axis=2)
    expected = _core.linear_from_srgb8(np.ascontiguousarray(values))
    assert np.allclose(linear_from_srgb(values / 255), expected, rtol=1e-6, atol=1e-9)
