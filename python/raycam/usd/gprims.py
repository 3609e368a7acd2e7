"""Geometric primitives ("gprims") of USD as faces.

Sources: the schemas `UsdGeomCube`, `UsdGeomSphere`, `UsdGeomCylinder`, `UsdGeomCylinder_1`, `UsdGeomCone`,
`UsdGeomCapsule`, `UsdGeomCapsule_1` and `UsdGeomPlane`.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
from pxr import Usd

from .faces import Faces

__all__ = ["GPRIMS", "gprim_faces"]

SEGMENTS = 64
"""Number of sides of a polygon that replaces a circle; its edges are at least 0.9988 radii from the centre."""


def gprim_faces(prim: Usd.Prim, time: Usd.TimeCode) -> Faces:
    """The faces of a prim of a type in `GPRIMS`, in local coordinates.

    Raises `ValueError` if an attribute has no value, or a value of another type.
    """
    kind = prim.GetTypeName()
    names = GPRIMS[kind][1]
    values = [prim.GetAttribute(name).Get(time) for name in names]
    if not all(isinstance(value, float) for value in values):
        raise ValueError(f"{', '.join(names)} must be numbers")
    axis = str(prim.GetAttribute("axis").Get()) if prim.HasAttribute("axis") else "Z"
    return _build(kind, tuple(values), axis)


@functools.lru_cache(maxsize=64)
def _build(kind: str, values: tuple[float, ...], axis: str) -> Faces:
    return _align_axis(GPRIMS[kind][0](*values), axis, turned=kind != "Plane")


def _cube(size: float) -> Faces:
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    sides = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    return Faces(corners * size / 2, np.full(6, 4), np.array(sides).ravel())


def _plane(width: float, length: float) -> Faces:
    half = np.array([width, length, 0.0]) / 2
    square = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    return Faces(square * half, np.array([4]), np.arange(4))


def _sphere(radius: float) -> Faces:
    return _surface_of_revolution(_arc(-90, 90, radius, 0.0))


def _capsule(radius: float, height: float) -> Faces:
    half = height / 2
    side = [((radius, -half, 1, 0), (radius, half, 1, 0))]
    return _surface_of_revolution([*_arc(-90, 0, radius, -half), *side, *_arc(0, 90, radius, half)])


def _capsule_1(bottom: float, top: float, height: float) -> Faces:
    if bottom == top:
        return _capsule(bottom, height)
    if not height > 0:
        raise ValueError(f"height must be positive, got {height:g}")
    # The half spheres are tangent to the side, which is a cone, at the cone's rims.
    slope, half = (bottom - top) / height, height / 2
    latitude, stretch = float(np.degrees(np.arctan(slope))), float(np.hypot(1, slope))
    ball = (bottom * stretch, -half - bottom * slope)
    low = _arc(-90, min(latitude, 0), *ball) + (_arc(0, latitude, *ball) if latitude > 0 else [])
    ball = (top * stretch, half - top * slope)
    high = (_arc(latitude, 0, *ball) if latitude < 0 else []) + _arc(max(latitude, 0), 90, *ball)
    side = [(low[-1][1], high[0][0])]
    return _surface_of_revolution([*low, *side, *high])


def _cylinder(radius: float, height: float) -> Faces:
    return _frustum(radius, radius, height)


def _cone(radius: float, height: float) -> Faces:
    return _frustum(radius, 0.0, height)


def _frustum(bottom: float, top: float, height: float) -> Faces:
    half, slope = height / 2, np.array([height, bottom - top])
    out, up = slope / max(np.hypot(*slope), np.finfo(float).tiny)
    return _surface_of_revolution(
        [
            ((0.0, -half, 0, -1), (bottom, -half, 0, -1)),
            ((bottom, -half, out, up), (top, half, out, up)),
            ((top, half, 0, 1), (0.0, half, 0, 1)),
        ]
    )


Point = tuple[float, float, float, float]
"""A point of a profile: distance from the axis, height, and the normal's components along both."""


def _arc(first: float, last: float, radius: float, height: float) -> list[tuple[Point, Point]]:
    """The segments of an arc between two angles in degrees, from the bottom up."""
    count = max(1, round(SEGMENTS * (last - first) / 360))
    angles = np.radians(np.linspace(first, last, count + 1))
    # The poles are exactly on the axis.
    cosines, sines = np.where(np.isclose(np.abs(angles), np.pi / 2), 0.0, np.cos(angles)), np.sin(angles)
    points = [(radius * c, radius * s + height, c, s) for c, s in zip(cosines, sines, strict=True)]
    return list(pairwise(points))


def _surface_of_revolution(profile: list[tuple[Point, Point]]) -> Faces:
    """A surface of revolution about z; the profile's segments run upwards along its outside."""
    turns = np.arange(SEGMENTS) * 2 * np.pi / SEGMENTS
    x, y = np.cos(turns), np.sin(turns)
    corners: list[Any] = []
    normals: list[Any] = []
    counts: list[Any] = []
    for low, high in profile:
        rings: list[Any] = []
        sides: list[Any] = []
        for radius, height, out, up in (low, high):
            rings.append(np.column_stack([radius * x, radius * y, np.full(SEGMENTS, height)]))
            sides.append(np.column_stack([out * x, out * y, np.full(SEGMENTS, up)]))
        around = [(0, 0), (0, -1), (1, -1), (1, 0)]
        if low[0] == 0:
            around.remove((0, -1))
        if high[0] == 0:
            around.remove((1, -1))
        if len(around) < 3:
            continue
        for row, table in ((rings, corners), (sides, normals)):
            table.append(np.stack([np.roll(row[end], turn, axis=0) for end, turn in around], axis=1))
        counts.append(np.full(SEGMENTS, len(around)))
    all_corners, all_normals = (
        np.concatenate([piece.reshape(-1, 3) for piece in table]) for table in (corners, normals)
    )
    points, indices = np.unique(all_corners, axis=0, return_inverse=True)
    return Faces(points, np.concatenate(counts), indices.reshape(-1), all_normals)


def _align_axis(found: Faces, axis: str, turned: bool) -> Faces:
    """Rotates z to another axis; a plane keeps its width horizontal, as its schema defines."""
    order, signs = {
        ("X", True): ([2, 0, 1], [1, 1, 1]),
        ("Y", True): ([1, 2, 0], [1, 1, 1]),
        ("X", False): ([2, 1, 0], [1, 1, -1]),
        ("Y", False): ([0, 2, 1], [1, 1, -1]),
    }.get((axis, turned), ([0, 1, 2], [1, 1, 1]))
    moved = [None if table is None else table[:, order] * signs for table in (found.points, found.normals)]
    return found._replace(points=moved[0], normals=moved[1])


GPRIMS: dict[str, tuple[Callable[..., Faces], tuple[str, ...]]] = {
    "Cube": (_cube, ("size",)),
    "Sphere": (_sphere, ("radius",)),
    "Cylinder": (_cylinder, ("radius", "height")),
    "Cylinder_1": (_frustum, ("radiusBottom", "radiusTop", "height")),
    "Cone": (_cone, ("radius", "height")),
    "Capsule": (_capsule, ("radius", "height")),
    "Capsule_1": (_capsule_1, ("radiusBottom", "radiusTop", "height")),
    "Plane": (_plane, ("width", "length")),
}
"""For each prim type: the function that builds its faces, and the attributes that are its arguments."""
