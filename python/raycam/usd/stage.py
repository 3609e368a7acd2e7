"""The prims of a stage that raycam shows: objects, lights and cameras."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from enum import Enum
from typing import Any

import numpy as np
from pxr import Gf, Tf, Usd, UsdGeom, UsdLux, UsdSkel, Vt

from .camera import camera_spec
from .handover import Handover
from .images import Images
from .instancers import Instances, PointInstancers, is_animated
from .lights import cylinder_light, light_spec
from .materials import Materials
from .meshes import GEOMETRY_TYPES, Appearance, Meshes
from .native_instances import InstanceGroups
from .notices import StageNotice
from .placement import Placement, is_solid
from .skinning import Skinning
from .unused import unused_of_camera, unused_of_light, unused_of_model
from .visibility import PrimVisibility

__all__ = ["StageReader", "rate_of"]

INTO_INSTANCES = Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)
"""Defined, active and loaded prims, including the prims of native instances."""

Entry = tuple[Usd.Prim, "Role"]
"""A prim that is read, and its role."""


class Role(Enum):
    """The kinds of prims that raycam distinguishes."""

    GEOMETRY = 1
    INSTANCER = 2
    CAMERA = 3
    LIGHT = 4
    UNSUPPORTED = 5
    """A prim type that other renderers show, but raycam does not."""
    NONE = 6
    INSTANCE = 7
    """A native instance, whose prims have roles of their own."""


@dataclass(frozen=True)
class ReadOptions:
    """Selects which parts of a stage are read."""

    time: float | None
    """The time in seconds; None for the first time."""
    merged: bool
    """True if all meshes become one object, without lights and cameras."""
    up: str | None
    """The up axis to which objects are turned; None for the file's up axis."""
    max_corners: int


