"""Equality, hashing and pickling of cameras and rigs, based on their exact descriptions."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

__all__ = ["DictSerializable"]


class DictSerializable:
    """Base class for objects that are compared, hashed and pickled by their dict and up axis.

    Subclasses define `to_dict()` and `from_dict(description, up=up)`, which restores an equal object.
    """

    __slots__ = ()

    def __eq__(self, other: object) -> bool:
        """True if both objects have the same type and all their numbers are equal."""
        if not isinstance(other, type(self)):
            return NotImplemented
        return self._key() == other._key()

    def __hash__(self) -> int:
        """Hash of the description: equal objects have equal hashes."""
        return hash(self._key())

    def _key(self) -> tuple[str, str]:
        described: Any = self
        return described._up, described._core.to_json()

    def __reduce__(self) -> tuple[Callable[..., Any], tuple[Any, ...]]:
        """Pickles the description, so that pickles do not hold the Rust object."""
        described: Any = self
        return _from_dict, (type(self), described.to_dict(), described.up)


def _from_dict(kind: Any, description: dict[str, Any], up: str) -> Any:
    return kind.from_dict(description, up=up)
