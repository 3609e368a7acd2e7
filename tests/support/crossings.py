"""Crossings of rays and triangles by brute force and rational arithmetic.

The code does not use the core. A ray is moved by (e, e², e³) for an infinitesimal e. A value that is 0 gets
the sign of its first nonzero coefficient in e.
"""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Vector = list[Fraction]


def _exact(values: Floats) -> Vector:
    return [Fraction(float(x)) for x in values]


def _sub(a: Vector, b: Vector) -> Vector:
    return [x - y for x, y in zip(a, b, strict=True)]


def _cross(a: Vector, b: Vector) -> Vector:
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def _dot(a: Vector, b: Vector) -> Fraction:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _sign(value: Fraction, coefficients: Vector) -> int:
    for x in (value, *coefficients):
        if x != 0:
            return 1 if x > 0 else -1
    return 0


def crossing(corners: Floats, origin: Floats, direction: Floats) -> tuple[Fraction, int, bool] | None:
    """(t, side, is ahead of the moved start) for the moved line and a triangle.

    The side is 1 if the line leaves, and -1 if it enters.
    """
    o, d = _exact(origin), _exact(direction)
    points = [_exact(p) for p in corners]
    sides = set()
    for a, b in ((0, 1), (1, 2), (2, 0)):
        # d . ((a - o - m) x (b - o - m)) = d . (a - o) x (b - o) + m . (d x (b - a))
        value = _dot(d, _cross(_sub(points[a], o), _sub(points[b], o)))
        sides.add(_sign(value, _cross(d, _sub(points[b], points[a]))))
    if len(sides) != 1 or sides == {0}:
        return None
    side = sides.pop()
    normal = _cross(_sub(points[1], points[0]), _sub(points[2], points[0]))
    # n . (a - o - m): the start is in front of the plane if the sign equals that of n . d.
    height = _dot(normal, _sub(points[0], o))
    ahead = _sign(height, [-x for x in normal]) == side
    return height / _dot(normal, d), side, ahead


def crossings(triangles: Floats, origin: Floats, direction: Floats) -> list[tuple[Fraction, int, int]]:
    """(t, triangle, side) of all crossings ahead of the start, by t."""
    reach = np.abs(triangles - origin).max()
    # Triangles far from the line, found in float64 with a wide margin.
    a, b, c = (triangles[:, i] - origin for i in range(3))
    values = np.stack([np.cross(p, q) @ direction for p, q in ((a, b), (b, c), (c, a))])
    error = 1e-12 * reach**2 * np.abs(direction).max()
    near = (values >= -error).all(axis=0) | (values <= error).all(axis=0)
    found = []
    for number in np.flatnonzero(near):
        hit = crossing(triangles[number], origin, direction)
        if hit is not None and hit[2]:
            found.append((hit[0], int(number), hit[1]))
    return sorted(found)
