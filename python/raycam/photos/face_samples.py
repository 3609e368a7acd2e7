"""The samples of faces for `surface_visibility`."""

from __future__ import annotations

import numpy as np

from ..arguments import Floats

__all__ = ["MAX_SAMPLES", "MIN_SAMPLES", "sample_pattern"]

MIN_SAMPLES = 4
"""Default minimum number of samples per face: the centroid and the corners."""
MAX_SAMPLES = 256
"""Maximum number of samples per face."""
CORNER_INSET = 0.01
"""Position of the corner samples, as a fraction of the way from the corners to the centroid."""


def sample_pattern(count: int, corners: bool = True) -> Floats:
    """Returns barycentric weights [count, 3] of the samples of a face.

    With `corners`, the centroid and inset corners come first; the other samples form a low-discrepancy set.

    Source: the R2 sequence (Roberts 2018), folded into the triangle.
    """
    inset = np.eye(3) * (1 - CORNER_INSET) + CORNER_INSET / 3
    fixed = np.concatenate([np.full((1, 3), 1 / 3), inset])[: count if corners else 0]
    number = np.arange(1, count - len(fixed) + 1)
    plastic = 1.32471795724474602596
    u, v = (0.5 + number / plastic) % 1, (0.5 + number / plastic**2) % 1
    folded = u + v > 1
    u, v = np.where(folded, 1 - u, u), np.where(folded, 1 - v, v)
    return np.concatenate([fixed, np.stack([1 - u - v, u, v], axis=1)])
