"""Read-only arrays, lists and dicts.

An attempt to change them raises an error that names the method with which the described object can be changed.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any, NoReturn, TypeVar

import numpy as np
import numpy.typing as npt

from .arguments import Floats
from .errors import Error, WorldError, nearest

__all__ = ["ReadOnlyArray", "ReadOnlyDict", "ReadOnlyList", "read_only_array"]

Item = TypeVar("Item")
Key = TypeVar("Key")


def _read_only_error(owner: Any) -> Error:
    """The error of a read-only list, dict or array, with its remedy."""
    error: Error = owner.error(owner.remedy, code="read_only")
    return error


def _refuse_change(name: str) -> Callable[..., NoReturn]:
    """Returns a method that raises the table's error with its remedy."""

    def refuse(table: Any, *_: Any, **__: Any) -> NoReturn:
        raise _read_only_error(table)

    refuse.__name__ = name
    refuse.__doc__ = "Raises an error that names the method for changes."
    return refuse


class ReadOnlyList(list[Item]):
    """A read-only list, which is copied, compared and pickled as a plain list."""

    def __init__(self, items: Iterable[Item], remedy: str, error: type[Error] = WorldError) -> None:
        super().__init__(items)
        self.remedy, self.error = remedy, error

    def __reduce__(self) -> Any:
        """Pickles and copies the list as a plain list."""
        return list, (list(self),)

    append = extend = insert = pop = remove = clear = sort = reverse = _refuse_change("change")
    __setitem__ = __delitem__ = __iadd__ = __imul__ = _refuse_change("assign")


class ReadOnlyDict(dict[Key, Item]):
    """A read-only dict, which is copied, compared and pickled as a plain dict."""

    def __init__(self, items: Mapping[Key, Item], remedy: str, error: type[Error] = WorldError) -> None:
        super().__init__(items)
        self.remedy, self.error = remedy, error

    def __missing__(self, key: object) -> Any:
        """Raises `KeyError` with the existing names."""
        raise KeyError(nearest("name", key, [str(name) for name in self]))

    def __reduce__(self) -> Any:
        """Pickles and copies the dict as a plain dict."""
        return dict, (dict(self),)

    pop = popitem = clear = update = setdefault = _refuse_change("change")
    __setitem__ = __delitem__ = __ior__ = _refuse_change("assign")


def _check_first(name: str) -> Callable[..., Any]:
    """Returns the method `name` of arrays, with a check for read-only arrays.

    For a read-only array, the method raises the array's error.
    """
    method = getattr(np.ndarray, name)

    def checked(array: Any, *arguments: Any, **keywords: Any) -> Any:
        if not array.flags.writeable:
            raise _read_only_error(array)
        return method(array, *arguments, **keywords)

    checked.__name__ = name
    checked.__doc__ = (
        f"Raises an error that names the method for changes if the array is read-only; see `{name}`."
    )
    return checked


class ReadOnlyArray(np.ndarray[Any, np.dtype[np.float64]]):
    """A read-only array, whose views are read-only, too.

    Copies and results of calculations are plain arrays.
    """

    remedy: str = ""
    error: type[Error] = WorldError

    def __array_finalize__(self, source: Any) -> None:
        """Passes the error to views."""
        self.remedy = getattr(source, "remedy", "")
        self.error = getattr(source, "error", WorldError)

    def __array_wrap__(self, array: Any, context: Any = None, return_scalar: bool = False) -> Any:
        """Returns results of calculations as plain arrays and numbers."""
        plain = np.asarray(array)
        return plain[()] if return_scalar or plain.ndim == 0 else plain

    def copy(self, order: Any = "C") -> Any:
        """Returns a plain array, which can be changed."""
        return np.array(self, order=order)

    def __copy__(self) -> Any:
        """Returns a plain array, which can be changed."""
        return np.array(self)

    def __deepcopy__(self, memo: Any) -> Any:
        """Returns a plain array, which can be changed."""
        return np.array(self)

    def __reduce__(self) -> Any:
        """Pickles the values as a plain array."""
        return np.array(self).__reduce__()

    def __repr__(self) -> str:
        """The text of a plain array."""
        return repr(np.asarray(self))


for _name in (
    *("__setitem__", "__iadd__", "__isub__", "__imul__", "__itruediv__", "__ifloordiv__", "__imod__"),
    *("__ipow__", "__imatmul__", "fill", "sort", "partition", "put"),
):
    setattr(ReadOnlyArray, _name, _check_first(_name))


def read_only_array(values: npt.ArrayLike, remedy: str, error: type[Error]) -> Floats:
    """Returns a read-only float64 array of the values.

    An attempt to change the array raises `error` with the `remedy`.
    """
    array = np.array(values, dtype=np.float64).view(ReadOnlyArray)
    array.remedy, array.error = remedy, error
    array.flags.writeable = False
    return array
