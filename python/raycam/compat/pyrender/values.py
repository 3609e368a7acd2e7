"""Attributes whose values are converted when they are assigned, as those of pyrender are."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

__all__ = ["Converted", "number", "text", "truth"]


class Converted:
    """An attribute that holds what a function makes of the values that are assigned to it."""

    def __init__(self, convert: Callable[[Any], Any]) -> None:
        self._convert = convert

    def __set_name__(self, owner: type, name: str) -> None:
        """Keeps the value under the name with an underscore."""
        self._name = "_" + name

    def __get__(self, holder: Any, owner: type | None = None) -> Any:
        """The value; of the class, the attribute itself."""
        return self if holder is None else getattr(holder, self._name)

    def __set__(self, holder: Any, value: Any) -> None:
        """Converts the value and keeps it."""
        setattr(holder, self._name, self._convert(value))


def text(value: Any) -> str | None:
    """The name of something, None for none."""
    return None if value is None else str(value)


def number(
    name: str, low: float, high: float = float("inf"), *, above: bool = False, default: float | None = None
) -> Callable[[Any], float | None]:
    """The conversion to a float from `low` (more than that if `above`) to `high`, which raises `ValueError`.

    None becomes the default.
    """

    def convert(value: Any) -> float | None:
        if value is None:
            return default
        given = float(value)
        if not (low < given if above else low <= given) or not given <= high:
            most = "" if high == float("inf") else f" and at most {high:g}"
            raise ValueError(
                f"{name} is {value}: expected a number {'above' if above else 'of at least'} {low:g}{most}"
            )
        return given

    return convert


def truth(name: str) -> Callable[[Any], bool]:
    """The conversion of True and False, which raises `TypeError` for anything else."""

    def convert(value: Any) -> bool:
        if not isinstance(value, bool):
            raise TypeError(f"{name} is {value!r}: expected True or False")
        return value

    return convert
