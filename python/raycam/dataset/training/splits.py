"""Splits of a data set, by a seed and by scene: views of one world, or of one pose of a rig, stay together."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping
from typing import Any

from ...errors import SettingsError
from ..plan import Plan

__all__ = ["SPLITS", "check_splits", "split_names"]

SPLITS: Mapping[str, Any] = {"splits": {"train": 0.8, "val": 0.2}, "split_seed": 0}
"""The options of formats with splits, with their defaults."""


def check_splits(plan: Plan) -> None:
    """Raises `SettingsError` unless `splits` are shares by name whose sum is 1, and `split_seed` is a whole number."""
    splits, seed = plan.options["splits"], plan.options["split_seed"]
    named = isinstance(splits, Mapping) and all(
        isinstance(share, int | float) and share >= 0 and name.isidentifier()
        for name, share in splits.items()
    )
    if not named or not math.isclose(sum(splits.values()), 1.0, abs_tol=1e-9):
        raise SettingsError(
            f'splits is {splits!r}; expected shares whose sum is 1, as {{"train": 0.8, "val": 0.2}}'
        )
    if not isinstance(seed, int):
        raise SettingsError(f"split_seed is {seed!r}; expected a whole number")


def split_names(plan: Plan) -> list[str]:
    """The split of each view: a function of the seed and of the number of its world, rig's pose, or the view."""
    whole = plan.whole or plan
    groups = [_group(view.world, view.rig, number) for number, view in enumerate(whole.shots)]
    seed = plan.options["split_seed"]

    def draw(group: str) -> bytes:
        return hashlib.sha256(f"{seed} {group}".encode()).digest()

    order = sorted(dict.fromkeys(groups), key=draw)
    found: dict[str, str] = {}
    share = 0.0
    for name, part in plan.options["splits"].items():
        first, share = round(share * len(order)), share + part
        found |= dict.fromkeys(order[first : round(share * len(order))], name)
    return [found[group] for group in groups]


def _group(world: int | None, rig: tuple[int, str] | None, number: int) -> str:
    if world is not None:
        return f"world {world}"
    return f"view {number}" if rig is None else f"pose {rig[0]}"
