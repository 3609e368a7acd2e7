"""Conversion of array arguments: numbers of the right shape, or an error that names the argument."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from .errors import Error, SettingsError

__all__ = ["Bools", "Floats", "floats", "ray_limits", "ray_pairs", "size_of", "whole"]

Floats = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]


def floats(
    name: str,
    value: npt.ArrayLike,
    *shapes: tuple[int | str, ...],
    error: type[Error] = SettingsError,
) -> Floats:
    """Returns `value` as a C-contiguous float64 array of one of `shapes`, in which a string stands for any length.

    Takes lists and arrays of any width, byte order and strides, and copies only if necessary. Raises `error` with the
    name, the given and the expected shape.
    """
    wanted = " or ".join("[" + ", ".join(map(str, shape)) + "]" for shape in shapes)
    try:
        array = np.asarray(value)
    except (TypeError, ValueError) as fault:
        raise error(f"{name} must be numbers {wanted}: {fault}") from None
    if array.dtype.kind not in "fiu" and array.size:
        raise error(f"{name} must be numbers {wanted}, not of dtype {array.dtype}")
    for shape in shapes:
        if len(shape) == array.ndim and all(
            isinstance(want, str) or want == got for want, got in zip(shape, array.shape, strict=True)
        ):
            return np.ascontiguousarray(array, dtype=np.float64).reshape(array.shape)
    raise error(f"{name} must have the shape {wanted}, not {list(array.shape)}")


def whole(name: str, value: object, low: int, high: int, *, error: type[Error] = SettingsError) -> int:
    """Returns `value` as an int from `low` to `high`, both included; raises `error` with the name."""
    if isinstance(value, bool) or not hasattr(value, "__index__"):
        raise error(f"{name} must be a whole number, not {value!r}")
    number = int(value.__index__())
    if not low <= number <= high:
        raise error(f"{name} is {number}, expected {low} to {high}")
    return number


def size_of(
    value: Sequence[int] | npt.NDArray[np.integer], *, error: type[Error] = SettingsError
) -> tuple[int, int]:
    """Returns `value` as (width, height) in pixels; raises `error` if `value` is no such pair."""
    try:
        width, height = value
    except (TypeError, ValueError):
        raise error(f"size must be (width, height) in pixels, not {value!r}") from None
    limit = (1 << 32) - 1  # what the core takes; its own limits are lower and say why
    return whole("width", width, 0, limit, error=error), whole("height", height, 0, limit, error=error)


def ray_pairs(origins: npt.ArrayLike, directions: npt.ArrayLike) -> tuple[Floats, Floats, tuple[int, ...]]:
    """Origins and directions, broadcast to two float64 arrays [n, 3], and the shape of the rays before."""
    pair = []
    for name, value in (("origins", origins), ("directions", directions)):
        array = np.asarray(value)
        if array.dtype.kind not in "fiu" or array.ndim == 0 or array.shape[-1] != 3:
            raise SettingsError(
                f"{name} must be numbers of the shape [..., 3], not {list(array.shape)} of dtype {array.dtype}"
            )
        pair.append(array)
    if pair[0].shape != pair[1].shape and 1 not in (pair[0].ndim, pair[1].ndim):
        raise SettingsError(
            f"origins {list(pair[0].shape)} and directions {list(pair[1].shape)} must have the same shape, "
            "or one of them [3]"
        )
    starts, ways = np.broadcast_arrays(*pair)
    shape = starts.shape[:-1]
    flat = [np.ascontiguousarray(array, dtype=np.float64).reshape(-1, 3) for array in (starts, ways)]
    return flat[0], flat[1], shape


def ray_limits(name: str, values: npt.ArrayLike, shape: tuple[int, ...]) -> Floats:
    """Limits of t of rays as a float64 array [1, 1] or [n, 1]; `shape` is that of the rays.

    Raises `SettingsError` for values that are neither one number nor one for each ray.
    """
    limits = np.asarray(values)
    if limits.dtype.kind not in "fiu" or limits.shape not in ((), shape):
        raise SettingsError(
            f"{name} must be a number or have the shape of the rays {list(shape)}, not {list(limits.shape)}"
        )
    return np.ascontiguousarray(limits, dtype=np.float64).reshape(-1, 1)


def product(a: npt.ArrayLike, b: npt.ArrayLike) -> Floats:
    """The matrix product of a [..., k] and b [k, m] or [k], without BLAS: the same to the last bit on every processor.

    Libraries of linear algebra add in another order on other processors, which files with promised bytes may not show.
    """
    left, right = np.asarray(a, float), np.asarray(b, float)
    total = np.zeros(left.shape[:-1] + right.shape[1:])
    for i in range(right.shape[0]):
        total += left[..., i, None] * right[i] if right.ndim == 2 else left[..., i] * right[i]
    return total


def lengths(vectors: npt.ArrayLike) -> Floats:
    """The lengths [...] of vectors [..., k], the same to the last bit on every processor."""
    squares = np.asarray(vectors, float) ** 2
    total = np.zeros(squares.shape[:-1])
    for i in range(squares.shape[-1]):
        total += squares[..., i]
    found: Floats = np.sqrt(total)
    return found
