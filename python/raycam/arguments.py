"""Checks of arguments that raise errors with the argument's name.

The checks cover arrays, numbers, flags, words and sizes.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from .errors import Error, SettingsError, nearest

__all__ = [
    "Bools",
    "Floats",
    "as_number",
    "flag",
    "floats",
    "is_tensor",
    "limits",
    "numbers",
    "one_of",
    "paired",
    "plain_numbers",
    "real",
    "refuse_mask",
    "rows_of",
    "several",
    "size_of",
    "thread_count",
    "triples",
    "whole",
    "wholes",
    "word",
    "words",
]

Floats = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]


def floats(
    name: str,
    value: npt.ArrayLike,
    *shapes: tuple[int | str, ...],
    error: type[Error] = SettingsError,
) -> Floats:
    """Returns `value` as a C-contiguous float64 array of one of `shapes`.

    A string in a shape means any length. Accepts lists and arrays of integers or floats of any size, byte order and
    strides, and copies only if necessary. Raises `error` with the name, the given and the expected shape.
    """
    wanted = " or ".join("[" + ", ".join(map(str, shape)) + "]" for shape in shapes)
    refuse_mask(name, value, error)
    try:
        array = numbers(name, value, error) if is_tensor(value) else np.asarray(value)
    except (TypeError, ValueError) as fault:
        if isinstance(fault, error):
            raise
        raise error(f"{name} must be numbers {wanted}: {fault}", code="wrong_type") from None
    if array.dtype.kind not in "fiu" and array.size:
        raise error(f"{name} must be numbers {wanted}, not of dtype {array.dtype}", code="wrong_type")
    for shape in shapes:
        if len(shape) == array.ndim and all(
            isinstance(want, str) or want == got for want, got in zip(shape, array.shape, strict=True)
        ):
            return np.ascontiguousarray(array, dtype=np.float64).reshape(array.shape)
    raise error(f"{name} must have the shape {wanted}, not {list(array.shape)}", code="wrong_shape")


def is_tensor(value: object) -> bool:
    """Returns True for other libraries' arrays.

    Such an array is an object with `__array__` or `__dlpack__` that does not belong to NumPy.
    """
    if isinstance(value, np.ndarray | np.generic):
        return False
    return hasattr(value, "__array__") or hasattr(value, "__dlpack__")


def numbers(name: str, value: object, error: type[Error] = SettingsError) -> npt.NDArray[Any]:
    """Returns `value` as an array of numbers.

    Accepts NumPy arrays (not copied), lists, and objects with `__array__` or DLPack. Raises `error` with the
    name for tensors that are not in CPU memory, tensors that require a gradient, and values that are not
    numbers.
    """
    if type(value) is np.ndarray and value.dtype.kind in "fiu":
        return value
    if not hasattr(value, "__array__") and hasattr(value, "__dlpack__"):
        value = _from_dlpack(name, value, error)
    elif getattr(value, "requires_grad", False):
        raise error(
            f"{name} requires a gradient, which raycam does not compute; pass {name}.detach()",
            code="wrong_type",
        )
    elif (place := _device_of(value)) is not None:
        raise error(f"{name} is on {place}; raycam requires CPU memory, pass {name}.cpu()", code="wrong_type")
    refuse_mask(name, value, error)
    try:
        array = np.asarray(value)
    except (TypeError, ValueError) as fault:
        raise error(f"{name} must be numbers: {fault}", code="wrong_type") from None
    if array.dtype.kind not in "fiu" and array.size:
        raise error(f"{name} must be numbers, not of dtype {array.dtype}", code="wrong_type")
    return array


def refuse_mask(name: str, value: object, error: type[Error] = SettingsError) -> None:
    """Raises `error` for a masked array with masked values, because the mask would be ignored."""
    if isinstance(value, np.ma.MaskedArray) and np.ma.is_masked(value):
        count = np.count_nonzero(value.mask)
        raise error(
            f"{name} has {count} masked values; omit these rows or fill them ({name}.filled(...))",
            code="wrong_type",
        )


def _device_of(value: object) -> str | None:
    """Returns the device of a tensor that is not in CPU memory, as text."""
    device = getattr(value, "device", None)
    place = str(device).lower()
    return (
        None if device is None or callable(device) or place.startswith(("cpu", "taichi_cpu")) else str(device)
    )


def _from_dlpack(name: str, value: object, error: type[Error]) -> npt.NDArray[Any]:
    """Returns the data of a DLPack producer as an array."""
    cpu_device = 1  # kDLCPU in DLPack
    describe = getattr(value, "__dlpack_device__", None)
    kind = describe()[0] if describe is not None else cpu_device
    if kind != cpu_device:
        raise error(
            f"{name} is on DLPack device type {int(kind)}; raycam requires CPU memory, so copy {name} to the CPU",
            code="wrong_type",
        )
    try:
        return np.from_dlpack(value)  # type: ignore[arg-type]
    except (BufferError, RuntimeError, TypeError) as fault:
        raise error(f"{name} must be numbers in CPU memory: {fault}", code="wrong_type") from None


def triples(name: str, value: object) -> npt.NDArray[Any]:
    """Returns `value` as an array of numbers [..., 3].

    Arrays keep their dtype and are not copied.
    """
    array = numbers(name, value)
    if array.ndim == 0 or array.shape[-1] != 3:
        raise SettingsError(
            f"{name} must be numbers of the shape [..., 3], not {list(array.shape)} of dtype {array.dtype}",
            code="wrong_shape",
        )
    return array


def paired(
    first: tuple[str, npt.NDArray[Any]], second: tuple[str, npt.NDArray[Any]]
) -> tuple[npt.NDArray[Any], npt.NDArray[Any]]:
    """Returns two arrays [..., 3], broadcast to one shape as views.

    Raises `SettingsError` with both names and shapes if the arrays do not broadcast.
    """
    if first[1].shape == second[1].shape:
        return first[1], second[1]
    try:
        left, right = np.broadcast_arrays(first[1], second[1])
    except ValueError:
        shapes = [f"{name} {list(array.shape)}" for name, array in (first, second)]
        raise SettingsError(
            f"{shapes[0]} and {shapes[1]} must have the same shape, or shapes that broadcast",
            code="wrong_shape",
        ) from None
    return left, right


def rows_of(array: npt.NDArray[Any]) -> Floats:
    """Returns an array [..., 3] as C-contiguous float64 [n, 3]."""
    rows = np.ascontiguousarray(array, dtype=np.float64)
    return rows if rows.ndim == 2 else rows.reshape(-1, 3)


def limits(name: str, values: object, shape: tuple[int, ...]) -> Floats:
    """Returns `values`, one number or one number for each ray or point, as float64 [1] or [n].

    `shape` is the shape of the rays or points. Raises `SettingsError` for values that do not broadcast to `shape`.
    """
    if isinstance(values, float):
        return np.array([values])
    array = numbers(name, values)
    if array.ndim == 0:
        return np.full(1, array, dtype=np.float64)
    try:
        spread = np.broadcast_to(array, shape)
    except ValueError:
        raise SettingsError(
            f"{name} must be a number or broadcast to the shape {list(shape)}, not {list(array.shape)}",
            code="wrong_shape",
        ) from None
    return np.ascontiguousarray(spread, dtype=np.float64).reshape(-1)


def product(a: npt.ArrayLike, b: npt.ArrayLike) -> Floats:
    """Returns the matrix product of a [..., k] and b [k, m] or [k], computed without BLAS.

    The product is bit-identical on every processor. BLAS libraries use different orders of summation on
    different processors, but some files must have the same bytes everywhere.
    """
    left, right = np.asarray(a, float), np.asarray(b, float)
    total = np.zeros(left.shape[:-1] + right.shape[1:])
    for i in range(right.shape[0]):
        total += left[..., i, None] * right[i] if right.ndim == 2 else left[..., i] * right[i]
    return total


def inverse_3x3(matrix: npt.ArrayLike) -> Floats:
    """Returns the inverse of a regular matrix [3, 3], bit-identical on every processor."""
    columns = np.asarray(matrix, float).T
    rows = np.stack(
        [np.cross(columns[1], columns[2]), np.cross(columns[2], columns[0]), np.cross(columns[0], columns[1])]
    )
    found: Floats = rows / (columns[0] * rows[0]).sum()
    return found


def lengths(vectors: npt.ArrayLike) -> Floats:
    """Returns the lengths [...] of vectors [..., k], bit-identical on every processor."""
    squares = np.asarray(vectors, float) ** 2
    total = np.zeros(squares.shape[:-1])
    for i in range(squares.shape[-1]):
        total += squares[..., i]
    found: Floats = np.sqrt(total)
    return found


def as_number(value: object) -> int | float | None:
    """Returns a real number as a Python int or float, or None for any other value.

    Numbers are the scalars of Python, NumPy and other libraries, and their arrays and tensors of shape ().
    Booleans, strings, complex numbers, dates, masked values and arrays with axes are not numbers.
    """
    if type(value) in (int, float):
        return value  # type: ignore[return-value]
    if isinstance(value, bool | str | bytes) or np.ma.is_masked(value):
        return None
    if isinstance(value, np.ndarray | np.generic) and value.dtype.kind not in "fiu":
        return None
    if getattr(value, "shape", ()) != () or str(getattr(value, "dtype", "")).endswith("bool"):
        return None
    converts: tuple[Callable[[Any], int | float], ...] = (operator.index, float)
    for convert in converts:
        try:
            return convert(value)
        except (TypeError, ValueError, OverflowError):
            continue
    return None


def plain_numbers(value: Any) -> Any:
    """Returns a copy of nested mappings, lists and tuples with all scalars as Python numbers."""
    if isinstance(value, Mapping):
        return {plain_numbers(key): plain_numbers(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        items = map(plain_numbers, value)
        return list(items) if isinstance(value, list) else tuple(items)
    number = as_number(value)
    return value if number is None else number


MAX_COUNT = 2**31 - 1
"""The largest whole number of an argument that has no limit of its own."""


def whole(
    name: str, value: object, low: int, high: int = MAX_COUNT, *, error: type[Error] = SettingsError
) -> int:
    """Returns `value` as an int from `low` to `high`, both included.

    Raises `error` with the name for other values.
    """
    number = as_number(value)
    if not isinstance(number, int):
        raise error(f"{name} must be a whole number, not {value!r}", code="wrong_type")
    if not low <= number <= high:
        wanted = f"{low} or more" if number < low and high == MAX_COUNT else f"{low} to {high}"
        raise error(f"{name} is {number}, expected {wanted}", code="out_of_range")
    return number


def several(name: str, values: object, what: str, *, error: type[Error] = SettingsError) -> list[Any]:
    """Returns a sequence's items as a list.

    For a number or string, raises `error` with the name and `what`, which describes the items, such as "cameras".
    """
    try:
        if isinstance(values, str | bytes):
            raise TypeError
        return list(values)  # type: ignore[call-overload, no-any-return]
    except TypeError:
        raise error(f"{name} must be a list of {what}, not {values!r}", code="wrong_type") from None


def wholes(
    name: str,
    values: object,
    low: int,
    high: int,
    *,
    count: int | None = None,
    error: type[Error] = SettingsError,
) -> list[int]:
    """Returns `values` as `count` ints from `low` to `high`.

    If `count` is None, any number of ints is accepted. Raises `error` with the name for other values.
    """
    found = several(name, values, "whole numbers", error=error)
    if count is not None and len(found) != count:
        raise error(f"{name} must be {count} whole numbers, not {values!r}", code="wrong_shape")
    return [whole(name, value, low, high, error=error) for value in found]


def real(
    name: str,
    value: object,
    low: float = -math.inf,
    high: float = math.inf,
    *,
    above: bool = False,
    what: str = "a number",
    error: type[Error] = SettingsError,
) -> float:
    """Returns `value` as a finite float from `low` (excluded if `above`) to `high` (included).

    Raises `error` with the name for other values. `what` describes the value and its unit.
    """
    given = as_number(value)
    try:
        number = None if given is None else float(given)
    except OverflowError:
        number = None
    if number is None:
        raise error(f"{name} must be {what}, not {value!r}", code="wrong_type")
    if math.isfinite(number) and (low < number if above else low <= number) and number <= high:
        return number
    least = f"more than {low:g}" if above else f"{low:g} or more"
    limits = {(False, False): "finite", (True, False): least, (False, True): f"{high:g} or less"}
    both = f"more than {low:g}, at most {high:g}" if above else f"{low:g} to {high:g}"
    wanted = limits.get((math.isfinite(low), math.isfinite(high)), both)
    raise error(f"{name} is {number}, expected {what}, {wanted}", code="out_of_range")


def flag(name: str, value: object, *, error: type[Error] = SettingsError) -> bool:
    """Returns `value` as a bool; raises `error` with the name for anything but True and False."""
    if isinstance(value, bool | np.bool_):
        return bool(value)
    raise error(f"{name} must be True or False, not {value!r}", code="wrong_type")


def word(name: str, value: object, *, error: type[Error] = SettingsError) -> str:
    """Returns `value` if it is a str; otherwise raises `error` with the argument's name."""
    if isinstance(value, str):
        return value
    raise error(f"{name} must be a string, not {value!r}", code="wrong_type")


