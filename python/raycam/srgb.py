"""The sRGB transfer function (IEC 61966-2-1)."""

from __future__ import annotations

import numpy as np

from .arguments import Floats

__all__ = ["linear_from_srgb"]


def linear_from_srgb(values: Floats) -> Floats:
    """Returns linear values for sRGB values from 0 to 1, of any shape."""
    linear: Floats = np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)
    return linear
