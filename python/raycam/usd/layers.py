"""Problems of a stage's layers: composition errors, missing classes, different units.

Source: `UsdStage`.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from pathlib import Path

from pxr import Sdf, Usd, UsdGeom

from .notices import StageNotice

__all__ = ["find_layer_problems", "read_unit"]

MAX_LINE = 300
"""Maximum number of characters of a composition error that are shown."""


def find_layer_problems(stage: Usd.Stage, folder: Path) -> list[StageNotice]:
    """Notices about composition errors, and about layers with another unit or up axis.

    The unit and the up axis are compared with the stage's unit and up axis; classes that prims inherit from but no
    layer contains are reported, too.
    """
    return [*_composition_errors(stage, folder), *_missing_classes(stage), *_other_metrics(stage, folder)]


def read_unit(layer: Sdf.Layer) -> float | None:
    """The unit of length in metres; None if the layer does not specify a unit.

    Blender 2.8 wrote the unit in single precision.
    """
    root = layer.pseudoRoot
    return float(root.GetInfo("metersPerUnit")) if root.HasInfo("metersPerUnit") else None


def _composition_errors(stage: Usd.Stage, folder: Path) -> Iterator[StageNotice]:
    """Errors of references, payloads and other arcs, with file and prim."""
    prefix = re.escape(str(folder) + os.sep)
    for error in stage.GetCompositionErrors():
        text = re.sub(r",@anon:[^@]*@", "", " ".join(str(error).split()))
        text = re.sub(f"@{prefix}", "@", text).rstrip(" .")
        if len(text) > MAX_LINE:
            text = f"{text[:MAX_LINE]}..."
        prim = re.search(r"<([^<>]*)>$", str(error.rootSite))
        subject = f"prim {prim[1]}" if prim else ""
        yield StageNotice("invalid_file", f"{text[:1].lower()}{text[1:]}", subject)


def _missing_classes(stage: Usd.Stage) -> Iterator[StageNotice]:
    """Yields notices about classes that prims use, but that no layer contains.

    Prims inherit from these classes or specialize them. OpenUSD does not report them.
    """
    layers = stage.GetUsedLayers()
    known: dict[Sdf.Path, bool] = {}
    for prim in _each_once(stage):
        if _has_only(prim, known):
            continue
        for spec in prim.GetPrimStack():
            for verb, paths in (
                ("inherits from", spec.inheritPathList),
                ("specializes", spec.specializesList),
            ):
                for path in paths.GetAddedOrExplicitItems():
                    if path not in known:
                        known[path] = any(layer.GetPrimAtPath(path) for layer in layers)
                    if not known[path]:
                        file = os.path.basename(spec.layer.realPath or spec.layer.identifier)
                        text = f"the prim {verb} <{path}>, which no layer contains (in @{file}@)"
                        yield StageNotice("invalid_file", text, f"prim {prim.GetPath()}")


def _each_once(stage: Usd.Stage) -> Iterator[Usd.Prim]:
    """Yields all active prims; the prims of a prototype are yielded for its first instance only."""
    entered = set()
    walk = iter(Usd.PrimRange.Stage(stage, Usd.TraverseInstanceProxies(Usd.PrimIsActive)))
    for prim in walk:
        yield prim
        if prim.IsInstance():
            if prim.GetPrototype() in entered:
                walk.PruneChildren()
            entered.add(prim.GetPrototype())


def _has_only(prim: Usd.Prim, known: dict[Sdf.Path, bool]) -> bool:
    """Returns True if a prim uses only classes that exist and were found before.

    A prim uses the classes that it inherits from or specializes.
    """
    arcs = ((prim.HasAuthoredInherits(), "inheritPaths"), (prim.HasAuthoredSpecializes(), "specializes"))
    listed = [prim.GetMetadata(key) for has_arc, key in arcs if has_arc]
    return all(
        paths is not None and all(known.get(path) for path in paths.GetAddedOrExplicitItems())
        for paths in listed
    )


def _other_metrics(stage: Usd.Stage, folder: Path) -> Iterator[StageNotice]:
    """Layers with a different unit or up axis, whose coordinates OpenUSD does not convert."""
    root = stage.GetRootLayer()
    unit = read_unit(root) or UsdGeom.GetStageMetersPerUnit(stage)
    axis = str(UsdGeom.GetStageUpAxis(stage))
    for layer in stage.GetUsedLayers():
        if layer.anonymous or layer == root:
            continue
        name = os.path.relpath(layer.realPath or layer.identifier, folder)
        own = read_unit(layer)
        if own is not None and own > 0 and unit > 0 and abs(own / unit - 1) > 1e-6:
            yield StageNotice(
                "assumed_convention",
                f"the layer's unit is {own:g} m, but the stage's is {unit:g} m; coordinates are not converted:"
                f" multiply them by {own / unit:g}",
                f"layer {name}",
            )
        other = layer.pseudoRoot.GetInfo("upAxis") if layer.pseudoRoot.HasInfo("upAxis") else axis
        if str(other) != axis:
            yield StageNotice(
                "assumed_convention",
                f"the layer's up axis is {other}, but the stage's is {axis}; coordinates are not converted",
                f"layer {name}",
            )
