"""Tables of a world that say how to change the world where someone assigns to them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any, NoReturn, TypeVar

import numpy as np

from ..arguments import Floats
from ..errors import WorldError

__all__ = ["ReadOnlyDict", "ReadOnlyList", "ReadOnlyMatrix", "matrix_of"]

Item = TypeVar("Item")
Key = TypeVar("Key")


def _refuses(name: str) -> Callable[..., NoReturn]:
    """A method that raises `WorldError` with the way to change the world."""

    def refuse(table: Any, *_: Any, **__: Any) -> NoReturn:
        raise WorldError(table.way)

    refuse.__name__ = name
    refuse.__doc__ = "Raises `WorldError` with the way to change the world."
    return refuse


class ReadOnlyList(list[Item]):
    """A list that is read-only; it copies, compares and pickles as a plain one."""

    def __init__(self, items: Iterable[Item], way: str) -> None:
        super().__init__(items)
        self.way = way

    def __reduce__(self) -> Any:
        """Pickles and copies it as a plain list."""
        return list, (list(self),)

    append = extend = insert = pop = remove = clear = sort = reverse = _refuses("change")
    __setitem__ = __delitem__ = __iadd__ = __imul__ = _refuses("assign")


class ReadOnlyDict(dict[Key, Item]):
    """A dict that is read-only; it copies, compares and pickles as a plain one."""

    def __init__(self, items: Mapping[Key, Item], way: str) -> None:
        super().__init__(items)
        self.way = way

    def __reduce__(self) -> Any:
        """Pickles and copies it as a plain dict."""
        return dict, (dict(self),)

    pop = popitem = clear = update = setdefault = _refuses("change")
    __setitem__ = __delitem__ = __ior__ = _refuses("assign")


class ReadOnlyMatrix(np.ndarray[Any, np.dtype[np.float64]]):
    """A matrix of an object, which says how to change the object where someone assigns to it."""

    name: str = ""

    @classmethod
    def read_only(cls, rows: Any, name: str) -> ReadOnlyMatrix:
        """The matrix of the object of this name."""
        matrix = np.array(rows, dtype=np.float64).view(cls)
        matrix.name = name
        matrix.flags.writeable = False
        return matrix

    def __array_finalize__(self, source: Any) -> None:
        """Passes the name on to parts of it."""
        self.name = getattr(source, "name", "")

    def _check(self) -> None:
        if not self.flags.writeable:
            raise WorldError(
                f"objects are read-only: world.set_object({self.name!r}, matrix=...), or change a copy, matrix.copy()"
            )

    def __setitem__(self, key: Any, value: Any) -> None:
        """Assigns to a copy; raises `WorldError` for the object's own."""
        self._check()
        super().__setitem__(key, value)

    def __iadd__(self, other: Any) -> Any:  # type: ignore[misc]
        """Adds to a copy."""
        self._check()
        return super().__iadd__(other)

    def __isub__(self, other: Any) -> Any:  # type: ignore[misc]
        """Subtracts from a copy."""
        self._check()
        return super().__isub__(other)

    def __imul__(self, other: Any) -> Any:  # type: ignore[misc]
        """Multiplies a copy."""
        self._check()
        return super().__imul__(other)

    def __reduce__(self) -> Any:
        """Pickles it as a plain array."""
        return np.array, (np.array(self).tolist(),)


def matrix_of(rows: Any, name: str) -> Floats:
    """The read-only matrix [4, 4] of the object of this name."""
    return ReadOnlyMatrix.read_only(rows, name)
