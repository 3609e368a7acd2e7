"""Attributes whose values are converted on assignment, as in pyrender."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

__all__ = ["Converted", "LiveArray", "number", "text", "truth"]


class Converted:
    """An attribute that stores assigned values after conversion by a function."""

    def __init__(self, convert: Callable[[Any], Any]) -> None:
        self._convert = convert

    def __set_name__(self, owner: type, name: str) -> None:
        """Stores the value under the name with an underscore."""
        self._name = "_" + name

    def __get__(self, holder: Any, owner: type | None = None) -> Any:
        """Returns the value, or the attribute itself for the class."""
        return self if holder is None else getattr(holder, self._name)

    def __set__(self, holder: Any, value: Any) -> None:
        """Converts the value and keeps it."""
        before = holder.__dict__.get(self._name, self)
        setattr(holder, self._name, self._convert(value))
        check = getattr(holder, "_check_values", None)
        if check is None:
            return
        try:
            check()
        except ValueError:
            if before is not self:
                setattr(holder, self._name, before)
            raise


class LiveArray(np.ndarray[Any, Any]):
    """An array whose elements can be assigned, also through its views.

    `write` receives the whole changed array, and may raise `ValueError`. Changes that `write` would not notice, such as
    `fill`, raise NumPy's error for read-only arrays.
    """

    _write: Callable[[npt.NDArray[Any]], None] | None
    _whole: LiveArray | None

    def __new__(cls, values: npt.ArrayLike, write: Callable[[npt.NDArray[Any]], None]) -> LiveArray:
        """Returns a float64 copy of the values."""
        memory = np.array(values, dtype=np.float64)
        array = memory.view(cls)
        array._write, array._whole = write, array
        array.flags.writeable = False
        return array

    def __array_finalize__(self, whole: Any) -> None:
        """Connects views with their whole array; results of arithmetic are not connected."""
        self._write = None
        self._whole = getattr(whole, "_whole", None)

    def __setitem__(self, key: Any, value: Any) -> None:
        """Assigns elements in this array and at the source.

        If the values are invalid, the assignment raises `ValueError` and has no effect.
        """
        whole = self._whole
        if whole is None or whole._write is None or not np.may_share_memory(self, whole):
            super().__setitem__(key, value)
            return
        before = np.array(whole)
        try:
            whole.flags.writeable = self.flags.writeable = True
            super().__setitem__(key, value)
            whole._write(np.array(whole))
        except ValueError:
            np.copyto(whole, before)
            raise
        finally:
            whole.flags.writeable = self.flags.writeable = False


def _assign_in_place(name: str) -> Any:
    """Returns an in-place operator, such as `+=`, that assigns the elements of a `LiveArray`."""
    operator = getattr(np.ndarray, name)

    def assign(self: LiveArray, other: Any) -> LiveArray:
        self[...] = operator(np.array(self), other)
        return self

    return assign


for _name in ("iadd", "isub", "imul", "itruediv", "ifloordiv", "imod", "ipow"):
    setattr(LiveArray, f"__{_name}__", _assign_in_place(f"__{_name}__"))


def text(value: Any) -> str | None:
    """Converts an object's name to a string; None is unchanged."""
    return None if value is None else str(value)


def number(
    name: str,
    low: float = -float("inf"),
    high: float = float("inf"),
    *,
    above: bool = False,
    optional: bool = False,
    default: float | None = None,
) -> Callable[[Any], float | None]:
    """Returns a function that converts a value to a float and checks its range.

    The function raises `ValueError` for NaN, and for a number outside `low` (excluded if `above`) to `high`. For
    None, it returns `default`, if given. Without a default, it returns None if `optional`, and raises `TypeError`
    otherwise.
    """

    def convert(value: Any) -> float | None:
        if value is None and (optional or default is not None):
            return default
        if value is None:
            raise TypeError(f"{name} is None: expected a number")
        given = float(value)
        if not (low < given if above else low <= given) or not given <= high:
            most = "" if high == float("inf") else f" and at most {high:g}"
            least = (
                " other than NaN"
                if low == -float("inf")
                else f" {'above' if above else 'of at least'} {low:g}"
            )
            raise ValueError(f"{name} is {value}: expected a number{least}{most}")
        return given

    return convert


def truth(name: str) -> Callable[[Any], bool]:
    """Returns a conversion that accepts True and False, and raises `TypeError` otherwise."""

    def convert(value: Any) -> bool:
        if not isinstance(value, bool):
            raise TypeError(f"{name} is {value!r}: expected True or False")
        return value

    return convert
