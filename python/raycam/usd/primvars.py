"""Primvars of a prim, including the primvars of a point instancer.

A point instancer applies its primvars to its instances. Source: `UsdGeomPrimvarsAPI`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from pxr import Sdf, Usd, UsdGeom

from .faces import Faces

__all__ = ["Attribute", "InstanceValues", "Primvar", "find_primvar", "read_table"]


@dataclass(frozen=True, eq=False)
class InstanceValues:
    """The constant primvars at the root of an instance of a point instancer."""

    root: Sdf.Path
    """The path of the instance's prototype."""
    tables: dict[str, Any]
    """The instance's values of each primvar, by the primvar's name."""
    outer: InstanceValues | None = None
    """The instance that contains the point instancer."""

    @property
    def key(self) -> tuple[Any, ...]:
        """The key by which equal values are recognised."""
        rows = tuple((name, row.tobytes()) for name, row in sorted(self.tables.items()))
        return (self.root.pathString, rows, self.outer.key if self.outer else None)


@dataclass(frozen=True, eq=False)
class Attribute:
    """An attribute of a mesh: a table, and the table row for each face corner."""

    rows: Any
    index: Any

    def spread(self) -> Any:
        """Returns the value for each face corner."""
        return self.rows[self.index]


@dataclass(frozen=True, eq=False)
class Primvar:
    """The values of a primvar."""

    rows: Any
    """The table [k, width]; None for values of another type."""
    interpolation: str
    indices: Any = None
    """Indices into the table, for an indexed primvar."""
    of_instance: bool = False
    """True for a value that a point instancer applies to an instance."""

    @property
    def count(self) -> int:
        """The number of elements."""
        if self.indices is not None:
            return len(self.indices)
        return 0 if self.rows is None else len(self.rows)

    @property
    def constant(self) -> Any:
        """The row of a primvar with one element; None for other primvars."""
        if self.rows is None or self.count != 1:
            return None
        index = 0 if self.indices is None else int(self.indices[0])
        return self.rows[index] if 0 <= index < len(self.rows) else None

    def attach(self, faces: Faces) -> Attribute | None:
        """Returns the rows of the mesh's corners; None if the primvar does not fit the mesh.

        A primvar does not fit if the number of its elements is wrong, or if values or indices are invalid.
        """
        if self.rows is None or not np.isfinite(self.rows).all():
            return None
        element = _elements(self.interpolation, self.count, faces)
        if element is None:
            return None
        if self.indices is None:
            return Attribute(self.rows, element)
        if self.indices.min() < 0 or self.indices.max() >= len(self.rows):
            return None
        return Attribute(self.rows, self.indices[element])


def find_primvar(
    prim: Usd.Prim, name: str, width: int, time: Usd.TimeCode, instance: InstanceValues | None = None
) -> Primvar | None:
    """The primvar that applies to a prim, or None if it has no value.

    Inherited primvars are included. A primvar within the prototype takes precedence over a primvar of the point
    instancer.
    """
    own = UsdGeom.PrimvarsAPI(prim).FindPrimvarWithInheritance(name)
    scope = instance
    while scope is not None:
        if own and own.HasValue() and own.GetAttr().GetPrimPath().HasPrefix(scope.root):
            break
        if name in scope.tables:
            rows = np.asarray(scope.tables[name], float).reshape(1, -1)
            return Primvar(rows if rows.shape[1] == width else None, "constant", of_instance=True)
        scope = scope.outer
    if not own:
        return None
    value = own.Get(time)
    if value is None or (hasattr(value, "__len__") and not len(value)):
        return None
    indices = own.GetIndices(time) if own.IsIndexed() else None
    index_table = None if indices is None else np.array(indices, np.int64)
    if index_table is not None and not len(index_table):
        return None
    return Primvar(read_table(value, width), own.GetInterpolation(), index_table)


def read_table(values: Any, width: int) -> Any:
    """Values as numbers [n, width]; None for values of another type, and for an empty array."""
    try:
        table = np.array(values)
    except (TypeError, ValueError):
        return None
    if table.dtype.kind not in "fiu" or not table.size:
        return None
    if table.ndim == (0 if width == 1 else 1) and table.size == width:
        table = table.reshape(1, -1)  # the attribute is a single value instead of an array
    if width == 1:
        return table.reshape(-1, 1) if table.size == len(table) else None
    return table if table.ndim == 2 and table.shape[1] == width else None


def _elements(interpolation: str, count: int, faces: Faces) -> Any:
    """Returns the element of each corner; None if `interpolation` and `count` do not match.

    `count` is the number of elements.
    """
    corners = len(faces.indices)
    if interpolation == "constant" and count == 1:
        return np.zeros(corners, np.int64)
    if interpolation == "uniform" and count == len(faces.counts):
        return np.repeat(np.arange(count), faces.counts)
    if interpolation in ("vertex", "varying") and count > faces.indices.max():
        return faces.indices
    if interpolation == "faceVarying" and count == corners:
        return np.arange(corners)
    return None
