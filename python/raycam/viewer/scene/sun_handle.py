"""The handles of a sun: circles around the centre of the objects.

Dragging a circle turns the direction of the light.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ...arguments import Floats
from ...camera import Camera
from ...world import World
from ...world.framing import without_ground
from .gizmo import axis_length, dragged, handles
from .overlay import polylines

__all__ = ["center_of_objects", "sun_handles", "turn_sun"]

COLOR = "#ffd60a"
RAY_SHARE = 1.5
"""The length of the drawn ray, in axis lengths of the gizmo."""
DISC_SHARE = 0.12
"""The radius of the circle at the ray's start, in axis lengths of the gizmo."""
PIECES = 24


def center_of_objects(world: World) -> Floats:
    """Returns the centre [3] of the objects' bounds, without the ground, in metres.

    Returns the origin for a world without such objects.
    """
    bounds = without_ground(world).bounds
    return np.zeros(3) if bounds is None else np.asarray(bounds, float).mean(axis=0)


def sun_handles(center: Floats, direction: Floats, camera: Camera) -> list[dict[str, Any]]:
    """Returns the sun's ray to the centre, and the circles around the centre that turn the sun.

    The ray is drawn as a line.
    """
    length = axis_length(camera, center)
    begin = center - RAY_SHARE * length * np.asarray(direction, float) / np.linalg.norm(direction)
    turn = np.linspace(0, 2 * np.pi, PIECES + 1)[:, None]
    disc = begin + DISC_SHARE * length * (np.cos(turn) * camera.R[0] + np.sin(turn) * camera.R[1])
    ray = center + np.linspace(0, 1, PIECES + 1)[:, None] * (begin - center)
    drawn: list[dict[str, Any]] = [{"name": "", "color": COLOR, "lines": polylines([ray, disc], camera)}]
    return [each for each in drawn if each["lines"]] + handles(_placed(center), np.zeros(3), camera, "turn")


def turn_sun(
    center: Floats, direction: Floats, camera: Camera, handle: str, begin: Floats, end: Floats
) -> Floats:
    """Returns the direction [3] of a sun's light after a circle has been dragged.

    The circle `handle` is dragged from `begin` to `end`, in pixels from the image's top left corner.
    """
    turned = dragged(_placed(center), np.zeros(3), camera, "turn", handle, begin, end)
    return np.asarray(turned[:3, :3] @ np.asarray(direction, float))


def _placed(center: Floats) -> Floats:
    matrix = np.eye(4)
    matrix[:3, 3] = center
    return matrix
