"""The prims of a stage that raycam shows: objects, lights and cameras."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from enum import Enum
from typing import Any

import numpy as np
from pxr import Gf, Tf, Usd, UsdGeom, UsdLux

from .camera import camera_spec
from .handover import Handover
from .images import Images
from .instancers import PointInstancers, is_animated, matrices_of
from .lights import cylinder_light, light_spec
from .materials import Materials
from .meshes import GEOMETRY_TYPES, Appearance, Meshes
from .notices import StageNotice
from .skinning import Skinning
from .unused import unused_of_camera, unused_of_light, unused_of_model
from .visibility import PrimVisibility

__all__ = ["StageReader", "rate_of"]


class Role(Enum):
    """The kinds of prims that raycam distinguishes."""

    GEOMETRY = 1
    INSTANCER = 2
    CAMERA = 3
    LIGHT = 4
    UNSUPPORTED = 5
    """A prim type that other renderers show."""
    NONE = 6


@dataclass(frozen=True)
class ReadOptions:
    """Selects which parts of a stage are read."""

    time: float | None
    """The time in seconds; None for the first time."""
    merged: bool
    """True if all meshes become one object, without lights and cameras."""
    up: str | None
    """The up axis to which objects are turned; None for that of the file."""
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
        self._turn = np.eye(4)
        if options.up is not None and options.up != self.up:
            # A quarter turn about x.
            sine = 1.0 if options.up == "z" else -1.0
            self._turn[1:3, 1:3] = [[0.0, -sine], [sine, 0.0]]
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
        """True if a supported prim could not be read."""
        return bool(self._meshes.notices or self._own_notices or self._skipped or self._instancers.notices)

    @property
    def notices(self) -> list[StageNotice]:
        """All notices, grouped by their source."""
        left_out = [
            StageNotice("ignored_element", f"{what} are not shown: {count}")
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
        prims = []
        walk = iter(Usd.PrimRange.Stage(self.stage, Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)))
        for prim in walk:
            role = self._role(prim)
            if role is Role.INSTANCER:
                walk.PruneChildren()  # prototypes are not objects themselves
            if role is not Role.NONE:
                prims.append((prim, role))
            else:
                self.moves = self.moves or is_animated(prim)
                self._report_unused(prim, unused_of_model(prim))
        self._meshes.bind([prim for prim, role in prims if role is Role.GEOMETRY])
        for prim, role in prims:
            try:
                self._read_prim(prim, role)
            except (ArithmeticError, LookupError, TypeError, ValueError, Tf.ErrorException) as error:
                lines = str(error).strip().splitlines()[-1:] or [type(error).__name__]
                self._note("ignored_element", prim, f"not shown: {lines[0]}")
        self.moves = self.moves or self._skinning.moves or self._instancers.moves

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

    def _read_prim(self, prim: Usd.Prim, role: Role) -> None:
        if reason := self._visibility.hidden_reason(prim):
            if prim.IsA(UsdGeom.Gprim) or role is Role.INSTANCER:
                self._skipped["invisible prims" if reason == "invisible" else f"prims {reason}"] += 1
            return
        self._report_unused(prim, unused_of_model(prim))
        from_local = self._places.GetLocalToWorldTransform(prim)
        self.moves = self.moves or is_animated(prim)
        if role is Role.GEOMETRY:
            self._read_geometry(prim, from_local)
        elif role is Role.INSTANCER:
            instances = self._instancers.expand(prim)
            matrices = self._turn @ matrices_of(from_local, instances)
            self._place(prim, instances.names, instances.meshes, instances.materials, matrices)
        elif role is Role.CAMERA:
            self.cameras.append(camera_spec(UsdGeom.Camera(prim), from_local, self._time))
            self._report_unused(prim, unused_of_camera(prim, self._time))
        elif role is Role.LIGHT:
            self._read_light(prim, from_local)
        else:
            self._skipped[f"{prim.GetTypeName()} prims"] += 1

    def _read_geometry(self, prim: Usd.Prim, from_local: Gf.Matrix4d) -> None:
        matrix = self._turn @ np.array(from_local).T
        if not np.isfinite(matrix).all():
            self._note("ignored_element", prim, "not shown: the prim's transform is not finite")
            return
        rank = np.linalg.matrix_rank(matrix[:3, :3])
        if rank < 2:
            self._note(
                "ignored_element", prim, "not shown: the prim's transform has scale 0 along two axes or more"
            )
            return
        # A matrix of rank 2 has no inverse, so the points are written in world coordinates.
        appearance = self._meshes.describe(prim, baked=matrix if rank < 3 else None)
        if appearance is not None:
            self._add_object(prim.GetName(), appearance, matrix if rank == 3 else np.eye(4))

    def _add_object(self, name: str, appearance: Appearance, matrix: Any) -> None:
        self.handover.add_objects([name], [appearance.mesh], [appearance.materials], matrix[None])

    def _place(
        self,
        prim: Usd.Prim,
        names: list[str],
        meshes: list[int],
        materials: list[tuple[int, ...]],
        matrices: Any,
    ) -> None:
        """Adds objects of an instancer; those with scale 0 along an axis are omitted, with a notice."""
        lengths = np.linalg.norm(matrices[:, :3, :3], axis=1).prod(axis=1)
        solid = np.abs(np.linalg.det(matrices[:, :3, :3])) > 1e-12 * lengths
        if not solid.all():
            count = np.count_nonzero(~solid)
            self._note(
                "ignored_element", prim, f"{count} instances are not shown: their transforms have scale 0"
            )
            kept = np.flatnonzero(solid).tolist()
            names = [names[place] for place in kept]
            meshes = [meshes[place] for place in kept]
            materials = [materials[place] for place in kept]
            matrices = matrices[kept]
        self.handover.add_objects(names, meshes, materials, matrices)

    def _read_light(self, prim: Usd.Prim, from_local: Gf.Matrix4d) -> None:
        if prim.GetTypeName() == "CylinderLight" and not self._merged:
            mesh, radiance = cylinder_light(prim, from_local, self._time)
            material = self.materials.add_emitter(prim.GetName(), radiance)
            number = self.handover.add_mesh(mesh)
            matrix = np.array(from_local).T
            self._add_object(prim.GetName(), Appearance(number, (material,), len(mesh.corners)), matrix)
            self._report_unused(prim, unused_of_light(prim, self._time))
            return
        light, text = light_spec(prim, from_local, self._images.file, self.up, self._time)
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
    return Role.UNSUPPORTED if prim.IsA(UsdGeom.Gprim) else Role.NONE
