"""Groups of native instances that differ only in their transforms.

Source: OpenUSD's "Scenegraph Instancing".

Everything that instances of the same prototype inherit (primvars, materials, visibility, purpose) is a property of the
instance's prim or of a prim above it.
"""

from __future__ import annotations

from collections.abc import Hashable
from typing import Any

from pxr import Sdf, Usd

__all__ = ["InstanceGroups"]


class InstanceGroups:
    """Recognises instances that look the same at the given time."""

    def __init__(self, time: Usd.TimeCode) -> None:
        self._time = time
        self._numbers: dict[Hashable, int] = {}
        self._states: dict[Usd.Prim, int | None] = {}

    def key(self, prim: Usd.Prim) -> Hashable:
        """A value that two instances share only if they look the same, apart from their transforms."""
        state = self._state(prim)
        return prim.GetPath() if state is None else (prim.GetPrototype(), state)

    def _state(self, prim: Usd.Prim) -> int | None:
        """Returns a number for all properties of a prim and its parents.

        The result is None if a property may treat instances differently.
        """
        parent = prim.GetParent()
        if parent and parent not in self._states:
            self._states[parent] = self._state(parent)
        above = self._states[parent] if parent else 0
        names = [name for name in prim.GetAuthoredPropertyNames() if not name.startswith("xformOp")]
        if not names or above is None:
            return above
        if any(name.startswith("material:binding:collection") for name in names):
            return None  # a collection can contain some of the instances
        own = (above, *(self._describe(prim.GetProperty(name)) for name in names))
        return self._numbers.setdefault(own, len(self._numbers) + 1)

    def _describe(self, own: Any) -> Hashable:
        """The value of a property, with the metadata that change its meaning."""
        if isinstance(own, Usd.Relationship):
            targets: tuple[Sdf.Path, ...] = tuple(own.GetTargets())
            return (own.GetName(), targets, own.GetMetadata("bindMaterialAs"))
        value = repr(own.Get(self._time))
        return (own.GetName(), value, own.GetMetadata("interpolation"))
