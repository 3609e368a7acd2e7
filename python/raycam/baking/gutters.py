"""Gutters: values extended beyond a texture's islands.

With gutters, mip maps do not mix in the background.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from ..arguments import Bools

__all__ = ["GUTTER", "fill_gutters"]

GUTTER = 8
"""Width of gutters in texels."""


def fill_gutters(values: npt.NDArray[Any], known: Bools, width: int = GUTTER) -> npt.NDArray[Any]:
    """Returns a copy of `values` [h, w, k] with `width` texels filled around the known texels.

    Texels are filled outwards, step by step, with the mean of the neighbours that already have a value. Integers are
    copied from one neighbour instead. The texture does not wrap around.
    """
    height, wide = known.shape
    rows = values.reshape(height * wide, -1).copy()
    average = values.dtype.kind == "f"
    done = np.zeros((height + 2, wide + 2), bool)
    done[1:-1, 1:-1] = known
    steps = [(dy, dx) for dy in (-1, 0, 1) for dx in (-1, 0, 1) if dy or dx]
    for _ in range(width):
        near = np.zeros((height, wide), bool)
        for dy, dx in steps:
            near |= done[1 + dy : 1 + dy + height, 1 + dx : 1 + dx + wide]
        y, x = np.nonzero(near & ~done[1:-1, 1:-1])
        if not len(y):
            break
        total, count = np.zeros((len(y), rows.shape[1])), np.zeros(len(y), np.int64)
        for dy, dx in steps:
            take = done[1 + y + dy, 1 + x + dx]
            if not average:
                take &= count == 0
            place = (y[take] + dy) * wide + x[take] + dx
            total[take] += rows[place]
            count[take] += 1
        rows[y * wide + x] = (total / count[:, None]).astype(values.dtype)
        done[1 + y, 1 + x] = True
    return rows.reshape(values.shape)
