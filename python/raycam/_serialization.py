"""Equality, hashes and pickles of cameras and rigs by their exact description."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

__all__ = ["DictSerializable"]


class DictSerializable:
    """Base of classes that `from_dict` restores from `to_dict()` and `up`, which equality, hash and pickle use."""

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
