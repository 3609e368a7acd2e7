"""The process that reads a USD file: `python -m raycam.usd.worker FILE FOLDER LIMITS`.

Writes `world.json` for `World.from_dict`, an OBJ file for every mesh, `materials.mtl`, and the images. Supported are
meshes and gprims with their instances, UsdPreviewSurface materials, cameras and lights, at the first time. Other
renderable prims are listed in `"notices"`.
"""

from __future__ import annotations

import json
import shutil
import sys
import zipfile
from collections import Counter
from pathlib import Path
from typing import Any

from pxr import Ar, Sdf, Tf, Usd, UsdGeom, UsdLux

from .camera import camera_spec
from .gprims import GPRIMS
from .lights import light_spec
from .materials import Materials
from .meshes import Meshes, rows
from .point_instancer import instances

__all__ = ["UsdRejected"]

UNSUPPORTED_TYPES = (
    *("Capsule_1", "Points", "BasisCurves", "NurbsCurves"),
    *("NurbsPatch", "HermiteCurves", "TetMesh", "Volume", "PointInstancer"),
)
"""Renderable types that raycam does not support."""
GEOMETRY_TYPES = {"Mesh", *GPRIMS}
"""Types that become objects."""


class UsdRejected(Exception):
    """The file is rejected, with the reason."""


def apply_rlimits(memory: int, seconds: float, size: int) -> None:
    """Limits the resources of this process, on systems that can."""
    try:
        import resource
    except ImportError:  # Windows
        return
    resource.setrlimit(resource.RLIMIT_AS, (memory, memory))
    resource.setrlimit(resource.RLIMIT_CPU, (int(seconds) + 1, int(seconds) + 2))
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def check_confined(path: Path, most: int) -> None:
    """Rejects a file with a layer that is not a regular file in the file's folder, before that layer is opened."""
    root, left = path.parent.resolve(), most
    waiting, seen = [path], set()
    while waiting:
        layer_path = waiting.pop()
        real = layer_path.resolve()
        if real in seen:
            continue
        seen.add(real)
        shown = layer_path.name if layer_path == path else str(layer_path)
        if not real.is_relative_to(root):
            raise UsdRejected(f"{shown}: it leads out of the folder of the USD file; copy it there")
        if not real.is_file():
            raise UsdRejected(f"{shown}: no such file, or no regular one")
        left -= real.stat().st_size
        if left < 0:
            raise UsdRejected(f"its layers have more bytes than the budget of {most}")
        layer = Sdf.Layer.FindOrOpen(str(layer_path))
        if layer is None:
            raise UsdRejected(f"{shown}: not a USD layer that Pixar's library can read")
        # An empty name stands for the layer itself.
        for asset in filter(None, layer.GetCompositionAssetDependencies()):
            if "`" in asset or ":" in asset:
                raise UsdRejected(
                    f"{shown}: layer {asset!r}: expected a path in the file's folder, without expressions"
                )
            if not asset.endswith("]") and path.suffix.lower() != ".usdz":
                waiting.append(Path(layer.ComputeAbsolutePath(asset)))


class Images:
    """The images of a stage, each copied into the folder once, from the USD file's folder or its package."""

    def __init__(self, path: Path, folder: Path, left: int) -> None:
        self.root = path.parent.resolve()
        self.folder = folder
        self.left = left
        self.package = zipfile.ZipFile(path) if path.suffix.lower() == ".usdz" else None
        self.known: dict[str, str | None] = {}
        self.files: dict[str, str] = {}  # original names of the images
        self.notices: list[str] = []

    def file(self, asset: Sdf.AssetPath) -> str | None:
        """The name of the copied image; None, with a notice, for an image that may not be used."""
        place = asset.resolvedPath or asset.path
        if place not in self.known:
            try:
                self.known[place] = name = self._copied(place)
                self.files[name] = asset.path
            except (OSError, KeyError, ValueError, UsdRejected) as error:
                self.notices.append(f"image {asset.path!r} is left out: {error}")
                self.known[place] = None
        return self.known[place]

    def _copied(self, place: str) -> str:
        name = f"image{len(self.known)}{Path(place.rstrip(']')).suffix.lower()}"
        target = self.folder / name
        if place.endswith("]") and self.package is not None:
            entry = self.package.getinfo(Ar.SplitPackageRelativePathInner(place)[1])
            self._take(entry.file_size)
            with self.package.open(entry) as source, target.open("wb") as copy:
                shutil.copyfileobj(source, copy)
            return name
        real = Path(place).resolve()
        if not real.is_relative_to(self.root):
            raise UsdRejected("it is not in the folder of the USD file")
        if not real.is_file():
            raise UsdRejected("no such file, or no regular one")
        self._take(real.stat().st_size)
        shutil.copyfile(real, target)
        return name

    def _take(self, size: int) -> None:
        if size > self.left:
            raise UsdRejected(f"{size} bytes, more than the budget has left")
        self.left -= size


