"""Draws random splits of a data set.

All views of one world, or of one pose of a rig, are in the same split.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping
from typing import Any

from ...arguments import as_number
from ...errors import SettingsError
from ..plan import Plan

__all__ = ["SPLITS", "check_splits", "split_names"]

SPLITS: Mapping[str, Any] = {"splits": {"train": 0.8, "val": 0.2}, "split_seed": 0}
"""Options of formats with splits, with their defaults."""


def check_splits(plan: Plan) -> None:
    """Raises `SettingsError` for invalid values of the options `splits` and `split_seed`.

    `splits` must map names to fractions with the sum 1, and `split_seed` must be a whole number.
    """
    splits, seed = plan.options["splits"], plan.options["split_seed"]
    named = isinstance(splits, Mapping) and all(
        as_number(share) is not None and share >= 0 and name.isidentifier() for name, share in splits.items()
    )
    if not named or not math.isclose(sum(splits.values()), 1.0, abs_tol=1e-6):
        raise SettingsError(
            f'splits is {splits!r}; expected fractions with the sum 1, as in {{"train": 0.8, "val": 0.2}}',
            code="out_of_range",
        )
    if not isinstance(as_number(seed), int):
        raise SettingsError(f"split_seed is {seed!r}; expected a whole number", code="wrong_type")


def split_names(plan: Plan) -> list[str]:
    """Returns each view's split.

    The split depends on the seed and on the number of the view's world, rig pose or view. For the worlds of a
    recipe, each world's split is drawn independently, so additional worlds do not change the split. For the
    views of a single world, the splits have exactly the requested fractions.
    """
    whole = plan.whole or plan
    groups = [_group(view.world, view.rig, number) for number, view in enumerate(whole.shots)]
    seed = plan.options["split_seed"]

    def draw(group: str) -> bytes:
        return hashlib.sha256(f"{seed} {group}".encode()).digest()

    order = sorted(dict.fromkeys(groups), key=draw)
    ranks = {group: (i + 0.5) / len(order) for i, group in enumerate(order)}
    if whole.recipe is not None:
        ranks = {group: int.from_bytes(draw(group)[:6], "big") / 2**48 for group in order}
    return [_at(ranks[group], plan.options["splits"]) for group in groups]


def _at(rank: float, splits: Mapping[str, float]) -> str:
    """Returns the name of the split at a position from 0 to 1.

    The splits form consecutive intervals whose lengths are their fractions.
    """
    end = 0.0
    for name, share in splits.items():
        end += share
        if rank < end:
            return name
    return next(name for name, share in reversed(list(splits.items())) if share > 0)


def _group(world: int | None, rig: tuple[int, str] | None, number: int) -> str:
    if world is not None:
        return f"world {world}"
    return f"view {number}" if rig is None else f"pose {rig[0]}"
