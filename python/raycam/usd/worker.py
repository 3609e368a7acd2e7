"""The process that reads a USD file: `python -m raycam.usd.worker FILE FOLDER LIMITS`.

Writes `world.json` for `World.from_dict`, an OBJ file for every mesh, `materials.mtl`, and the images. Supported are
meshes and gprims with their instances, UsdPreviewSurface materials, cameras and lights, at the first time. Other
renderable prims are listed in `"notices"`.
"""

from __future__ import annotations

import json
import os
import re
import sys
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from pxr import Gf, Tf, Usd, UsdGeom, UsdLux

from .camera import camera_spec
from .confinement import Confinement, UsdRejected
from .gprims import GPRIMS
from .images import Images
from .lights import light_spec
from .materials import Materials
from .meshes import Meshes, rows
from .point_instancer import instances
from .skinning import Skinning
from .unused import unused_of_camera, unused_of_light, unused_of_model

__all__: list[str] = []

GEOMETRY_TYPES = {"Mesh", *GPRIMS}
"""Types that become objects."""


def apply_rlimits(memory: int, seconds: float, size: int) -> None:
    """Limits the resources of this process, on systems that can."""
    try:
        import resource
    except ImportError:  # Windows
        return
    limits = {
        resource.RLIMIT_AS: (memory, memory),
        resource.RLIMIT_CPU: (int(seconds) + 1, int(seconds) + 2),
        resource.RLIMIT_FSIZE: (size, size),
        resource.RLIMIT_CORE: (0, 0),
    }
    for kind, limit in limits.items():
        try:
            resource.setrlimit(kind, limit)
        except (ValueError, OSError):
            if sys.platform != "darwin":  # macOS refuses limits of the address space
                raise


@dataclass(frozen=True)
class Options:
    """Options of reading a file, and its limits."""

    memory: int
    bytes: int
    seconds: float
    triangles: int
    folder: str
    """The folder in which all files lie."""
    time: float | None = None
    """The time in seconds; None for the first one."""
    single: bool = False
    """True to write all meshes as one."""
    up: str | None = None
    """The up axis to which the meshes are turned; None for that of the file."""