def world_dict(path: Path, folder: Path, max_bytes: int, max_corners: int) -> dict[str, Any]:
    """Reads the file as a dict for `World.from_dict`, and writes meshes and images to the folder."""
    check_confined(path, max_bytes)
    stage = Usd.Stage.Open(str(path))
    if stage is None:
        raise UsdRejected("not a USD stage that Pixar's library can open")
    images = Images(path, folder, max_bytes)
    materials = Materials(images.file)
    meshes = Meshes(folder, materials, max_corners)
    places = UsdGeom.XformCache()
    world: dict[str, Any] = {"up": "y" if UsdGeom.GetStageUpAxis(stage) == UsdGeom.Tokens.y else "z"}
    objects, lights, cameras = [], [], []
    skipped: Counter[str] = Counter()
    everything = Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)
    walk = iter(Usd.PrimRange.Stage(stage, everything))
    for prim in walk:
        kind = prim.GetTypeName()
        seen = UsdGeom.Imageable(prim)
        if seen and _is_invisible(seen):
            continue
        from_local = places.GetLocalToWorldTransform(prim)
        if kind in GEOMETRY_TYPES:
            if file := meshes.file(UsdGeom.Gprim(prim)):
                objects.append({"name": prim.GetName(), "mesh": file, "matrix": rows(from_local)[:3]})
        elif prim.IsA(UsdGeom.PointInstancer):
            # Prototypes are not objects themselves.
            walk.PruneChildren()
            for number, part, place in instances(UsdGeom.PointInstancer(prim), from_local, places):
                if part.GetTypeName() in GEOMETRY_TYPES and not _is_invisible(UsdGeom.Imageable(part)):
                    if file := meshes.file(UsdGeom.Gprim(part)):
                        name = f"{prim.GetName()}.{number}"
                        objects.append({"name": name, "mesh": file, "matrix": rows(place)[:3]})
                elif part.GetTypeName() in UNSUPPORTED_TYPES:
                    skipped[part.GetTypeName()] += 1
        elif prim.IsA(UsdGeom.Camera):
            cameras.append(camera_spec(UsdGeom.Camera(prim), from_local))
        elif prim.HasAPI(UsdLux.LightAPI):
            light, notice = light_spec(prim, from_local, images.file, world["up"])
            lights.extend([light] if light else [])
            meshes.notices.extend([notice] if notice else [])
        elif kind in UNSUPPORTED_TYPES:
            skipped[kind] += 1
    left_out = [f"{count} {kind} prims are left out" for kind, count in sorted(skipped.items())]
    if not objects:
        said = "".join(f"; {notice}" for notice in [*left_out, *meshes.notices][:5])
        raise UsdRejected(f"no meshes or solids in it: nothing to see{said}")
    materials.write(folder / "materials.mtl")
    notices = [*images.notices, *materials.notices, *meshes.notices, *left_out]
    unit = _unit(stage)
    if unit != 1.0:
        notices.append(f"its unit of length is {unit:g} m: coordinates are kept as they are, in that unit")
    found = {"object": objects, "light": lights, "camera": cameras}
    return world | found | {"notices": notices, "files": images.files}


def _unit(stage: Usd.Stage) -> float:
    """The unit of length in metres. Blender 2.8 wrote it as a float, which the stage's own getter ignores."""
    root = stage.GetRootLayer().pseudoRoot
    if not root.HasInfo("metersPerUnit"):
        return UsdGeom.GetStageMetersPerUnit(stage)  # type: ignore[no-any-return]
    return float(root.GetInfo("metersPerUnit"))


def _is_invisible(prim: UsdGeom.Imageable) -> bool:
    return prim.ComputeVisibility() == "invisible" or prim.ComputePurpose() in ("guide", "proxy")


def main(path: Path, folder: Path, limits: dict[str, Any]) -> None:
    """Writes the world or the error to `world.json`."""
    apply_rlimits(limits["memory"], limits["seconds"], limits["bytes"])
    try:
        found = world_dict(path, folder, limits["bytes"], limits["triangles"])
    except UsdRejected as error:
        found = {"error": str(error)}
    except Tf.ErrorException as error:
        found = {"error": "Pixar's library: " + "; ".join(part.commentary for part in error.args)}
    except MemoryError:
        found = {"error": f"more memory needed than the budget of {limits['memory']} bytes"}
    (folder / "world.json").write_text(json.dumps(found), encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]), json.loads(sys.argv[3]))
