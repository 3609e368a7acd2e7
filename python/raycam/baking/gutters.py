"""Gutters: values extended beyond a texture's islands, so that mip maps do not mix in the background."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from ..arguments import Bools

__all__ = ["GUTTER", "fill_gutters"]

GUTTER = 8
"""Width of gutters in texels."""


def fill_gutters(values: npt.NDArray[Any], known: Bools, width: int = GUTTER) -> npt.NDArray[Any]:
    """Returns a copy of `values` [h, w, k] whose texels within `width` of a known texel have the mean of known
    neighbours.

    Integers are copied from one neighbour instead. The texture does not wrap around.
    """
    filled, done = values.copy(), known.copy()
    average = values.dtype.kind == "f"
    height, wide = known.shape
    for _ in range(width):
        total = np.zeros(values.shape, np.float64)
        count = np.zeros(known.shape, np.int64)
        for dy in (-1, 0, 1):
            for dx in (-1, 0, 1):
                if not (dy or dx):
                    continue
                to = (slice(max(0, -dy), height - max(0, dy)), slice(max(0, -dx), wide - max(0, dx)))
                of = (slice(max(0, dy), height - max(0, -dy)), slice(max(0, dx), wide - max(0, -dx)))
                take = done[of] if average else done[of] & (count[to] == 0)
                total[to] += np.where(take[..., None], filled[of], 0)
                count[to] += take
        new = ~done & (count > 0)
        if not new.any():
            break
        mean = total[new] / count[new][:, None]
        filled[new] = mean.astype(values.dtype)
        done |= new
    return filled
