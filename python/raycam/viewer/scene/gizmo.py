"""The gizmo: handles on an object, drawn as lines over the image.

Dragging a handle changes the matrix of the object.

All computations use rays through pixels, so they apply to every lens.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ...arguments import Floats
from ...camera import Camera
from ...world import World
from .contents import matrix_of_object
from .overlay import AXES, polylines
from .rotation import rotation_about

__all__ = ["COLORS", "HANDLES", "TOOLS", "axis_length", "dragged", "handles", "middle_of", "point_on_plane"]

TOOLS = ("move", "turn", "scale")
HANDLES = ("x", "y", "z", "all")
COLORS = {**AXES, "all": "#ffffff"}
LENGTH = 90.0  # length in pixels of an axis in an image without distortion
PIECES = 32
LEAST, MOST = 0.01, 100.0  # limits of a drag's scale factor
EDGE_ON = 0.08  # cosine between view and axis below which a rotation follows the pointer's path


def middle_of(world: World, number: int) -> Floats:
    """The centre [3] of an object's bounds in its mesh's coordinates."""
    corners = world.triangles(number).reshape(-1, 3)
    matrix = matrix_of_object(world, number)
    if not len(corners):
        return np.zeros(3)
    middle = (corners.min(axis=0) + corners.max(axis=0)) / 2
    return np.asarray(np.linalg.solve(matrix, np.append(middle, 1.0))[:3])


def handles(matrix: Floats, middle: Floats, camera: Camera, tool: str) -> list[dict[str, Any]]:
    """Name, colour and lines (in pixels) of each handle of an object.

    `matrix` is the matrix of the object, `middle` the centre of its mesh.
    """
    center = placed(matrix, middle)
    length = axis_length(camera, center)
    axes = axes_of(matrix, tool)
    made = []
    for name, axis in zip(HANDLES, axes, strict=False):
        points = _circle(center, axes, axis, length) if tool == "turn" else _arrow(center, axis, length)
        made.append(
            {"name": name, "color": COLORS[name], "handle": name, "lines": polylines([points], camera)}
        )
    if tool != "turn":
        ring = _circle(center, camera.R, camera.R[2], 0.22 * length)
        made.append({"name": "", "color": COLORS["all"], "handle": "all", "lines": polylines([ring], camera)})
    return [each for each in made if each["lines"]]


def dragged(
    matrix: Floats, middle: Floats, camera: Camera, tool: str, handle: str, begin: Floats, end: Floats
) -> Floats:
    """The matrix [4, 4] after a drag of a handle between two positions.

    `begin` and `end` are the positions in pixels from the image's top left corner. `handle` is the handle's name.
    """
    center = placed(matrix, middle)
    rays = [camera.rays(np.asarray(at) + camera.corner) for at in (begin, end)]
    if not all(np.isfinite(direction).all() for _, direction in rays):
        return matrix
    step = np.eye(4)
    if tool == "move":
        step[:3, 3] = _shift(rays, center, handle, camera)
        return np.asarray(step @ matrix)
    if handle == "all":
        if tool == "turn":
            return matrix
        before, after = (
            float(np.linalg.norm(np.asarray(at) - _pixel(camera, center))) for at in (begin, end)
        )
        step[:3, :3] *= _ratio(before, after)
    else:
        axis = axes_of(matrix, tool)[HANDLES.index(handle)]
        if tool == "turn":
            step[:3, :3] = rotation_about(axis, _angle(rays, center, axis, begin, end))
        else:
            factor = _ratio(_along(rays[0], center, axis), _along(rays[1], center, axis))
            step[:3, :3] += (factor - 1) * np.outer(axis, axis)
    step[:3, 3] = center - step[:3, :3] @ center
    return np.asarray(step @ matrix)


def placed(matrix: Floats, middle: Floats) -> Floats:
    """The centre [3] of an object in the world."""
    return np.asarray(matrix)[:3, :3] @ middle + np.asarray(matrix)[:3, 3]


def axes_of(matrix: Floats, tool: str) -> Floats:
    """Returns the handles' axes [3, 3]: the world's axes, or the object's for the tool "scale".

    A scale along the object's axes does not shear the object.
    """
    if tool != "scale":
        return np.eye(3)
    left, _, right = np.linalg.svd(np.asarray(matrix)[:3, :3])
    return np.asarray((left @ right).T)


def axis_length(camera: Camera, center: Floats) -> float:
    """The length of a gizmo's axis at a point, metres."""
    focal = math.sqrt(abs(camera.K[0, 0] * camera.K[1, 1]))
    away = 1.0 if camera.is_parallel else float(np.linalg.norm(center - camera.location))
    return LENGTH * max(away, 1e-9) / focal


def _arrow(center: Floats, axis: Floats, length: float) -> Floats:
    return np.asarray(center + np.linspace(0.25, 1, 9)[:, None] * length * axis)


def _circle(center: Floats, axes: Floats, axis: Floats, radius: float) -> Floats:
    """Points [n, 3] of a circle around one of the `axes`."""
    first, second = (each for each in axes if abs(float(each @ axis)) < 0.5)
    turn = np.linspace(0, 2 * np.pi, PIECES + 1)[:, None]
    return np.asarray(center + radius * (np.cos(turn) * first + np.sin(turn) * second))


def _pixel(camera: Camera, point: Floats) -> Floats:
    return np.asarray(camera.project(point)[0]) - camera.corner


def _along(ray: tuple[Floats, Floats], center: Floats, axis: Floats) -> float:
    """The position on the axis nearest to a ray, in metres from `center`."""
    origin, direction = ray
    cosine = float(axis @ direction)
    away = center - origin
    rest = 1 - cosine * cosine
    if rest < 1e-6:
        return 0.0
    return float(cosine * (away @ direction) - away @ axis) / rest


def _shift(rays: list[tuple[Floats, Floats]], center: Floats, handle: str, camera: Camera) -> Floats:
    """Returns the displacement of an object that follows the pointer.

    The displacement is along an axis, or parallel to the image plane.
    """
    if handle != "all":
        axis = np.eye(3)[HANDLES.index(handle)]
        first, second = (_along(ray, center, axis) for ray in rays)
        return np.asarray((second - first) * axis)
    points = [point_on_plane(ray, center, camera.forward) for ray in rays]
    return np.zeros(3) if points[0] is None or points[1] is None else points[1] - points[0]


def point_on_plane(ray: tuple[Floats, Floats], center: Floats, normal: Floats) -> Floats | None:
    """The point [3] where a ray meets the plane through `center`, or None."""
    origin, direction = ray
    slope = float(direction @ normal)
    if abs(slope) < 1e-9:
        return None
    t = float((center - origin) @ normal) / slope
    return np.asarray(origin + t * direction) if t > 0 else None


def _angle(
    rays: list[tuple[Floats, Floats]], center: Floats, axis: Floats, begin: Floats, end: Floats
) -> float:
    """Returns the angle by which the pointer turns around an axis, in radians.

    If the circle is seen edge-on, the angle results from the pointer's path in pixels.
    """
    spokes = [point_on_plane(ray, center, axis) for ray in rays]
    if abs(float(rays[0][1] @ axis)) < EDGE_ON or spokes[0] is None or spokes[1] is None:
        way = np.asarray(end) - np.asarray(begin)
        return float(0.01 * (way[0] - way[1]))
    first, second = (spoke - center for spoke in spokes if spoke is not None)
    return math.atan2(float(np.cross(first, second) @ axis), float(first @ second))


def _ratio(before: float, after: float) -> float:
    if abs(before) < 1e-12:
        return 1.0
    return float(min(max(after / before, LEAST), MOST))
