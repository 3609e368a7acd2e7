"""Robust means of a texel's colours in photographs."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from .._core import TexelViews
from ..arguments import Floats
from ..srgb import LUMINANCE

__all__ = ["robust_mean", "write_means"]

Single = npt.NDArray[np.float32]

LUMINANCE_TOLERANCE = 0.06
"""Relative difference of luminance within which views agree."""
CHUNK_TEXELS = 1 << 16
"""Number of texels processed at a time, about 50 MB."""


def write_means(views: TexelViews, gains: Floats, mean: Single, spread: Single) -> None:
    """Writes the robust means [n, 3] and the disagreement [n] of all texels into the arrays.

    The colours are divided by the photographs' `gains` [cameras, 3].
    """
    factors = gains.astype(np.float32)
    for first in range(0, len(mean), CHUNK_TEXELS):
        part = slice(first, min(first + CHUNK_TEXELS, len(mean)))
        weights, colors, cameras = views.kept(part.start, part.stop)
        mean[part], spread[part] = robust_mean(weights, colors / factors[cameras])


def robust_mean(weights: Single, colors: Single) -> tuple[Single, Single]:
    """The weighted mean [n, 3] of colours [n, k, 3], and the relative spread [n] of luminance.

    The mean excludes outliers, whose luminance differs from the weighted median by more than max(3 MAD, 6 %).
    """
    order = np.argsort(-weights, axis=1, kind="stable")
    heavy = np.take_along_axis(weights.astype(np.float64), order, axis=1)
    colors = np.take_along_axis(colors, order[..., None], axis=1)
    light = (
        (colors[..., 0] * LUMINANCE[0] + colors[..., 1] * LUMINANCE[1]) + colors[..., 2] * LUMINANCE[2]
    ).astype(np.float64)
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
