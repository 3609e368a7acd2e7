"""The handle of a light on the floor.

Dragging the circle below the light moves the light horizontally.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ...arguments import Floats
from ...camera import Camera
from ...world import World
from .gizmo import axis_length, point_on_plane
from .overlay import polylines
from .rotation import up_axis

__all__ = ["FLOOR_HANDLE", "drag_on_floor", "floor_handle"]

FLOOR_HANDLE = "floor"
COLOR = "#ffd60a"
RADIUS_SHARE = 0.3
"""The circle's radius, as a share of the length of an axis of the gizmo."""
CIRCLE_PIECES = 32
LINE_PIECES = 8
MAX_DRAG_DISTANCE = 100.0
"""Maximum movement in one drag, as a multiple of the distance from the camera to the circle."""


def floor_handle(world: World, position: Floats, camera: Camera) -> list[dict[str, Any]]:
    """Returns the circle on the floor below a position, and a thin line up to the position.

    Both are lines over an image. The floor is the lowest height of the world's objects.
    """
    up, foot = up_axis(world.up), _foot(world, position)
    sides = np.eye(3)[[axis for axis in range(3) if not up[axis]]]
    turn = np.linspace(0, 2 * np.pi, CIRCLE_PIECES + 1)[:, None]
    radius = RADIUS_SHARE * axis_length(camera, foot)
    circle = polylines([foot + radius * (np.cos(turn) * sides[0] + np.sin(turn) * sides[1])], camera)
    line = polylines([foot + np.linspace(0, 1, LINE_PIECES + 1)[:, None] * (position - foot)], camera)
    made: list[dict[str, Any]] = [
        {"name": "", "color": COLOR, "handle": FLOOR_HANDLE, "lines": circle},
        {"name": "", "color": COLOR, "thin": True, "lines": line},
    ]
    return [each for each in made if each["lines"]]


def drag_on_floor(world: World, position: Floats, camera: Camera, begin: Floats, end: Floats) -> Floats:
    """Returns a position [3] moved parallel to the floor.

    The circle below the position follows the pointer. `begin` and `end` are pixels from the image's top left corner.
    The position does not change if `begin` or `end` is above the horizon, or shows a point of the floor that is very
    far away.
    """
    up, foot = up_axis(world.up), _foot(world, position)
    rays = [camera.rays(at + camera.corner) for at in (begin, end)]
    if not all(np.isfinite(direction).all() for _, direction in rays):
        return position
    first, second = (point_on_plane(ray, foot, up) for ray in rays)
    if first is None or second is None:
        return position
    distance = float(np.linalg.norm(second - first))
    limit = MAX_DRAG_DISTANCE * max(float(np.linalg.norm(foot - camera.location)), 1e-9)
    return position if distance > limit else np.asarray(position + (second - first))


def _foot(world: World, position: Floats) -> Floats:
    """The point [3] of the floor below or above a position."""
    up = up_axis(world.up)
    height = 0.0 if world.bounds is None else float(world.bounds[0] @ up)
    return np.asarray(position + (height - position @ up) * up)
