"""Selection of objects by number or name."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from .. import _core
from ..arguments import Bools, as_number
from ..errors import WorldError, nearest
from ..one_line import counted

__all__ = ["Chosen", "object_mask", "object_number", "one_object"]

MAX_NUMBER = (1 << 31) - 1
"""The largest number that an object may have."""
Chosen = int | str | Iterable[int | str]
"""One or several objects, given by numbers or names."""


def object_mask(core: _core.World, objects: Chosen | None, exclude: Chosen | None = None) -> Bools | None:
    """Returns a mask of the objects in `objects` that are not in `exclude`.

    `objects` may be None for all objects of the world. The result is None if both arguments are None, which selects all
    objects. A name selects every object of that name. Raises `WorldError` for unknown objects.
    """
    if objects is None and exclude is None:
        return None
    names = [parts[0] for parts in core.objects]
    mask = np.full(len(names), objects is None)
    for chosen, flag in ((objects, True), (exclude, False)):
        if chosen is not None:
            mask[_numbers(names, chosen)] = flag
    return mask


def object_number(core: _core.World, which: int | str) -> int:
    """Returns one object's number.

    Raises `WorldError` for an unknown object and for a name of several objects.
    """
    found = _numbers([parts[0] for parts in core.objects], which)
    if len(found) != 1:
        raise WorldError(
            f"{len(found)} objects have the name {which!r} (numbers {found}); use a number",
            code="duplicate_name",
        )
    return found[0]


def one_object(which: object) -> int | str:
    """Returns a single object's number or name; raises `WorldError` for other values."""
    if isinstance(which, str):
        return which
    number = as_number(which)
    if not isinstance(number, int):
        raise WorldError(f"expected an object index or name, got {which!r}", code="wrong_type")
    if abs(number) > MAX_NUMBER:
        raise WorldError(
            f"object index {number} is out of range; the limit is {MAX_NUMBER}", code="index_out_of_range"
        )
    return number


def _numbers(names: list[str], chosen: Chosen) -> list[int]:
    alone = isinstance(chosen, str) or not isinstance(chosen, Iterable) or getattr(chosen, "ndim", 1) == 0
    several: Iterable[Any] = [chosen] if alone else chosen  # type: ignore[assignment]
    found: list[int] = []
    for which in several:
        if isinstance(which, str):
            named = [number for number, name in enumerate(names) if name == which]
            if not named:
                raise WorldError(nearest("object", which, sorted(set(names))), code="unknown_name")
            found += named
        else:
            number = one_object(which)
            if isinstance(number, str) or not 0 <= number < len(names):
                raise WorldError(
                    f"object {number} does not exist; the world has {counted(len(names), 'object')}, numbered from 0",
                    code="index_out_of_range",
                )
            found.append(number)
    return found
