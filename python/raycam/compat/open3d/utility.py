"""Vectors of Open3D's older meshes: plain arrays."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

__all__ = ["Vector3dVector", "Vector3iVector"]


def Vector3dVector(values: npt.ArrayLike = ()) -> npt.NDArray[np.float64]:
    """Points as float64 [n, 3]."""
    return np.array(values, dtype=np.float64).reshape(-1, 3)


def Vector3iVector(values: npt.ArrayLike = ()) -> npt.NDArray[np.int32]:
    """Indices as int32 [n, 3]."""
    return np.array(values, dtype=np.int32).reshape(-1, 3)
