"""Checks of the arguments of `RaycastingScene`: shapes and dtypes.

Errors are `RuntimeError`s, as in Open3D.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from raycam import SettingsError

__all__ = ["RaycastingError", "array_of", "last", "looking", "matrix", "pixel_count", "rows", "thread_count"]

Array = npt.NDArray[Any]


class RaycastingError(SettingsError, RuntimeError):
    """Invalid triangles, rays or points.

    The error is a `RuntimeError`, as in Open3D, and a `raycam.SettingsError`.
    """


def array_of(name: str, values: Any) -> Array:
    """Returns an array, list or tensor of Open3D as an array."""
    if not isinstance(values, np.ndarray) and callable(getattr(values, "numpy", None)):
        values = values.cpu().numpy() if hasattr(values, "cpu") else values.numpy()
    try:
        return np.asarray(values).view(np.ndarray)
    except ValueError:
        raise RaycastingError(f"{name} must be an array, but its rows have different lengths") from None


def last(name: str, values: Any, width: int) -> Array:
    """Returns `values` as an array [..., `width`]; raises `RaycastingError` for other shapes."""
    array = array_of(name, values)
    if array.ndim == 0 or array.shape[-1] != width or array.dtype.kind not in "fiu":
        raise RaycastingError(
            f"{name} must be numbers of the shape [..., {width}], not {list(array.shape)} of dtype {array.dtype}"
        )
    return array


def rows(name: str, values: Any, kinds: str) -> Array:
    """Returns the argument called `name` as an array [n, 3]; an empty array may have any shape.

    `values` is an array or a tensor. `kinds` contains the accepted kinds of dtype (`numpy.dtype.kind`): "fiu" for
    numbers, "iu" for integers. Raises `RaycastingError` for another shape or kind.
    """
    array = array_of(name, values)
    if array.size == 0 and array.ndim:
        return np.zeros((0, 3), dtype=array.dtype if array.dtype.kind in kinds else np.int64)
    if array.ndim != 2 or array.shape[1] != 3 or array.dtype.kind not in kinds:
        expected = "numbers" if "f" in kinds else "whole numbers (uint32, int64)"
        raise RaycastingError(
            f"{name} must be {expected} of the shape [n, 3], not {list(array.shape)} of dtype {array.dtype}"
        )
    return array


def matrix(name: str, values: Any, size: int) -> Array:
    """Returns an invertible matrix [size, size] as float64; else raises `RaycastingError`."""
    array = array_of(name, values)
    if array.shape != (size, size) or array.dtype.kind not in "fiu":
        raise RaycastingError(
            f"{name} must be numbers of the shape [{size}, {size}], not {list(array.shape)} of dtype {array.dtype}"
        )
    array = array.astype(np.float64)
    if not np.isfinite(array).all() or np.linalg.matrix_rank(array) < size:
        raise RaycastingError(f"{name} must be finite and have an inverse, not {array.tolist()}")
    return array


def pixel_count(name: str, value: Any) -> int:
    """Returns a number of pixels; raises `RaycastingError` unless it is an integer above 0."""
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < 1:
        raise RaycastingError(f"{name} is {value!r}, expected a whole number of pixels, at least 1")
    return int(value)


def thread_count(value: Any) -> int:
    """Returns a number of threads; 0 means all threads."""
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < 0:
        raise RaycastingError(f"nthreads is {value!r}, expected a whole number (0: all threads)")
    return int(value)


def looking(given: dict[str, Any], width: int, height: int) -> tuple[Array, Array, Array]:
    """The intrinsic matrix, rotation and position of a camera that looks at a point."""
    center, eye, up = (
        last(name, given[name], 3).astype(np.float64).reshape(-1) for name in ("center", "eye", "up")
    )
    angle = float(given["fov_deg"])
    if not 0.0 < angle < 180.0:
        raise RaycastingError(f"fov_deg is {given['fov_deg']!r}, expected degrees between 0 and 180")
    ahead = center - eye
    right = np.cross(up, ahead)
    if any(len(vector) != 3 for vector in (center, eye, up)) or not np.linalg.norm(right) > 0.0:
        raise RaycastingError(
            f"center {center.tolist()}, eye {eye.tolist()}, up {up.tolist()}: expected three numbers each, a center "
            "that differs from eye, and an up that is not parallel to the viewing direction"
        )
    forward = ahead / np.linalg.norm(ahead)
    right /= np.linalg.norm(right)
    focal = width / 2 / np.tan(np.radians(angle) / 2)
    intrinsic = np.array([[focal, 0, width / 2], [0, focal, height / 2], [0, 0, 1]])
    return intrinsic, np.stack([right, np.cross(forward, right), forward]), eye
