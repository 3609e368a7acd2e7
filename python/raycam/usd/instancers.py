"""Point instancers of USD, expanded with arrays. Source: the schema `UsdGeomPointInstancer`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from pxr import Usd, UsdGeom, UsdLux

from .handover import MAX_OBJECTS, Handover
from .meshes import GEOMETRY_TYPES, Appearance, Meshes
from .notices import StageNotice
from .primvars import InstanceValues, read_table

__all__ = ["Instances", "PointInstancers", "interleave", "is_animated"]

IN_PROTOTYPE = Usd.TraverseInstanceProxies(
    Usd.PrimIsActive & Usd.PrimIsLoaded & Usd.PrimHasDefiningSpecifier & ~Usd.PrimIsAbstract
)
"""Prims of a prototype that are shown, as in Storm: the prototype may be below an `over`."""

MAX_DEPTH = 16
"""Maximum depth of nested point instancers."""

INSTANCE_PRIMVARS = {"displayColor", "displayOpacity"}
"""Primvars of instances whose values are applied to all instances at once."""


@dataclass
class Instances:
    """Objects of instances, in the order of the instances."""

    names: list[str] = field(default_factory=list)
    meshes: list[int] = field(default_factory=list)
    materials: list[tuple[int, ...]] = field(default_factory=list)
    matrices: Any = field(default_factory=lambda: np.zeros((0, 4, 4)))
    """Matrices [n, 4, 4] for row vectors, relative to the instancer or to the world."""

    def take(self, rows: Any) -> Instances:
        """The objects with these indices [k], in their order."""
        places = rows.tolist()
        return Instances(
            [self.names[place] for place in places],
            [self.meshes[place] for place in places],
            [self.materials[place] for place in places],
            self.matrices[rows],
        )


class PointInstancers:
    """The point instancers of a stage at a time."""

    def __init__(
        self,
        meshes: Meshes,
        handover: Handover,
        places: UsdGeom.XformCache,
        time: Usd.TimeCode,
        hidden: Callable[[Usd.Prim, Usd.Prim], str | None],
    ) -> None:
        self.notices: list[StageNotice] = []
        self.moves = False
        """True if any instance or prototype has several time samples."""
        self._meshes = meshes
        self._handover = handover
        self._places = places
        self._time = time
        self._hidden = hidden

    def expand(self, prim: Usd.Prim, outer: InstanceValues | None = None, depth: int = 0) -> Instances:
        """The objects of all instances that are shown."""
        if depth > MAX_DEPTH:
            self._note("ignored_element", prim, f"more than {MAX_DEPTH} nested point instancers")
            return Instances()
        source = UsdGeom.PointInstancer(prim)
        which, matrices, numbers = self._shown_instances(source)
        pieces: list[tuple[Any, Instances]] = []
        targets = source.GetPrototypesRel().GetForwardedTargets()
        self._note_missing(prim, which, targets)
        for index, path in enumerate(targets):
            chosen = np.flatnonzero(which == index)
            if len(chosen):
                root = prim.GetStage().GetPrimAtPath(path)
                pieces.extend(self._expand_prototype(source, root, chosen, matrices, numbers, outer, depth))
        return interleave(pieces)

    def _note(self, code: str, prim: Usd.Prim, text: str) -> None:
        self.notices.append(StageNotice(code, text, f"{prim.GetTypeName() or 'prim'} {prim.GetPath()}"))

    def _shown_instances(self, source: UsdGeom.PointInstancer) -> tuple[Any, Any, Any]:
        """The prototype, matrix and number of each instance that is not masked."""
        prim = source.GetPrim()
        which = np.array(source.GetProtoIndicesAttr().Get(self._time) or [], np.int64)
        options = UsdGeom.PointInstancer
        time = self._time_of_transforms(source)
        transforms = source.ComputeInstanceTransformsAtTime(
            time, time, options.ExcludeProtoXform, options.IgnoreMask
        )
        matrices = np.array(transforms, float).reshape(-1, 4, 4)
        positions = len(source.GetPositionsAttr().Get(self._time) or [])
        if positions and not len(which):
            self._note(
                "ignored_element",
                prim,
                f"{positions} instances are not shown: protoIndices is missing or empty",
            )
        if len(which) and len(matrices) != len(which):
            self._note(
                "ignored_element",
                prim,
                f"all {len(which)} instances are not shown: positions has {positions} values, and all arrays must have"
                " the same length as protoIndices",
            )
            which = which[:0]
        shown = np.array(source.ComputeMaskAtTime(self._time) or [], bool)
        shown = shown if len(shown) == len(which) else np.ones(len(which), bool)
        if hidden := np.count_nonzero(~shown):
            self._note("hidden_part", prim, f"inactive or invisible instances are not shown ({hidden})")
        finite = np.isfinite(matrices[: len(which)]).all(axis=(1, 2))
        if bad := np.count_nonzero(shown & ~finite):
            self._note(
                "ignored_element",
                prim,
                f"instances with transforms that are not finite are not shown ({bad})",
            )
        numbers = np.flatnonzero(shown & finite)
        return which[numbers], matrices[numbers], numbers

    def _time_of_transforms(self, source: UsdGeom.PointInstancer) -> Usd.TimeCode:
        """The time at which the instances' transforms are computed.

        OpenUSD extrapolates velocities from the first sample. The earliest of all times is too far away for that, so
        the time of the first sample is used instead.
        """
        if self._time != Usd.TimeCode.EarliestTime():
            return self._time
        attributes = [source.GetPositionsAttr(), source.GetOrientationsAttr(), source.GetOrientationsfAttr()]
        samples = [attribute.GetTimeSamples()[:1] for attribute in attributes]
        first = [time for times in samples for time in times]
        return Usd.TimeCode(min(first)) if first else self._time

    def _note_missing(self, prim: Usd.Prim, which: Any, targets: list[Any]) -> None:
        """Reports instances whose prototype does not exist or contains nothing visible."""
        for index in np.unique(which).tolist():
            count = np.count_nonzero(which == index)
            if not 0 <= index < len(targets):
                reason = f"protoIndices has the value {index}, but there are {len(targets)} prototypes"
            elif not (root := prim.GetStage().GetPrimAtPath(targets[index])):
                reason = f"prototype {targets[index]} does not exist"
            elif not root.IsActive():
                reason = f"prototype {targets[index]} is inactive"
            elif not any(True for _ in Usd.PrimRange(root, IN_PROTOTYPE)):
                reason = f"prototype {targets[index]} is not defined: it is an over, a class, or not loaded"
            else:
                continue
            self._note("ignored_element", prim, f"instances are not shown ({count}): {reason}")

    def _expand_prototype(
        self,
        source: UsdGeom.PointInstancer,
        root: Usd.Prim,
        chosen: Any,
        matrices: Any,
        numbers: Any,
        outer: InstanceValues | None,
        depth: int,
    ) -> list[tuple[Any, Instances]]:
        """The objects of the chosen instances of one prototype, for each of its prims."""
        if not root:
            return []
        name = source.GetPrim().GetName()
        values = self._instance_values(source, numbers[chosen])
        pieces: list[tuple[Any, Instances]] = []
        walk = iter(Usd.PrimRange(root, IN_PROTOTYPE))
        for prim in walk:
            self.moves = self.moves or is_animated(prim)
            is_instancer = prim.IsA(UsdGeom.PointInstancer)
            if is_instancer:
                walk.PruneChildren()
            if prim.HasAPI(UsdLux.LightAPI) or prim.IsA(UsdGeom.Camera):
                self._note("ignored_feature", prim, "lights and cameras within prototypes are not supported")
                continue
            if not (is_instancer or prim.IsA(UsdGeom.Gprim)):
                continue
            if reason := self._hidden(prim, root):
                self._note("hidden_part", prim, f"not shown: {reason}")
                continue
            if not is_instancer and prim.GetTypeName() not in GEOMETRY_TYPES:
                self._note("ignored_feature", prim, "prims of this type are not supported")
                continue
            in_root, _ = self._places.ComputeRelativeTransform(prim, root.GetParent())
            own = np.array(in_root)
            for rows, instance in self._group_instances(root, values, len(chosen), outer, prim):
                placed = own @ matrices[chosen[rows]]
                if is_instancer:
                    inner = self.expand(prim, instance, depth + 1)
                    pieces.extend(self._repeat(inner, name, numbers[chosen[rows]], placed))
                elif appearance := self._meshes.describe(prim, instance=instance):
                    materials = self._instance_materials(appearance, values, rows)
                    names = [f"{name}.{number}" for number in numbers[chosen[rows]]]
                    meshes = [appearance.mesh] * len(rows)
                    pieces.append((numbers[chosen[rows]], Instances(names, meshes, materials, placed)))
        return pieces

    def _instance_values(self, source: UsdGeom.PointInstancer, numbers: Any) -> dict[str, Any]:
        """The rows [n, width] of the instancer's primvars, for each of these instances."""
        values = {}
        count = len(source.GetProtoIndicesAttr().Get(self._time) or [])
        for primvar in UsdGeom.PrimvarsAPI(source).GetPrimvarsWithValues():
            name, value = primvar.GetPrimvarName(), primvar.ComputeFlattened(self._time)
            width = (
                1 if value is None or not len(value) or not hasattr(value[0], "__len__") else len(value[0])
            )
            table = None if isinstance(value, str) else read_table(value, width)
            if table is None or name in ("normals",):
                continue
            if len(table) == 1 and primvar.GetInterpolation() in ("constant", "uniform"):
                values[name] = np.repeat(table, len(numbers), axis=0)
            elif primvar.GetInterpolation() in ("vertex", "varying", "faceVarying") and len(table) >= count:
                values[name] = table[numbers]
            else:
                self._note(
                    "ignored_key",
                    source.GetPrim(),
                    f"primvar {name} is ignored: {len(table)} values do not fit {count} instances",
                )
        return values

    def _group_instances(
        self, root: Usd.Prim, values: dict[str, Any], count: int, outer: InstanceValues | None, prim: Usd.Prim
    ) -> list[tuple[Any, InstanceValues | None]]:
        """Returns groups of instances for which a prim looks the same, with their primvars.

        A plain colour may differ within a group.
        """
        path = root.GetPath()
        if not values:
            return [(np.arange(count), InstanceValues(path, {}, outer) if outer else None)]
        names = list(values)
        if not prim.IsA(UsdGeom.PointInstancer):
            scope = InstanceValues(path, {name: table[0] for name, table in values.items()}, outer)
            appearance = self._meshes.describe(prim, instance=scope)
            names = [name for name in names if appearance and name in appearance.instance_inputs]
            is_plain = appearance is not None and appearance.color is not None
            if not names or (is_plain and INSTANCE_PRIMVARS.issuperset(names)):
                return [(np.arange(count), scope)]
        joined = np.hstack([np.ascontiguousarray(values[name], float) for name in names])
        _, firsts, groups = np.unique(joined, axis=0, return_index=True, return_inverse=True)
        groups = groups.reshape(-1)
        order = np.argsort(groups, kind="stable")
        parts = np.split(order, np.flatnonzero(np.diff(groups[order])) + 1)
        return [
            (rows, InstanceValues(path, {name: values[name][at] for name in names}, outer))
            for rows, at in zip(parts, firsts, strict=True)
        ]

    def _instance_materials(
        self, appearance: Appearance, values: dict[str, Any], rows: Any
    ) -> list[tuple[int, ...]]:
        """The materials of each instance; a plain material uses the instance's colour and opacity."""
        names = appearance.instance_inputs & values.keys()
        if appearance.color is None or not names:
            return [appearance.materials] * len(rows)
        table = np.tile(np.array(appearance.color, np.float32), (len(rows), 1))
        if "displayColor" in names:
            table[:, :3] = np.clip(values["displayColor"][rows], 0, 1)
        if "displayOpacity" in names:
            table[:, 3] = np.round(np.clip(values["displayOpacity"][rows].ravel(), 0, 1), 6)
        return [(number,) for number in self._handover.add_plains(table).tolist()]

    def _repeat(self, inner: Instances, name: str, numbers: Any, placed: Any) -> list[tuple[Any, Instances]]:
        """The objects of a nested instancer for each instance of the outer instancer."""
        count = len(inner.names)
        if not count:
            return []
        if count * len(numbers) > MAX_OBJECTS:
            raise MemoryError
        matrices = np.matmul(inner.matrices[None], placed[:, None]).reshape(-1, 4, 4)
        names = [f"{name}.{number}.{part}" for number in numbers for part in inner.names]
        repeated = Instances(names, inner.meshes * len(numbers), inner.materials * len(numbers), matrices)
        return [(np.repeat(numbers, count), repeated)]


def is_animated(prim: Usd.Prim) -> bool:
    """True for a prim with more than one time sample of its transform, shape or visibility."""
    if not prim.IsA(UsdGeom.Xformable):
        return False
    if UsdGeom.Xformable(prim).TransformMightBeTimeVarying():
        return True
    names = ("points", "visibility", "positions", "orientations", "scales")
    return any(prim.GetAttribute(name).ValueMightBeTimeVarying() for name in names if prim.HasAttribute(name))


def interleave(pieces: list[tuple[Any, Instances]]) -> Instances:
    """Joins pieces of objects, sorted by number; equal numbers keep their order."""
    if not pieces:
        return Instances()
    if len(pieces) == 1:
        return pieces[0][1]
    order = np.argsort(np.concatenate([numbers for numbers, _ in pieces]), kind="stable")
    joined = Instances(matrices=np.concatenate([own.matrices for _, own in pieces]))
    for own in (own for _, own in pieces):
        joined.names.extend(own.names)
        joined.meshes.extend(own.meshes)
        joined.materials.extend(own.materials)
    return joined.take(order)
