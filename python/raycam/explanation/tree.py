"""Searches for the closest triangle in a tree of boxes.

The search shows which boxes the ray enters, and how many triangles are tested. The tree is the simplest kind:
each box is split into halves at the median along its longest side, with at most four triangles in a leaf.
raycam's own tree has wider nodes and better splits, but works in the same way. Only boxes that the ray enters
are built.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from .. import reference
from ..reference.units import Bools, Floats
from .all_triangles import BLOCK, Indices
from .digits import number, vector
from .steps import PixelSteps

__all__ = ["Box", "TreeSearch", "entered", "tree_search"]

LEAF = 4
"""Maximum number of triangles in a leaf."""
SHOWN = 40
"""Maximum number of boxes listed in the text."""


@dataclass(frozen=True)
class Box:
    """A box that the ray enters."""

    low: Floats
    """The smallest coordinates, [3], in the explanation's units."""
    high: Floats
    """The greatest coordinates, [3]."""
    depth: int
    """The level; 0 for the outermost box."""
    triangles: int
    """The number of triangles in the box."""
    enters: float
    """The ray parameter where the ray enters the box; 0 if the ray starts inside."""
    leaves: float
    """The ray parameter where the ray leaves."""
    is_leaf: bool
    """True if the box's triangles are tested."""


@dataclass(frozen=True)
class TreeSearch:
    """The search for the closest triangle of one ray, in a tree of boxes."""

    boxes: tuple[Box, ...]
    """The boxes that are opened, in order."""
    tested_boxes: int
    """The number of boxes that are tested."""
    skipped_boxes: int
    """The number of entered boxes that begin behind a previously found hit."""
    tested_triangles: int
    """The number of triangles that are tested."""
    triangles: int
    """The number of triangles in the world."""
    winner: int
    """The index of the closest triangle in the world; -1 for a miss."""
    t: float
    """The closest triangle's ray parameter; +inf for a miss."""

    def __str__(self) -> str:
        """The search as text."""
        return "\n".join(_text(self))


def tree_search(explanation: PixelSteps) -> TreeSearch:
    """The search of an explained pixel's ray through all triangles of its world."""
    world_corners = np.asarray(explanation.world.triangles(), np.float64)
    lows, highs, middles = _extents(world_corners, explanation.units.points)
    C, r = explanation.C, explanation.r
    winner, closest = -1, np.inf
    boxes: list[Box] = []
    counts = {"boxes": 0, "skipped": 0, "triangles": 0}

    def bounds(members: Indices) -> tuple[Floats, Floats, float, float]:
        low = np.array([axis[members].min() for axis in lows])
        high = np.array([axis[members].max() for axis in highs])
        counts["boxes"] += 1
        return low, high, *entered(low, high, C, r)

    everything = np.arange(len(world_corners))
    waiting = [(everything, 0, *bounds(everything))] if len(world_corners) else []
    while waiting:
        members, depth, low, high, enters, leaves = waiting.pop()
        if enters > leaves or enters > closest:
            counts["skipped"] += enters <= leaves
            continue
        is_leaf = len(members) <= LEAF
        boxes.append(Box(low, high, depth, len(members), enters, leaves, is_leaf))
        if is_leaf:
            counts["triangles"] += len(members)
            corners = explanation.units.points(world_corners[members])
            t = reference.hit_distances(corners, reference.normals(corners), C, r[None])[0]
            first = int(np.argmin(t))
            if t[first] < closest:
                winner, closest = int(members[first]), float(t[first])
            continue
        places = [axis[members] for axis in middles]
        order = np.argpartition(max(places, key=np.ptp), len(members) // 2)
        halves = (members[order[: len(members) // 2]], members[order[len(members) // 2 :]])
        children = [(half, depth + 1, *bounds(half)) for half in halves]
        waiting += sorted(children, key=lambda each: -each[4])  # the nearer child is opened first
    return TreeSearch(
        tuple(boxes),
        counts["boxes"],
        int(counts["skipped"]),
        counts["triangles"],
        len(world_corners),
        winner,
        closest,
    )


def _extents(world_corners: Floats, points: Callable[[Floats], Floats]) -> Floats:
    """Returns the smallest, largest and middle coordinates of triangles, [3, axis, n].

    The triangles are [n, 3, 3]; `points` converts their corners. The middle of a triangle is the mean of its
    corners.
    """
    made = np.empty((3, 3, len(world_corners)))
    for start in range(0, len(world_corners), BLOCK):
        a, b, c = points(world_corners[start : start + BLOCK]).transpose(1, 2, 0)
        some = slice(start, start + BLOCK)
        made[0, :, some] = np.minimum(np.minimum(a, b), c)
        made[1, :, some] = np.maximum(np.maximum(a, b), c)
        made[2, :, some] = (a + b + c) / 3
    return made


def entered(low: Floats, high: Floats, C: Floats, r: Floats) -> tuple[float, float]:
    """Returns the ray parameters where f(t) = C + t r enters and leaves a box.

    If the ray misses the box, the first parameter (enter) is larger than the second parameter (leave).
    """
    enter, leave = 0.0, np.inf
    for axis in range(3):
        if r[axis] == 0:
            inside: Bools | bool = low[axis] <= C[axis] <= high[axis]
            if not inside:
                return np.inf, -np.inf
            continue
        a, b = (low[axis] - C[axis]) / r[axis], (high[axis] - C[axis]) / r[axis]
        enter, leave = max(enter, min(a, b)), min(leave, max(a, b))
    rounding = 4 * np.finfo(np.float64).eps
    return float(enter), float(leave + rounding * abs(leave))


def _text(search: TreeSearch) -> Iterator[str]:
    """Yields the lines of `TreeSearch.__str__`."""
    yield "THE TREE: BOXES AROUND TRIANGLES, SO THAT FEW OF THEM ARE TESTED"
    yield ""
    yield "   If the ray misses a box, none of its triangles is tested. Each box is halved along its longest"
    yield "   side; the half that the ray enters first is opened first. Boxes behind the closest hit are skipped."
    yield "   The ray is in the box while it is in all three slabs: t from (low - C) / r to (high - C) / r."
    yield ""
    yield f"   {search.triangles:>9} triangles in the world"
    yield f"   {search.tested_boxes:>9} boxes tested"
    leaves = sum(box.is_leaf for box in search.boxes)
    yield f"   {len(search.boxes):>9} boxes entered and opened, {leaves} of them leaves"
    yield f"   {search.skipped_boxes:>9} boxes entered, but behind a closer hit"
    yield f"   {search.tested_triangles:>9} triangles tested"
    yield ""
    if not search.boxes:
        yield "   The ray misses the outermost box."
        return
    yield f"   {'level':<8}{'triangles':>9}  {'t enters':>10}  {'t leaves':>10}  from, to"
    for box in search.boxes[:SHOWN]:
        level = "  " * min(box.depth, 2) + f"{box.depth}" + (" leaf" if box.is_leaf else "")
        yield (
            f"   {level:<8}{box.triangles:>9}  {number(box.enters, 4):>10}  {number(box.leaves, 4):>10}  "
            f"{vector(box.low, 4)}, {vector(box.high, 4)}"
        )
    if len(search.boxes) > SHOWN:
        yield f"   and {len(search.boxes) - SHOWN} more"
