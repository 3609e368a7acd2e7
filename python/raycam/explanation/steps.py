"""The numbers of the lecture's steps for one pixel."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ..camera import Camera
from ..reference.units import Bools, Floats, Units
from ..world import World
from .lens import LensSteps

__all__ = ["Candidate", "PixelSteps"]


@dataclass(frozen=True)
class PlaneHit:
    """The intersection of the ray with a triangle's plane, which is step 3 of the procedure.

    Points and vectors are [3], in the explanation's units.
    """

    instance: int
    """The id of the object."""
    triangle: int
    """The id of the triangle within its object."""
    object_name: str
    """The name of the object."""
    color: Floats
    """The triangle's linear RGB, [3]."""
    a: Floats
    b: Floats
    c: Floats
    n: Floats
    """The normal of the plane, v2 x v1 = (c - a) x (b - a), not of unit length."""
    n_dot_a_minus_C: float
    n_dot_r: float
    t: float
    """The ray parameter n·(a - C) / n·r."""
    f: Floats
    """The intersection f(t) = C + t r of ray and plane."""


@dataclass(frozen=True)
class Candidate(PlaneHit):
    """A triangle that the ray may hit: the intersection of step 3 and the inside test of step 4."""

    v1: Floats
    """The edge b - a."""
    v2: Floats
    """The edge c - b."""
    v3: Floats
    """The edge a - c."""
    g: Floats
    """The point a + v3 of the plane, outside the triangle."""
    u: Floats
    """The segment g - f(t)."""
    along_u: Floats
    """The parameters s [3] of the intersections of f(t) + s u with the edges' lines; NaN for parallel lines."""
    along_edge: Floats
    """The parameters q [3] of the same points on the lines start + q edge; NaN for parallel lines."""
    crossed: Bools
    """True [3] for edges that the segment from f(t) to g crosses."""
    on_edge: Bools
    """True [3] for edges that contain f(t), up to rounding."""

    @property
    def crossings(self) -> int:
        """The number of crossed edges."""
        return int(self.crossed.sum())

    @property
    def inside(self) -> bool:
        """True if f(t) is inside: an odd number of crossings, or a point on an edge."""
        return self.crossings % 2 == 1 or bool(self.on_edge.any())

    @property
    def corners(self) -> Floats:
        """The corners a, b, c as [3, 3]."""
        return np.array([self.a, self.b, self.c])


@dataclass(frozen=True)
class RaySteps:
    """The numbers by which the lecture's procedure finds the ray of one pixel: steps 1 and 2.

    Lengths are in world units and points relative to the world's origin, unless the world is tiny, huge, or far from
    its origin. In these cases, they are in the local `units`.
    """

    world: World = field(repr=False, compare=False)
    camera: Camera = field(repr=False, compare=False)
    pixel: tuple[int, int]
    """The pixel as (column, row)."""
    units: Units
    P: Floats
    """The camera matrix, [3, 4], in the units of `units`."""
    x: Floats
    """The centre of the pixel, homogeneous, [3]."""
    M: Floats
    """The left 3 x 3 part of P."""
    det_M: float
    C: Floats
    """The camera centre, [3]."""
    X: Floats
    """The point P⁺ x on the pixel's line, homogeneous, [4]."""
    X_prime: Floats | None
    """The point `X` after division by the fourth coordinate, [3]; None if `X` is at infinity."""
    line: Floats
    """The vector X' - C, [3]; the direction of the line if X' is at infinity."""
    forward: Floats
    """The third row of R, [3], of unit length."""
    forward_dot_line: float
    """The dot product of `forward` and `line`; positive for X' in front of the camera."""
    r: Floats
    """The direction of the ray, [3]: `line` or its opposite."""


@dataclass(frozen=True)
class PixelSteps(RaySteps):
    """The numbers by which the lecture's procedure finds the colour of one pixel.

    These numbers are the fields of an `Explanation`.
    """

    triangles: int
    """The number of triangles in the world; the sum of the next four numbers and `inside`."""
    without_area: int
    parallel: int
    behind: int
    outside: int
    candidates: tuple[Candidate, ...]
    """The nearest hit triangles and the narrowest misses, by t."""
    winner: Candidate | None
    """The closest hit triangle; None for a miss."""
    color: Floats
    """Linear RGB of the pixel, [3]."""
    depth: float
    """The depth along the principal axis, in world units; +inf for a miss."""
    distance: float
    """The distance from C to f(t), in world units; +inf for a miss."""
    lens: LensSteps | None = None
    """The steps of the ray of a camera with a lens or parallel rays; None for a pinhole. `P` is then the matrix of a
    pinhole that has the same ray, and `r` has length 1."""

    @property
    def inside(self) -> int:
        """The number of triangles that the ray hits."""
        return self.triangles - self.without_area - self.parallel - self.behind - self.outside
