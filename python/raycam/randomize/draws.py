"""Random values in descriptions.

A value is a function of the seed, the world's number and the key's path. A draw is a table with a key of
`DISTRIBUTIONS` instead of a value. Random numbers are hashes instead of a sequence, so a value does not depend on other
draws or on the number of worlds.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from ..arguments import as_number
from ..errors import WorldError, nearest

__all__ = ["DISTRIBUTIONS", "ONE_OF", "RandomStream", "RejectedSample"]

ONE_OF = "one_of"
"""The key whose value is a list of tables; one of them is merged into the enclosing table."""
DIGITS = 12
"""Significant digits of computed numbers, because mathematical libraries differ in the last of 16 digits."""


class RejectedSample(WorldError):
    """Raised if an object has no space or a camera has no view in a sample.

    The sample is then drawn again.
    """


class RandomStream:
    """Random numbers that are a function of `seed` and a path of names."""

    def __init__(self, seed: int, *way: object) -> None:
        self.seed = seed
        """The seed of all worlds."""
        self.way = way
        """The stream's path, for example the world's number, the table's name and the key."""

    def substream(self, *way: object) -> RandomStream:
        """Returns the stream for a longer path."""
        return RandomStream(self.seed, *self.way, *way)

    def bits(self, number: int = 0) -> int:
        """Returns the `number`-th 64 random bits of the stream."""
        text = "/".join(str(name) for name in (self.seed, *self.way, number))
        return int.from_bytes(hashlib.sha256(text.encode()).digest()[:8], "little")

    def uniform01(self, number: int = 0) -> float:
        """Returns a uniform number in [0, 1) with 53 random bits."""
        return (self.bits(number) >> 11) / (1 << 53)

    def uniform(self, low: float, high: float, number: int = 0) -> float:
        """Returns a uniform number in [low, high)."""
        return low + (high - low) * self.uniform01(number)

    def integer(self, low: int, high: int, number: int = 0) -> int:
        """Returns a uniform whole number from `low` to `high`, both included."""
        return low + self.bits(number) % (high - low + 1)

    def value(self, description: Any, where: str = "") -> Any:
        """Replaces every draw in a description by a value, recursively.

        Raises `WorldError`, with the key, for invalid draws.
        """
        if isinstance(description, Mapping):
            if len(description) == 1 and (kind := next(iter(description))) in DISTRIBUTIONS:
                try:
                    drawn = DISTRIBUTIONS[kind](self, description[kind])
                except (TypeError, ValueError, IndexError) as fault:
                    raise WorldError(
                        f"{where}: {kind} = {description[kind]!r}: {fault}", code="invalid_value"
                    ) from None
                return self.substream(kind).value(drawn, where)
            table = dict(description)
            if ONE_OF in table:
                lists = table.pop(ONE_OF)
                if not isinstance(lists, list | tuple) or not all(isinstance(one, Mapping) for one in lists):
                    raise WorldError(
                        f"{where}: {ONE_OF} must be a list of tables, not {lists!r}", code="wrong_type"
                    )
                if not lists:
                    raise WorldError(f"{where}: {ONE_OF} is an empty list", code="missing_value")
                place = self.substream(ONE_OF)
                lent = dict(lists[place.integer(0, len(lists) - 1)])
                if twice := sorted(lent.keys() & table.keys()):
                    raise WorldError(
                        f"{where}: {', '.join(twice)}: given both inside and outside {ONE_OF}",
                        code="duplicate_name",
                    )
                table |= lent
            return {
                key: self.substream(key).value(value, f"{where}.{key}".lstrip("."))
                for key, value in table.items()
            }
        if isinstance(description, list | tuple):
            return [self.substream(i).value(value, f"{where}[{i}]") for i, value in enumerate(description)]
        return description


def _uniform(draw: RandomStream, given: Any) -> Any:
    """A uniform random number, or a list of independent random numbers."""
    return _each(given, lambda low, high, i: draw.uniform(low, high, i))


def _log_uniform(draw: RandomStream, given: Any) -> Any:
    """A log-uniform number above 0; the numbers of a list have a common factor."""

    def one(low: float, high: float, _: int) -> float:
        if low <= 0.0:
            raise ValueError("expected numbers above 0")
        return rounded(low * math.exp(draw.uniform01() * math.log(high / low)))

    return _each(given, one)


def _each(given: Any, draw: Callable[[float, float, int], float]) -> Any:
    low, high = _pair(given)
    if not isinstance(low, Sequence):
        return draw(*_numbers(low, high), 0)
    if not isinstance(high, Sequence) or len(low) != len(high):
        raise ValueError("expected two lists of the same length")
    return [draw(*_numbers(a, b), i) for i, (a, b) in enumerate(zip(low, high, strict=True))]


def _integer(draw: RandomStream, given: Any) -> int:
    """A uniform whole number, both ends included."""
    low, high = _pair(given)
    low, high = as_number(low), as_number(high)
    if not isinstance(low, int) or not isinstance(high, int) or low > high:
        raise ValueError("expected two whole numbers, the smaller first")
    return draw.integer(low, high)


def _choice(draw: RandomStream, given: Any) -> Any:
    """A random item of a list."""
    if not isinstance(given, list | tuple) or not given:
        raise ValueError("expected a list of values to choose from")
    return given[draw.integer(0, len(given) - 1)]


DISTRIBUTIONS: dict[str, Callable[[RandomStream, Any], Any]] = {
    "uniform": _uniform,
    "log_uniform": _log_uniform,
    "integer": _integer,
    "choice": _choice,
}
"""The distributions by key."""


def range_of(name: str, value: Any, default: tuple[float, float]) -> tuple[float, float]:
    """Parses a range [low, high]; a single number is both its ends, and None is `default`."""
    if value is None:
        return default
    try:
        return _numbers(*(_pair(value) if as_number(value) is None else (value, value)))
    except (TypeError, ValueError) as fault:
        raise WorldError(f"{name} = {value!r}: {fault}", code="invalid_value") from None


def check_known_keys(what: str, table: Mapping[str, Any], known: Sequence[str]) -> None:
    """Raises `WorldError` with the nearest name for an unknown key."""
    for key in table:
        if key not in known:
            raise WorldError(nearest(f"key of {what}", key, list(known)), code="unknown_key")


def rounded(value: float) -> float:
    """Rounds a computed number to `DIGITS` significant digits."""
    return float(f"{value:.{DIGITS}g}")


def _pair(given: Any) -> tuple[Any, Any]:
    if not isinstance(given, list | tuple) or len(given) != 2:
        raise ValueError("expected two values, [low, high]")
    return given[0], given[1]


def _numbers(low: Any, high: Any) -> tuple[float, float]:
    first, second = _finite(low), _finite(high)
    if first > second:
        raise ValueError("expected the smaller number first")
    return first, second


def _finite(value: Any) -> float:
    number = as_number(value)
    if number is None or not math.isfinite(number):
        raise ValueError(f"expected finite numbers, not {value!r}")
    return float(number)