def one_of(name: str, given: object, valid: Sequence[str], *, error: type[Error] = SettingsError) -> str:
    """Returns `given` if `valid` contains this word.

    Otherwise raises `error` with the most similar valid word.
    """
    if isinstance(given, str) and given in valid:
        return given
    raise error(nearest(name, given, list(valid)), code="unknown_name")


def words(
    name: str,
    given: object,
    valid: Iterable[str],
    *,
    also: Callable[[str], bool] = lambda word: False,
    error: type[Error] = SettingsError,
) -> list[str]:
    """Returns the given word or words as a list without duplicates.

    Words in `valid`, and words for which `also` returns True, are accepted. Raises `error` with the most similar word
    in `valid` for other words.
    """
    each = [given] if isinstance(given, str) else several(name, given, "words", error=error)
    known = list(valid)

    def check(one: object) -> str:
        return one if isinstance(one, str) and also(one) else one_of(name, one, known, error=error)

    return list(dict.fromkeys([check(one) for one in each]))


def thread_count(threads: object) -> int | None:
    """Returns `threads` as an int from 1 to 1024, or None; otherwise raises `SettingsError`."""
    return None if threads is None else whole("threads", threads, 1, 1024)


def size_of(
    value: Sequence[int] | npt.NDArray[np.integer], *, error: type[Error] = SettingsError
) -> tuple[int, int]:
    """Returns `value` as (width, height) in pixels.

    Raises `error` if `value` is not such a pair.
    """
    try:
        width, height = value
    except (TypeError, ValueError):
        raise error(f"size must be (width, height) in pixels, not {value!r}", code="wrong_type") from None
    # The largest integer that the core accepts. The core's limits for sizes are lower, and the core reports them.
    limit = (1 << 32) - 1
    return whole("width", width, 0, limit, error=error), whole("height", height, 0, limit, error=error)
