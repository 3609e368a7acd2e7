"""Numbers by which faces are looked up."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

__all__ = ["face_keys"]


def face_keys(ids: npt.NDArray[np.int32]) -> npt.NDArray[np.int64]:
    """Returns a number [n] for each (instance, triangle) [n, 2].

    The numbers have the same order as the ids.
    """
    keys: npt.NDArray[np.int64] = (ids[:, 0].astype(np.int64) << 32) + ids[:, 1]
    return keys
