"""The transparent surfaces along rays, in the order in which MuJoCo's renderer blends them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from ...arguments import Floats
from ...world import World
from .model import GEOM_OBJECT, PLANE

__all__ = ["BEHIND", "blend_layers", "blending_order", "find_layers", "planes_behind"]

Single = npt.NDArray[np.float32]
Hits = dict[str, Any]
MAX_LAYERS = 32
"""The largest number of transparent surfaces along a ray."""
BEHIND = 0.3
"""The opacity of planes viewed from behind is multiplied by this factor."""
PLANE_DISTANCE = 1e10
"""The distance of planes in the blending order: behind all other geoms."""


def find_layers(
    cast: Callable[..., Hits], origins: Floats, directions: Floats, limits: Floats, objects: list[int]
) -> list[Hits]:
    """Returns the hits of rays with several layers of objects, up to the distances `limits` [n].

    The list has one dictionary for each depth of layers. The dictionary's arrays belong to the rays `ray`
    [m]. `cast` takes origins, directions, objects, t_min and t_max.
    """
    found: list[Hits] = []
    active, start = np.arange(len(directions)), np.zeros(len(directions))
    while len(active) and objects and len(found) < MAX_LAYERS:
        hits = cast(origins[active], directions[active], objects, start, limits[active])
        hit = hits["instance"] >= 0
        active = active[hit]
        if len(active):
            chosen = {name: value[hit] for name, value in hits.items()}
            found.append(chosen | {"ray": active})
            start = np.nextafter(chosen["t"], np.inf)
    return found


def planes_behind(model: Any, world: World, elements: list[tuple[int, int]], eye: Floats) -> list[int]:
    """Returns the objects that are planes whose back faces the point `eye` [3]."""
    behind = []
    for number, (kind, geom) in enumerate(elements):
        if kind == GEOM_OBJECT and int(model.geom_type[geom]) == PLANE:
            matrix = world.objects[number].matrix
            if (eye - matrix[:3, 3]) @ matrix[:3, 2] < 0:
                behind.append(number)
    return behind


def blending_order(
    model: Any, world: World, elements: list[tuple[int, int]], objects: list[int], eye: Floats
) -> list[int]:
    """Returns objects ordered by their distance from the point `eye` [3], the nearest first.

    The distance is the centre's distance minus the bounding radius; planes have a fixed distance.
    """
    distances = {}
    for number in objects:
        kind, element = elements[number]
        if kind == GEOM_OBJECT and int(model.geom_type[element]) == PLANE:
            distances[number] = PLANE_DISTANCE
            continue
        radius = float(model.geom_rbound[element]) if kind == GEOM_OBJECT else 0.0
        distances[number] = float(np.linalg.norm(world.objects[number].matrix[:3, 3] - eye)) - radius
    return sorted(objects, key=lambda number: distances[number])


def blend_layers(colors: Single, layers: list[tuple[Hits, Single, Single]], order: list[int]) -> None:
    """Blends layers over the colours [n, 3], as MuJoCo does.

    The objects are blended in the given `order`, and then again in the reverse order.

    Each layer has its hits, colours [m, 3] and opacities [m].
    """
    for number in [*order, *reversed(order)]:
        for hits, front, alpha in layers:
            own = np.flatnonzero(hits["instance"] == number)
            rays, share = hits["ray"][own], alpha[own][:, None]
            colors[rays] += share * (front[own] - colors[rays])
