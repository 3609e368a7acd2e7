"""Robust means of a texel's colours in photographs."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ..arguments import Floats
from ..srgb import LUMINANCE

__all__ = ["MAX_BLENDED_VIEWS", "TexelViews", "robust_mean"]

Single = npt.NDArray[np.float32]
Ints = npt.NDArray[np.int64]

MAX_BLENDED_VIEWS = 8
"""Number of views that are blended per texel; the views with the largest weights are used."""
LUMINANCE_TOLERANCE = 0.06
"""Relative difference of luminance within which views agree."""
CHUNK_TEXELS = 1 << 16
"""Number of texels processed at a time, about 50 MB."""


class TexelViews:
    """For a set of texels, the views with the largest weights, filled photograph by photograph."""

    BYTES = MAX_BLENDED_VIEWS * 20 + 4
    """The memory that each texel needs, in bytes."""

    def __init__(self, count: int) -> None:
        self.weights = np.zeros((count, MAX_BLENDED_VIEWS), np.float32)
        self.colors = np.zeros((count, MAX_BLENDED_VIEWS, 3), np.float32)
        self.cameras = np.zeros((count, MAX_BLENDED_VIEWS), np.int32)
        self.views = np.zeros(count, np.int32)

    def add(self, number: int, index: Ints, weight: Single, colors: Single) -> None:
        """Adds the colours [k, 3] of the texels [k] in the photograph `number`."""
        self.views[index] += 1
        slot = self.weights[index].argmin(axis=1)
        better = weight > self.weights[index, slot]
        self.weights[index[better], slot[better]] = weight[better]
        self.colors[index[better], slot[better]] = colors[better]
        self.cameras[index[better], slot[better]] = number

    def write_mean(self, gains: Floats, mean: Single, spread: Single) -> None:
        """Writes the robust means [n, 3] and the disagreement [n] of all texels into the arrays.

        The colours are divided by the photographs' `gains` [cameras, 3].
        """
        factors = gains.astype(np.float32)
        for first in range(0, len(self.views), CHUNK_TEXELS):
            part = slice(first, first + CHUNK_TEXELS)
            colors = self.colors[part] / factors[self.cameras[part]]
            mean[part], spread[part] = robust_mean(self.weights[part], colors)


def robust_mean(weights: Single, colors: Single) -> tuple[Single, Single]:
    """The weighted mean [n, 3] of colours [n, k, 3], and the relative spread [n] of luminance.

    The mean excludes outliers, whose luminance differs from the weighted median by more than max(3 MAD, 6 %).
    """
    order = np.argsort(-weights, axis=1, kind="stable")
    heavy = np.take_along_axis(weights.astype(np.float64), order, axis=1)
    colors = np.take_along_axis(colors, order[..., None], axis=1)
    light = (colors * LUMINANCE).sum(axis=2).astype(np.float64)
    kept = heavy * ~luminance_outliers(light, heavy)
    total = np.maximum(kept.sum(axis=1), 1e-300)
    mean = (kept[..., None] * colors).sum(axis=1) / total[:, None]
    every = np.maximum(heavy.sum(axis=1), 1e-300)
    middle = (heavy * light).sum(axis=1) / every
    variance = (heavy * (light - middle[:, None]) ** 2).sum(axis=1) / every
    spread = np.sqrt(variance) / np.maximum(middle, 1e-6)
    return mean.astype(np.float32), spread.astype(np.float32)


def luminance_outliers(light: Floats, weights: Floats) -> npt.NDArray[np.bool_]:
    """Mask [n, k] of luminances that differ too much from their row's weighted median.

    The limit is max(3 MAD, 6 %), where MAD is the median absolute deviation.
    """
    median = weighted_median(light, weights)[:, None]
    off = np.abs(light - median)
    mad = weighted_median(off, weights)[:, None]
    found: npt.NDArray[np.bool_] = off > np.maximum(3 * mad, LUMINANCE_TOLERANCE * median)
    return found


def weighted_median(values: Floats, weights: Floats) -> Floats:
    """The lower weighted medians [n] of values [n, k]."""
    order = np.argsort(values, axis=1, kind="stable")
    sums = np.cumsum(np.take_along_axis(weights, order, axis=1), axis=1)
    place = (sums < sums[:, -1:] / 2).sum(axis=1)
    place = np.minimum(place, values.shape[1] - 1)
    found: Floats = np.take_along_axis(np.take_along_axis(values, order, axis=1), place[:, None], axis=1)[
        :, 0
    ]
    return found