class Reader:
    """The reader of one stage; collects objects, lights and cameras."""

    def __init__(self, stage: Usd.Stage, images: Images, options: Options) -> None:
        self.objects: list[dict[str, Any]] = []
        self.lights: list[dict[str, Any]] = []
        self.cameras: list[dict[str, Any]] = []
        self.notices: list[str] = []
        self.unused: list[str] = []
        """Notices of what prims say that is not used."""
        self.skipped: Counter[str] = Counter()
        self.stage = stage
        self.up = "y" if UsdGeom.GetStageUpAxis(stage) == UsdGeom.Tokens.y else "z"
        self.moves = False
        self._bake = options.single
        self._images = images
        self._turn = np.eye(4)
        if options.up is not None and options.up != self.up:
            # A quarter turn about x.
            sine = 1.0 if options.up == "z" else -1.0
            self._turn[1:3, 1:3] = [[0.0, -sine], [sine, 0.0]]
        self._time = (
            Usd.TimeCode.EarliestTime() if options.time is None else Usd.TimeCode(options.time * _rate(stage))
        )
        self._places = UsdGeom.XformCache(self._time)
        self._skinning = Skinning(stage, self._time, self._places)
        self.materials = Materials(images, self._time)
        self.meshes = Meshes(images.folder, self.materials, self._skinning, self._time, options.triangles)

    def read(self) -> None:
        """Walks over the stage; a prim that cannot be read is left out with a notice."""
        walk = iter(Usd.PrimRange.Stage(self.stage, Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)))
        for prim in walk:
            if prim.IsA(UsdGeom.PointInstancer):
                # Prototypes are not objects themselves.
                walk.PruneChildren()
            try:
                self._read_prim(prim)
            except (ArithmeticError, LookupError, TypeError, ValueError, Tf.ErrorException) as error:
                words = str(error).strip().splitlines()[-1:] or [type(error).__name__]
                self.notices.append(f"{prim.GetTypeName()} {prim.GetPath()} is left out: {words[0]}")
        self.moves = self.moves or self._skinning.moves

    def _read_prim(self, prim: Usd.Prim) -> None:
        kind = prim.GetTypeName()
        if kind and not Usd.SchemaRegistry().FindConcretePrimDefinition(kind):
            self.skipped[f"{kind} prims, of a type that Pixar's library does not know here,"] += 1
        if _is_seen(prim) and (reason := self._hidden(prim)):
            self.skipped[f"{reason} prims"] += 1
            return
        if self._hidden(prim):
            return
        self._say_unused(prim, unused_of_model(prim))
        from_local = self._places.GetLocalToWorldTransform(prim)
        if prim.IsA(UsdGeom.Xformable) and not self.moves:
            self.moves = _might_move(prim)
        if kind in GEOMETRY_TYPES:
            self._add(prim.GetName(), prim, from_local)
        elif prim.IsA(UsdGeom.PointInstancer):
            self._read_instancer(prim, from_local)
        elif prim.IsA(UsdGeom.Camera):
            self.cameras.append(camera_spec(UsdGeom.Camera(prim), from_local, self._time))
            self._say_unused(prim, unused_of_camera(prim, self._time))
        elif prim.HasAPI(UsdLux.LightAPI):
            light, notice = light_spec(prim, from_local, self._images.file, self.up, self._time)
            self.lights.extend([light] if light else [])
            self.notices.extend([notice] if notice else [])
            self._say_unused(prim, unused_of_light(prim, self._time) if light else [])
        elif _is_seen(prim):
            self.skipped[f"{kind} prims"] += 1

    def _read_instancer(self, prim: Usd.Prim, from_local: Gf.Matrix4d) -> None:
        source = UsdGeom.PointInstancer(prim)
        for number, part, place in instances(source, from_local, self._places, self._time):
            kind = part.GetTypeName()
            if not _is_seen(part):
                continue
            if reason := self._hidden(part):
                self.skipped[f"{reason} prims"] += 1
            elif kind in GEOMETRY_TYPES:
                self._add(f"{prim.GetName()}.{number}", part, place)
            else:
                self.skipped[f"{kind} prims"] += 1

    def _say_unused(self, prim: Usd.Prim, words: list[str]) -> None:
        if words:
            self.unused.append(
                f"{prim.GetTypeName() or 'prim'} {prim.GetPath()}: not used: {'; '.join(words)}"
            )

    def _add(self, name: str, prim: Usd.Prim, world_from_local: Gf.Matrix4d) -> None:
        matrix = self._turn @ np.array(rows(world_from_local))
        placed = self.meshes.describe(name, UsdGeom.Gprim(prim), matrix, self._bake)
        self.objects.extend([placed] if placed else [])

    def _hidden(self, prim: Usd.Prim) -> str | None:
        """The reason why a prim is not shown; None for one that is."""
        imageable = UsdGeom.Imageable(prim)
        if not imageable:
            return None
        if imageable.ComputeVisibility(self._time) == UsdGeom.Tokens.invisible:
            return "invisible"
        purpose = imageable.ComputePurpose()
        return str(purpose) if purpose in (UsdGeom.Tokens.guide, UsdGeom.Tokens.proxy) else None


def _is_seen(prim: Usd.Prim) -> bool:
    """True for a prim of a type that a renderer shows, known to raycam or not."""
    return bool(prim.IsA(UsdGeom.Gprim) or prim.IsA(UsdGeom.PointInstancer))


def _might_move(prim: Usd.Prim) -> bool:
    """True for a prim with more than one time sample of its place, shape or visibility."""
    if UsdGeom.Xformable(prim).TransformMightBeTimeVarying():
        return True
    names = ("points", "visibility", "positions", "orientations", "scales")
    return any(prim.GetAttribute(name).ValueMightBeTimeVarying() for name in names if prim.HasAttribute(name))


