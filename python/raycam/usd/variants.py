"""Variant sets of a stage. Source: `UsdVariantSets`."""

from __future__ import annotations

import re
from typing import NamedTuple

from pxr import Usd

__all__ = ["UnknownVariant", "list_variants", "select_variants"]

MAX_SETS = 10_000
"""Maximum number of listed variant sets of a stage."""


class UnknownVariant(Exception):
    """Error: no prim of the stage has this variant."""


class VariantSet(NamedTuple):
    """A variant set of a prim."""

    prim: Usd.Prim
    name: str
    names: list[str]
    selection: str


def _find_sets(stage: Usd.Stage) -> list[VariantSet]:
    found: list[VariantSet] = []
    for prim in stage.TraverseAll():
        if not prim.HasVariantSets() or len(found) >= MAX_SETS:
            continue
        sets = prim.GetVariantSets()
        for name in sets.GetNames():
            own = sets.GetVariantSet(name)
            found.append(VariantSet(prim, name, own.GetVariantNames(), own.GetVariantSelection()))
    return found


def list_variants(stage: Usd.Stage) -> tuple[list[str], list[str]]:
    """Returns all distinct variants as "SET=NAME", and the selected variants."""
    sets = _find_sets(stage)
    every = dict.fromkeys(f"{own.name}={name}" for own in sets for name in own.names)
    return list(every), list(dict.fromkeys(f"{own.name}={own.selection}" for own in sets if own.selection))


def select_variants(stage: Usd.Stage, wanted: str) -> None:
    """Selects variants of a stage.

    `wanted` contains "NAME", "SET=NAME" or "/PRIM{SET=NAME}", several separated by commas. Without a prim, all prims
    with such a variant change. Raises `UnknownVariant` if no prim has the variant.
    """
    stage.SetEditTarget(stage.GetSessionLayer())
    for one in wanted.split(","):
        match = re.fullmatch(r"\s*(?:(/[^{}]*)\{([^{}=]+)=([^{}]*)\}|(?:([^={}]+)=)?([^{}]*?))\s*", one)
        if match is None:
            raise UnknownVariant(one.strip())
        path, own_set, own_name, any_set, any_name = match.groups()
        set_name, name = own_set or any_set, own_name or any_name
        chosen = [
            own
            for own in _find_sets(stage)
            if (path is None or own.prim.GetPath() == path)
            and (set_name is None or own.name == set_name.strip())
            and name.strip() in own.names
        ]
        if not chosen:
            raise UnknownVariant(one.strip())
        if set_name is None and len({own.name for own in chosen}) > 1:
            raise UnknownVariant(one.strip())
        for own in chosen:
            own.prim.GetVariantSet(own.name).SetVariantSelection(name.strip())
