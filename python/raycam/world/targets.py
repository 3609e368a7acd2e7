"""Aiming of lights at a target."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..arguments import Floats, floats
from ..errors import WorldError, nearest
from .contents import WorldContents

__all__ = ["aim_light"]

DIRECTED = ("sun", "spot", "disk", "ies")
"""Light types with a direction."""


def aim_light(world: WorldContents, keys: dict[str, Any]) -> dict[str, Any]:
    """Returns a light's keys with `target` replaced by a direction.

    For an area light, `target` is replaced by the edges of the light.

    Raises `WorldError` for a light that shines in all directions, and if `position` is missing.
    """
    if "target" not in keys:
        return keys
    keys = dict(keys)
    kind, target = keys.get("type"), _point(world, keys.pop("target"))
    if kind not in (*DIRECTED, "area"):
        raise WorldError(
            f"target: a light of type {kind!r} has no direction; types with a direction: "
            f"{', '.join((*DIRECTED, 'area'))}",
            code="invalid_value",
        )
    for taken in ("direction",) if kind != "area" else ("u", "v"):
        if taken in keys:
            raise WorldError(
                f"target and {taken} cannot be combined, because both aim the light; use only one of them",
                code="conflicting_values",
            )
    if "position" not in keys:
        raise WorldError(
            "target requires position, which is missing; pass the point from which the light shines at the target",
            code="missing_value",
        )
    start = floats("position", keys["position"], (3,), error=WorldError)
    way = target - start
    if not way.any():
        raise WorldError(f"target is the light's own position, {start.tolist()}", code="invalid_value")
    if kind == "area":
        keys["u"], keys["v"] = _edges(world.up, way, keys.pop("size", (1.0, 1.0)))
        keys["position"] = start.tolist()
    else:
        keys["direction"] = way.tolist()
        if kind == "sun":
            del keys["position"]
    return keys


def _point(world: WorldContents, target: Any) -> Floats:
    """Returns a point [3], or the centre of the object with this name."""
    if not isinstance(target, str):
        return floats("target", target, (3,), error=WorldError)
    names = {item.name: item.id for item in world.objects}
    if target not in names:
        raise WorldError(nearest("target object", target, list(names)), code="unknown_name")
    corners = world.triangles(names[target]).reshape(-1, 3)
    middle: Floats = (corners.min(axis=0) + corners.max(axis=0)) / 2
    return middle


def _edges(up: str, way: Floats, size: Any) -> tuple[list[float], list[float]]:
    """Returns the edges u and v of a rectangle of `size` (width, height).

    The rectangle's front, u x v, faces in the direction `way`.
    """
    width, height = floats("size", size, (2,), error=WorldError)
    forward = way / np.sqrt((way * way).sum())
    upward = np.array([0.0, 0, 1]) if up == "z" else np.array([0.0, 1, 0])
    if abs((forward * upward).sum()) > 0.999:
        upward = np.array([1.0, 0, 0])
    u = np.cross(upward, forward)
    u /= np.sqrt((u * u).sum())
    v = np.cross(forward, u)
    return (u * width).tolist(), (v * height).tolist()