class StageReader:
    """Reads a stage, and collects its objects, lights and cameras."""

    def __init__(self, stage: Usd.Stage, images: Images, options: ReadOptions) -> None:
        self.lights: list[dict[str, Any]] = []
        self.cameras: list[dict[str, Any]] = []
        self.moves = False
        self.stage = stage
        self.up = "y" if UsdGeom.GetStageUpAxis(stage) == UsdGeom.Tokens.y else "z"
        self.handover = Handover(options.max_corners, options.merged)
        self._own_notices: list[StageNotice] = []
        self._unused: list[StageNotice] = []
        self._skipped: Counter[str] = Counter()
        self._merged = options.merged
        self._images = images
        self._placement = Placement(options.up, self.up)
        self._time = Usd.TimeCode.EarliestTime()
        if options.time is not None:
            self._time = Usd.TimeCode(options.time * rate_of(stage))
        self._places = UsdGeom.XformCache(self._time)
        self._skinning = Skinning(stage, self._time, self._places)
        self.materials = Materials(images, self._time)
        self._meshes = Meshes(self.handover, self.materials, self._skinning, self._time)
        self._visibility = PrimVisibility(self._time)
        self._instancers = PointInstancers(
            self._meshes, self.handover, self._places, self._time, self._visibility.hidden_reason
        )
        self._roles: dict[tuple[str, ...], Role] = {}

    @property
    def has_lost(self) -> bool:
        """True if a prim was skipped, or if a prim caused a notice.

        Notices about materials and ignored properties are not counted.
        """
        return bool(self._meshes.notices or self._own_notices or self._skipped or self._instancers.notices)

    @property
    def notices(self) -> list[StageNotice]:
        """All notices, grouped by their source."""
        left_out = [
            StageNotice("ignored_element", f"{what} are not shown (number: {count})")
            for what, count in sorted(self._skipped.items())
        ]
        return [
            *self.materials.notices,
            *self._meshes.notices,
            *self._own_notices,
            *self._instancers.notices,
            *self._unused,
            *left_out,
        ]

    def read(self) -> None:
        """Reads all prims; prims that cannot be read are reported in notices."""
        entries = list(self._entries(Usd.PrimRange.Stage(self.stage, Usd.PrimDefaultPredicate)))
        groups = self._group_instances(entries)
        # Prims of each group of equal instances, by the number of the group's first instance.
        shared: dict[int, list[Entry]] = {}
        # Prims of each of the other instances, by the instance's number.
        expanded: dict[int, list[Entry]] = {}
        for numbers in groups:
            own = self._prims_of_instance(entries[numbers[0]][0])
            if len(numbers) > 1 and self._is_shareable(own):
                shared[numbers[0]] = own
            else:
                more = {number: self._prims_of_instance(entries[number][0]) for number in numbers[1:]}
                expanded |= {numbers[0]: own} | more
        every = [entries, *shared.values(), *expanded.values()]
        self._meshes.bind([prim for part in every for prim, role in part if role is Role.GEOMETRY])
        members = {numbers[0]: numbers for numbers in groups}
        for number, entry in enumerate(entries):
            if number in shared:
                instances = [entries[member][0] for member in members[number]]
                self._read_instances(np.array(members[number]), instances, shared[number])
            elif entry[1] is not Role.INSTANCE:
                self._attempt(self._read_prim, *entry, number)
            for prim, role in expanded.get(number, ()):
                self._attempt(self._read_prim, prim, role, number)
        self._placement.hand_over(self.handover)
        self.moves = self.moves or self._skinning.moves or self._instancers.moves

    def _entries(self, prims: Usd.PrimRange, inside: Usd.Prim | None = None) -> Iterator[Entry]:
        """Yields the prims that are read, with their roles.

        Prims in native instances are omitted, unless `inside`, the root of `prims`, is the instance that is
        read.
        """
        walk = iter(prims)
        for prim in walk:
            if inside is None and prim.IsInstance():
                yield prim, Role.INSTANCE
                continue
            role = self._role(prim)
            if role is Role.INSTANCER:
                walk.PruneChildren()  # prototypes are not objects themselves
            if role is not Role.NONE:
                yield prim, role
            else:
                self.moves = self.moves or is_animated(prim)
                self._report_unused(prim, unused_of_model(prim))

    def _prims_of_instance(self, instance: Usd.Prim) -> list[Entry]:
        return list(self._entries(Usd.PrimRange(instance, INTO_INSTANCES), instance))

    def _group_instances(self, entries: list[Entry]) -> list[list[int]]:
        """The numbers of native instances, in groups that differ only in their transforms."""
        groups: dict[Any, list[int]] = {}
        known = InstanceGroups(self._time)
        for number, (prim, role) in enumerate(entries):
            if role is Role.INSTANCE:
                groups.setdefault(known.key(prim), []).append(number)
        return list(groups.values())

    def _is_shareable(self, prims: list[Entry]) -> bool:
        """True for prims of an instance that become the same objects in each equal instance."""
        shared = (Role.GEOMETRY, Role.INSTANCER, Role.UNSUPPORTED)
        return all(role in shared and prim not in self._skinning for prim, role in prims)

    def _attempt(self, read: Callable[..., None], prim: Usd.Prim, *arguments: Any) -> None:
        """Reads a prim; an error becomes a notice."""
        try:
            read(prim, *arguments)
        except (ArithmeticError, LookupError, TypeError, ValueError, Tf.ErrorException) as error:
            lines = str(error).strip().splitlines()[-1:] or [type(error).__name__]
            self._note("ignored_element", prim, f"not shown: {lines[0]}")

    def _role(self, prim: Usd.Prim) -> Role:
        """The role of a prim, looked up once for each type."""
        kind = prim.GetTypeName()
        key = (kind, *prim.GetAppliedSchemas())
        if key not in self._roles:
            self._roles[key] = _find_role(prim)
        if self._roles[key] is Role.NONE and kind and not _is_known(kind):
            self._skipped[
                f"prims of type {kind}, which the installed version of Pixar's library does not support,"
            ] += 1
        return self._roles[key]

    def _note(self, code: str, prim: Usd.Prim, text: str) -> None:
        self._own_notices.append(StageNotice(code, text, f"{prim.GetTypeName() or 'prim'} {prim.GetPath()}"))

    def _report_unused(self, prim: Usd.Prim, words: list[str]) -> None:
        if words:
            subject = f"{prim.GetTypeName() or 'prim'} {prim.GetPath()}"
            self._unused.append(StageNotice("ignored_key", f"ignored: {'; '.join(words)}", subject))

    def _read_prim(self, prim: Usd.Prim, role: Role, number: int) -> None:
        if reason := self._visibility.hidden_reason(prim):
            self._count_hidden(prim, role, reason, 1)
            return
        self._report_unused(prim, unused_of_model(prim))
        from_local = self._places.GetLocalToWorldTransform(prim)
        self.moves = self.moves or is_animated(prim)
        if role is Role.GEOMETRY:
            self._read_geometry(prim, from_local, number)
        elif role is Role.INSTANCER:
            instances = self._instancers.expand(prim)
            instances.matrices = self._placement.turn(instances.matrices @ np.array(from_local))
            self._place(prim, np.full(len(instances.names), number), instances)
        elif role is Role.CAMERA:
            self.cameras.append(camera_spec(UsdGeom.Camera(prim), from_local, self._time))
            self._report_unused(prim, unused_of_camera(prim, self._time))
        elif role is Role.LIGHT:
            self._read_light(prim, from_local, number)
        else:
            self._skipped[f"{prim.GetTypeName()} prims"] += 1

    def _count_hidden(self, prim: Usd.Prim, role: Role, reason: str, count: int) -> None:
        if prim.IsA(UsdGeom.Gprim) or role is Role.INSTANCER:
            self._skipped["invisible prims" if reason == "invisible" else f"prims {reason}"] += count

    def _read_instances(self, numbers: Any, instances: list[Usd.Prim], prims: list[Entry]) -> None:
        """Reads equal native instances; `prims` are the prims of the first instance."""
        self.moves = self.moves or any(map(is_animated, instances))
        if unused_of_model(instances[0]):
            for instance in instances:
                self._report_unused(instance, unused_of_model(instance))
        places = [self._places.GetLocalToWorldTransform(instance) for instance in instances]
        worlds = np.array(Vt.Matrix4dArray(places))
        for prim, role in prims:
            self._attempt(self._read_shared, prim, role, numbers, instances, worlds)

    def _read_shared(
        self, prim: Usd.Prim, role: Role, numbers: Any, instances: list[Usd.Prim], worlds: Any
    ) -> None:
        """Reads a prim of the first instance, and its copies in the other instances.

        `worlds` contains the matrices [n, 4, 4] of the instances.
        """
        if reason := self._visibility.hidden_reason(prim):
            self._count_hidden(prim, role, reason, len(instances))
            return
        if prim != instances[0]:
            self._report_unused(prim, unused_of_model(prim))
        self.moves = self.moves or is_animated(prim)
        if role is Role.UNSUPPORTED:
            self._skipped[f"{prim.GetTypeName()} prims"] += len(instances)
            return
        inner, ignores_parents = Gf.Matrix4d(1), False
        if prim != instances[0]:
            inner, ignores_parents = self._places.ComputeRelativeTransform(prim, instances[0])
        base = np.broadcast_to(np.eye(4), worlds.shape) if ignores_parents else worlds
        matrices = self._placement.turn(np.array(inner) @ base)
        if role is Role.INSTANCER:
            own = self._instancers.expand(prim)
            count = len(own.names)
            placed = np.matmul(own.matrices[None], matrices[:, None]).reshape(-1, 4, 4)
            times = len(instances)
            repeated = Instances(own.names * times, own.meshes * times, own.materials * times, placed)
            self._place(prim, np.repeat(numbers, count), repeated)
            return
        solid = np.isfinite(matrices).all(axis=(1, 2))
        solid[solid] = is_solid(matrices[solid])
        path = prim.GetPath().MakeRelativePath(instances[0].GetPath())
        for place in np.flatnonzero(~solid).tolist():
            copy = self.stage.GetPrimAtPath(instances[place].GetPath().AppendPath(path))
            self._read_geometry(copy, self._places.GetLocalToWorldTransform(copy), int(numbers[place]))
        appearance = self._meshes.describe(prim) if solid.any() else None
        if appearance is not None:
            rows = np.flatnonzero(solid).tolist()
            is_root = prim == instances[0]
            names = [instances[row].GetName() if is_root else prim.GetName() for row in rows]
            meshes, materials = [appearance.mesh] * len(rows), [appearance.materials] * len(rows)
            objects = Instances(names, meshes, materials, matrices[solid])
            self._placement.add_many(numbers[solid], objects)

    def _read_geometry(self, prim: Usd.Prim, from_local: Gf.Matrix4d, number: int) -> None:
        matrix = self._placement.turn(from_local)
        if not np.isfinite(matrix).all():
            self._note("ignored_element", prim, "not shown: the prim's transform is not finite")
            return
        rank = 3 if is_solid(matrix[None])[0] else np.linalg.matrix_rank(matrix[:3, :3])
        if rank < 2:
            self._note(
                "ignored_element", prim, "not shown: the prim's transform has scale 0 along two axes or more"
            )
            return
        # A matrix of rank 2 has no inverse, so the points are written in world coordinates.
        appearance = self._meshes.describe(prim, baked=matrix.T if rank < 3 else None)
        if appearance is not None:
            self._placement.add(number, prim.GetName(), appearance, matrix if rank == 3 else np.eye(4))

    def _place(self, prim: Usd.Prim, numbers: Any, objects: Instances) -> None:
        """Adds objects of an instancer; objects with scale 0 are omitted, with a notice."""
        solid = is_solid(objects.matrices)
        if not solid.all():
            count = np.count_nonzero(~solid)
            self._note("ignored_element", prim, f"instances with scale 0 are not shown ({count})")
            kept = np.flatnonzero(solid)
            numbers, objects = numbers[kept], objects.take(kept)
        self._placement.add_many(numbers, objects)

    def _read_light(self, prim: Usd.Prim, from_local: Gf.Matrix4d, number: int) -> None:
        if prim.GetTypeName() == "CylinderLight" and not self._merged:
            mesh, radiance = cylinder_light(prim, from_local, self._time)
            material = self.materials.add_emitter(prim.GetName(), radiance)
            appearance = Appearance(self.handover.add_mesh(mesh), (material,), len(mesh.corners))
            self._placement.add(number, prim.GetName(), appearance, from_local)
            self._report_unused(prim, unused_of_light(prim, self._time))
            return
        light, text = light_spec(prim, from_local, self._images.environment, self.up, self._time)
        self.lights.extend([light] if light else [])
        if text:
            self._note("approximated_value" if light else "ignored_element", prim, text)
        self._report_unused(prim, unused_of_light(prim, self._time) if light else [])


def rate_of(stage: Usd.Stage) -> float:
    """The time codes per second; OpenUSD's default for a stage with 0 or less."""
    rate = float(stage.GetTimeCodesPerSecond())
    return rate if rate > 0 else 24.0


def _is_known(kind: str) -> bool:
    return bool(Usd.SchemaRegistry().FindConcretePrimDefinition(kind))


def _find_role(prim: Usd.Prim) -> Role:
    if prim.GetTypeName() in GEOMETRY_TYPES:
        return Role.GEOMETRY
    if prim.IsA(UsdGeom.PointInstancer):
        return Role.INSTANCER
    if prim.IsA(UsdGeom.Camera):
        return Role.CAMERA
    if prim.HasAPI(UsdLux.LightAPI):
        return Role.LIGHT
    # Skeletons and their roots have extents, but other renderers show only the meshes.
    is_drawn = prim.IsA(UsdGeom.Boundable) and not (prim.IsA(UsdSkel.Root) or prim.IsA(UsdSkel.Skeleton))
    return Role.UNSUPPORTED if is_drawn else Role.NONE
