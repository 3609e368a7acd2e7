"""Compares the bounds of USD stages with those of Pixar's library.

    python benchmarks/usd_stages.py FOLDER [PART_OF_NAME]

FOLDER is a checkout of OpenUSD's repository, or another folder of stages; nothing is downloaded. Each stage is
loaded in a process of its own, at its first time. The bounds are compared with `UsdGeom.BBoxCache`, which uses the
extents in the file, and with the boxes of the points of all meshes, solids and instances. The script prints a line for
each stage that differs from both, and the counts. It also lists types of visible prims that are missing in the objects,
the notices and the error.
"""

from __future__ import annotations

import json
import multiprocessing
import sys
import warnings
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import raycam
from pxr import Gf, Tf, Usd, UsdGeom

PURPOSES = [UsdGeom.Tokens.default_, UsdGeom.Tokens.render]
SOLIDS = {"Sphere", "Cylinder", "Cone", "Capsule", "Cylinder_1", "Capsule_1"}
SHOWN = SOLIDS | {"Mesh", "Cube", "Plane", "TetMesh"}
WITHOUT_SURFACE = {"PointInstancer", "SkelRoot", "Skeleton"}
LIMIT_S = 120.0
"""Maximum time for one stage in seconds."""


def first_time(source: UsdGeom.PointInstancer) -> Usd.TimeCode:
    """The first sample of an instancer's positions or orientations."""
    attributes = [source.GetPositionsAttr(), source.GetOrientationsAttr(), source.GetOrientationsfAttr()]
    samples = [time for attribute in attributes for time in attribute.GetTimeSamples()[:1]]
    return Usd.TimeCode(min(samples)) if samples else Usd.TimeCode.EarliestTime()


def shapes(root: Usd.Prim, world: Gf.Matrix4d, places: UsdGeom.XformCache) -> Iterator[tuple[str, Any]]:
    """The type of each visible prim below `root`, and the box [2, 3] of its points in the world, or None."""
    time = Usd.TimeCode.EarliestTime()
    shown = Usd.PrimIsActive & Usd.PrimIsLoaded & ~Usd.PrimIsAbstract
    walk = iter(Usd.PrimRange(root, Usd.TraverseInstanceProxies(shown)))
    for prim in walk:
        if prim.IsA(UsdGeom.PointInstancer):
            walk.PruneChildren()
        if not prim.IsA(UsdGeom.Boundable):
            continue
        drawn = UsdGeom.Imageable(prim)
        if drawn.ComputeVisibility(time) == "invisible" or drawn.ComputePurpose() not in PURPOSES:
            continue
        local = Gf.Matrix4d(1) if prim == root else places.ComputeRelativeTransform(prim, root)[0]
        if prim.IsA(UsdGeom.PointInstancer):
            yield "PointInstancer", None
            yield from instances(UsdGeom.PointInstancer(prim), local * world, places)
            continue
        box = UsdGeom.Boundable.ComputeExtentFromPlugins(UsdGeom.Boundable(prim), time, local * world)
        yield str(prim.GetTypeName()), np.array(box) if box and len(box) == 2 else None


def instances(
    source: UsdGeom.PointInstancer, world: Gf.Matrix4d, places: UsdGeom.XformCache
) -> Iterator[tuple[str, Any]]:
    """The same as `shapes`, for the instances of an instancer."""
    time = first_time(source)
    kind = UsdGeom.PointInstancer
    matrices = source.ComputeInstanceTransformsAtTime(time, time, kind.IncludeProtoXform, kind.IgnoreMask)
    mask = list(source.ComputeMaskAtTime(time)) or [True] * len(matrices)
    roots = source.GetPrototypesRel().GetForwardedTargets()
    numbers = source.GetProtoIndicesAttr().Get(Usd.TimeCode.EarliestTime()) or []
    for number, matrix, is_shown in zip(numbers, matrices, mask, strict=False):
        if is_shown and number < len(roots):
            root = source.GetPrim().GetStage().GetPrimAtPath(roots[number])
            if root:
                yield from shapes(root, matrix * world, places)


def is_close(bounds: Any, others: list[Any]) -> bool:
    """True if the bounds are those of all `others` together, within 1e-4 of the size."""
    if bounds is None or not others:
        return bounds is None and not others
    both = np.array([np.min([box[0] for box in others], axis=0), np.max([box[1] for box in others], axis=0)])
    return bool(np.isfinite(both).all() and np.abs(bounds - both).max() <= 1e-4 * np.abs(both).max())


def compare(path: str, folder: str) -> tuple[str, list[str]]:
    """The outcome of one stage, and the types of prims that are lost silently."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            world, said = raycam.load(path, folder=folder), ""
        except raycam.errors.Error as error:
            world, said = None, str(error)
    try:
        stage = Usd.Stage.Open(path)
        cache = UsdGeom.BBoxCache(Usd.TimeCode.EarliestTime(), PURPOSES)
        judged = cache.ComputeWorldBound(stage.GetPseudoRoot()).ComputeAlignedRange()
        places = UsdGeom.XformCache(Usd.TimeCode.EarliestTime())
        found = list(shapes(stage.GetPseudoRoot(), Gf.Matrix4d(1), places))
    except Tf.ErrorException:
        return ("OpenUSD cannot open it" if world is None else "read, but OpenUSD cannot open it"), []
    said += "".join(str(notice) for notice in (world.notices if world else ()))
    kinds = {kind for kind, _ in found} - WITHOUT_SURFACE
    lost = [kind for kind in kinds - SHOWN if kind not in said and not kind.endswith("Light")]
    cached = [] if judged.IsEmpty() else [np.array([judged.GetMin(), judged.GetMax()])]
    if world is None:
        return ("refused, with bounds" if cached else "refused, without bounds"), lost
    bounds = None if world.bounds is None else np.array(world.bounds)
    if is_close(bounds, cached):
        return ("equal" if cached else "no bounds"), lost
    if is_close(bounds, [box for kind, box in found if kind in SHOWN and box is not None]):
        return "equal to the points", lost
    return ("differs, with round solids" if kinds & SOLIDS else "DIFFERS"), lost


def main(folder: Path, part: str) -> None:
    files = sorted(
        path for path in folder.rglob("*.usd*") if path.suffix in (".usd", ".usda", ".usdc", ".usdz")
    )
    counts: Counter[str] = Counter()
    for path in (path for path in files if part in str(path)):
        with multiprocessing.get_context("spawn").Pool(1) as pool:
            try:
                outcome, lost = pool.apply_async(compare, (str(path), str(folder))).get(LIMIT_S)
            except multiprocessing.TimeoutError:
                outcome, lost = "too slow", []
        counts[outcome] += 1
        if lost or outcome not in ("equal", "no bounds", "equal to the points", "refused, without bounds"):
            print(path.relative_to(folder), outcome, *lost, flush=True)
    print(json.dumps(counts, indent=2))


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2] if len(sys.argv) > 2 else "")
