"""Geoms of an `mjvScene` that a program adds to the model's own, such as markers and trajectories.

The proportions of arrows are those of `mjr_render`, measured on images of MuJoCo's renderer.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt

from ...arguments import Floats
from .materials import SurfaceValues
from .model import BOX, CAPSULE, CYLINDER, DECORATION, ELLIPSOID, PLANE, SPHERE
from .shapes import Shape, primitive_shape

__all__ = ["SceneGeom", "scene_geom"]

ARROW, ARROW_WITHOUT_HEAD, DOUBLE_ARROW, LINE, TRIANGLE = 100, 101, 102, 103, 108
"""Types of geoms that occur in scenes, but not in models (`mjtGeom`)."""
ARROWS = (ARROW, ARROW_WITHOUT_HEAD, DOUBLE_ARROW)
"""Types of geoms that are arrows along their z axis."""
HEAD_RADIUS_RATIO = 1.75
"""Radius of an arrow's head divided by the radius of its shaft."""
ARROW_SIDES = 32
"""Number of flat sides that approximate an arrow's round surface."""
MIN_SIZE_M = 1e-9
"""Minimum size of a geom in metres. Programs may set sizes to zero; such geoms are invisible."""


@dataclass(frozen=True)
class SceneGeom:
    """The shape, pose and look of a geom of a scene."""

    shape: Shape
    pose: Floats
    """Transform world_from_shape [4, 4]."""
    rgba: Floats
    values: SurfaceValues
    unlit: bool
    """True for lines, which have their plain colour."""
    casts_shadow: bool
    """False for lines, and for decorations, such as the geoms that `mjv_initGeom` creates."""
    element: tuple[int, int]
    """The type and id that the program gave to the geom, (0, 0) by default."""


def scene_geom(geom: Any, eye: Floats, pixel: float) -> SceneGeom | None:
    """Returns the description of an `mjvGeom`; None for types that are not shown.

    `eye` [3] is the camera's centre, and `pixel` the angle of a pixel in radians: the width of lines is in pixels.
    """
    kind, size = int(geom.type), np.asarray(geom.size, np.float64)
    pose = np.eye(4)
    pose[:3, :3] = np.asarray(geom.mat, np.float64).reshape(3, 3)
    pose[:3, 3] = geom.pos
    if kind == LINE:
        ends = pose[:3, 3] + [[0.0], [size[2]]] * pose[:3, 2]
        shape, pose = _line(ends, 0.5 * size[0] * pixel, eye), np.eye(4)
    else:
        found = _shape(kind, size if kind == PLANE else np.maximum(size, MIN_SIZE_M))
        if found is None:
            return None
        shape = found
    values = SurfaceValues(float(geom.emission), float(geom.specular), float(geom.shininess))
    rgba = np.asarray(geom.rgba, np.float64)
    casts_shadow = kind != LINE and int(geom.category) != DECORATION
    element = int(geom.objtype), int(geom.objid)
    return SceneGeom(shape, pose, rgba, values, kind == LINE, casts_shadow, element)


def _line(ends: Floats, half_angle: float, eye: Floats) -> Shape:
    """Returns a quad in world coordinates that faces the eye along a line with two ends [2, 3].

    Seen from the point `eye` [3], half of the quad's width covers `half_angle` in radians.
    """
    across = np.cross(ends[1] - ends[0], ends.mean(axis=0) - eye)
    across /= max(float(np.linalg.norm(across)), MIN_SIZE_M)
    sides = half_angle * np.linalg.norm(ends - eye, axis=1)[:, None] * across
    return _two_sided(np.concatenate([ends - sides, (ends + sides)[::-1]]))


def _two_sided(corners: Floats) -> Shape:
    """Returns a convex polygon that is visible from both sides."""
    count = len(corners)
    front = [[0, i, i + 1] for i in range(1, count - 1)]
    back = [[count, count + i + 1, count + i] for i in range(1, count - 1)]
    return Shape({"vertices": np.concatenate([corners, corners]), "triangles": [*front, *back]})


def _shape(kind: int, size: Floats) -> Shape | None:
    if kind in (CAPSULE, CYLINDER):
        return primitive_shape(kind, size[[0, 2, 1]])
    if kind in (PLANE, SPHERE, ELLIPSOID, BOX):
        return primitive_shape(kind, size)
    if kind in ARROWS:
        head = size[0] * (1.0 if kind == ARROW_WITHOUT_HEAD else HEAD_RADIUS_RATIO)
        shaft, tip = size[2] / 3, size[2] / 2
        upper = [[size[0], shaft], [head, shaft], [0.0, tip]]
        lower = [[radius, -height] for radius, height in reversed(upper)]
        return _revolved(
            np.array([*(lower if kind == DOUBLE_ARROW else [[0.0, 0.0], [size[0], 0.0]]), *upper])
        )
    if kind == TRIANGLE:
        return _two_sided(np.array([[0.0, 0.0, 0.0], [size[0], 0.0, 0.0], [0.0, size[1], 0.0]]))
    return None


def _revolved(profile: Floats) -> Shape:
    """Returns a surface of revolution about z, from radii and heights [n, 2] in upward order."""
    turns = 2 * np.pi * np.arange(ARROW_SIDES + 1) / ARROW_SIDES
    around = np.stack([np.cos(turns), np.sin(turns)], axis=1)
    vertices: list[list[list[float]]] = []
    normals: list[list[list[float]]] = []
    triangles: list[npt.NDArray[np.int64]] = []
    for (low_radius, low), (high_radius, high) in pairwise(profile.tolist()):
        slope = np.array([high - low, low_radius - high_radius])
        if not slope.any():
            continue
        slope /= np.linalg.norm(slope)
        first = 2 * (ARROW_SIDES + 1) * len(vertices) + np.arange(ARROW_SIDES)
        third = first + ARROW_SIDES + 1
        if low_radius > 0:
            triangles.append(np.stack([first, first + 1, third + 1], axis=1))
        if high_radius > 0:
            triangles.append(np.stack([first, third + 1, third], axis=1))
        rings = [(low_radius, low), (high_radius, high)]
        vertices.append([[radius * x, radius * y, height] for radius, height in rings for x, y in around])
        normals.append([[slope[0] * x, slope[0] * y, slope[1]] for _ in rings for x, y in around])
    keys = {"vertices": np.concatenate(vertices), "normals": np.concatenate(normals)}
    return Shape(keys | {"triangles": np.concatenate(triangles)})
