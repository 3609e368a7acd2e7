"""What a table of a world file describes to the last digit: cameras and rigs."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

__all__ = ["DictSerializable"]


class DictSerializable:
    """Compares, hashes and pickles as its description, the `to_dict` that its `from_dict` takes, with `up`."""

    __slots__ = ()

    def __eq__(self, other: object) -> bool:
        """Whether every number is the same."""
        if not isinstance(other, type(self)):
            return NotImplemented
        return self._key() == other._key()

    def __hash__(self) -> int:
        """Equal ones have equal hashes."""
        return hash(self._key())

    def _key(self) -> tuple[str, str]:
        described: Any = self
        return described._up, described._core.to_json()

    def __reduce__(self) -> tuple[Callable[..., Any], tuple[Any, ...]]:
        """Pickles as its description."""
        described: Any = self
        return _from_dict, (type(self), described.to_dict(), described.up)


def _from_dict(kind: Any, description: dict[str, Any], up: str) -> Any:
    return kind.from_dict(description, up=up)
