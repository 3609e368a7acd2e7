"""Vectors of Open3D's older meshes: plain arrays."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from .absent import raise_missing

__all__ = ["Vector2dVector", "Vector2iVector", "Vector3dVector", "Vector3iVector"]


def Vector3dVector(values: npt.ArrayLike = ()) -> npt.NDArray[np.float64]:
    """Points as float64 [n, 3]."""
    return np.array(values, dtype=np.float64).reshape(-1, 3)


def Vector3iVector(values: npt.ArrayLike = ()) -> npt.NDArray[np.int32]:
    """Indices as int32 [n, 3]."""
    return np.array(values, dtype=np.int32).reshape(-1, 3)


def Vector2dVector(values: npt.ArrayLike = ()) -> npt.NDArray[np.float64]:
    """Texture coordinates as float64 [n, 2]."""
    return np.array(values, dtype=np.float64).reshape(-1, 2)


def Vector2iVector(values: npt.ArrayLike = ()) -> npt.NDArray[np.int32]:
    """Indices as int32 [n, 2]."""
    return np.array(values, dtype=np.int32).reshape(-1, 2)


def __getattr__(name: str) -> Any:
    """Raises an `AttributeError` that names an alternative."""
    return raise_missing("open3d.utility", name, "use NumPy arrays, or Python's logging")