def world_dict(path: Path, folder: Path, options: Options) -> dict[str, Any]:
    """Reads the file as a dict for `World.from_dict`, and writes meshes and images to the folder."""
    confinement = Confinement(path, Path(options.folder), options.bytes)
    layers = confinement.open_layers()  # the stage uses those that are open
    stage = Usd.Stage.Open(layers[0])
    if stage is None:
        raise UsdRejected("not a USD stage that Pixar's library can open")
    images = Images(confinement, folder)
    reader = Reader(stage, images, options)
    reader.read()
    reader.materials.write(folder / "materials.mtl")
    confinement.check_loaded()
    left_out = [f"{count} {what} are left out" for what, count in sorted(reader.skipped.items())]
    notices = [
        *(confinement.notices + images.notices + _counted(reader.materials.notices)),
        *(_counted(reader.meshes.notices) + reader.notices + _counted(reader.unused) + left_out),
    ]
    if not reader.objects:
        has_lost = bool(confinement.has_lost or reader.meshes.notices or reader.notices or left_out)
        _check_empty(stage, has_lost, notices, options)
        notices.append("no meshes or solids in it: nothing to see")
    unit = _unit(stage)
    if unit != 1.0:
        notices.append(f"its unit of length is {unit:g} m: coordinates are kept as they are, in that unit")
    if reader.moves and options.time is None:
        notices.append(_moving(stage))
    if options.single:
        others = len(reader.lights) + len(reader.cameras)
        notices.extend([f"its {others} lights and cameras are left out: it is one object"] if others else [])
        objects = [{"mesh": reader.meshes.merge(reader.objects)}]
        found: dict[str, Any] = {"object": objects}
    else:
        found = {"object": reader.objects, "light": reader.lights, "camera": reader.cameras}
    return {"up": reader.up} | found | {"notices": notices, "files": images.files}


def _counted(notices: list[str]) -> list[str]:
    """Notices "KIND PATH REST", one for all paths where more than three have the same kind and rest."""
    paths: dict[tuple[str, str], list[str]] = {}
    for notice in notices:
        kind, path, rest = re.match(r"(\S+) (/[^\s:]*)(.*)", notice, re.S).groups()  # type: ignore[union-attr]
        paths.setdefault((kind, rest), []).append(path)
    return [
        f"{kind} {path}{rest}"
        for (kind, rest), found in paths.items()
        for path in (found if len(found) < 4 else [f"{found[0]} and {len(found) - 1} others"])
    ]


def _check_empty(stage: Usd.Stage, has_lost: bool, notices: list[str], options: Options) -> None:
    """Raises `UsdRejected` for a stage without objects, except where all that it has is something else."""
    if has_lost or options.single or not stage.GetRootLayer().rootPrims:
        said = "".join(f"; {notice}" for notice in notices[:5])
        raise UsdRejected(f"no meshes or solids in it: nothing to see{said}")


def _moving(stage: Usd.Stage) -> str:
    """The notice that a stage has several moments."""
    rate = _rate(stage)
    ends = f" from {stage.GetStartTimeCode() / rate:g} to {stage.GetEndTimeCode() / rate:g} s"
    span = ends if stage.HasAuthoredTimeCodeRange() else ""
    first = "it moves, and is shown at its first time"
    return f"{first}: raycam.load(path, time=SECONDS) shows another,{span or ' in seconds'}"


def _rate(stage: Usd.Stage) -> float:
    """The time codes per second; Pixar's default for a stage that says 0 or less."""
    rate = float(stage.GetTimeCodesPerSecond())
    return rate if rate > 0 else 24.0


def _unit(stage: Usd.Stage) -> float:
    """The unit of length in metres. Blender 2.8 wrote it as a float, which the stage's own getter ignores."""
    root = stage.GetRootLayer().pseudoRoot
    if not root.HasInfo("metersPerUnit"):
        return UsdGeom.GetStageMetersPerUnit(stage)  # type: ignore[no-any-return]
    return float(root.GetInfo("metersPerUnit"))


def main(path: Path, folder: Path, options: Options) -> None:
    """Writes the world or the error to `world.json`."""
    apply_rlimits(options.memory, options.seconds, options.bytes)
    # Pixar's library also looks for layers in the current folder.
    os.chdir(folder)
    try:
        found = world_dict(path, folder, options)
    except UsdRejected as error:
        found = {"error": str(error)}
    except Tf.ErrorException as error:
        found = {"error": "Pixar's library: " + "; ".join(part.commentary for part in error.args)}
    except MemoryError:
        found = {"error": f"more memory needed than the budget of {options.memory} bytes"}
    (folder / "world.json").write_text(json.dumps(found), encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]), Options(**json.loads(sys.argv[3])))
    # All is written. Threads of Pixar's library may still run, and taking it down at the same time aborts at times.
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(0)
