"""The steps of the lecture's procedure, each as one function with the lecture's names."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from .units import Bools, Floats

Progress = Callable[[int, int], object]

# Rounding error of a few dozen additions and multiplications, relative to their operands.
ROUNDING = 32 * float(np.finfo(np.float64).eps)
# Number of ray-triangle pairs per block; their temporary arrays need some tens of megabytes.
PAIRS_AT_ONCE = 1 << 16


def dot(a: Floats, b: Floats) -> Floats:
    """The dot product over the last axis."""
    return np.asarray(np.einsum("...i,...i->...", a, b))


def cross(a: Floats, b: Floats) -> Floats:
    """The cross product over the last axis."""
    ax, ay, az = a[..., 0], a[..., 1], a[..., 2]
    bx, by, bz = b[..., 0], b[..., 1], b[..., 2]
    return np.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], axis=-1)


def length(a: Floats) -> Floats:
    """The Euclidean length over the last axis."""
    return np.asarray(np.sqrt(dot(a, a)))


# Steps 1 and 2: a line through the pixel and the camera centre, pointed forward.


def camera_center(P: Floats) -> Floats:
    """C in the world, [3]: the null space of P, for P (C, 1) = 0.

    With P = [M | p4], M C = -p4 is solved by elimination. (The last right-singular vector of P is also
    proportional to (C, 1), but loses digits if the rows of P have different units.)

    Raises ValueError if M has no inverse: the camera centre is at infinity, or P has a rank below 3.
    """
    M = P[:, :3]
    rows = np.linalg.norm(M, axis=1, keepdims=True)
    if not (np.isfinite(P).all() and (rows > 0).all() and np.linalg.cond(M / rows) < 1 / ROUNDING):
        raise ValueError(
            "P has no camera centre: its left 3 x 3 block must be finite and invertible, "
            f"but P is\n{np.array2string(P)}"
        )
    return np.asarray(np.linalg.solve(M, -P[:, 3]))


def points_on_lines(P: Floats, pixels: Floats) -> Floats:
    """The points X' = P⁺ x for the pixels x = (u, v, 1).

    Points are homogeneous, [n, 4], and P maps them to their pixels [n, 2].
    """
    x = np.column_stack([pixels, np.ones(len(pixels))])
    return dot(np.asarray(np.linalg.pinv(P), dtype=np.float64), x[:, None])


def third_row_of_r(P: Floats) -> Floats:
    """The third row of R, [3], a unit vector on the principal ray that points forward.

    In P = s K R [I | -C] the third row of K is (0, 0, 1), so the third row of M = s K R is s times the third row of R.
    The signs of s and det(M) = s³ det(K) are equal, because det(K) > 0 and det(R) = 1.
    """
    M = P[:, :3]
    sign = np.sign(np.linalg.det(M / np.linalg.norm(M, axis=1, keepdims=True)))
    return np.asarray(sign * M[2] / np.linalg.norm(M[2]))


def at_infinity(X: Floats) -> Bools:
    """True [n] for homogeneous points [n, 4] whose fourth coordinate is 0, up to rounding."""
    return np.asarray(np.abs(X[:, 3]) <= ROUNDING * length(X))


def lines(X: Floats, C: Floats) -> Floats:
    """The directions X' - C [n, 3] for the homogeneous points X' [n, 4].

    For a point at infinity, the direction is its first three coordinates.
    """
    infinite = at_infinity(X)[:, None]
    return np.where(infinite, X[:, :3], X[:, :3] / np.where(infinite, 1.0, X[:, 3:]) - C)


def pointed_forward(line: Floats, forward: Floats) -> Floats:
    """The rays r [n, 3]: each `line`, or its opposite, so that the ray points forward.

    A line is reversed if its dot product with `forward` is not positive.
    """
    return np.where(dot(line, forward)[:, None] > 0, line, -line)


# Step 3: the plane containing the triangle.


def normals(triangles: Floats) -> Floats:
    """The normals n = v2 x v1 [n, 3] of triangles [n, 3, 3].

    Here, v1 = b - a and v2 = c - a. The normal of a triangle without area is zero.
    """
    v1 = triangles[:, 1] - triangles[:, 0]
    v2 = triangles[:, 2] - triangles[:, 0]
    n = cross(v2, v1)
    flat = length(n) <= ROUNDING * length(v1) * length(v2)
    return np.where(flat[:, None], 0.0, n)


def plane_distances(n: Floats, a: Floats, C: Floats, r: Floats) -> Floats:
    """The parameters t = n·(a - C) / n·r, [rays, triangles]; NaN if n·r = 0.

    `n` and `a` are [triangles, 3], `C` is [3], `r` is [rays, 3]; t counts in lengths of r.
    """
    numerator = dot(n, a - C)
    denominator = dot(n, r[:, None])
    parallel = np.abs(denominator) <= ROUNDING * length(r)[:, None] * length(n)
    return np.where(parallel, np.nan, numerator / np.where(parallel, 1.0, denominator))


# Step 4: inside or outside, by crossings.


@dataclass(frozen=True)
class Crossings:
    """The crossings of the segment from f to g with a triangle's edges.

    In the shapes of the arrays, ... is the shape of the points.
    """

    g: Floats
    """The distant point a + v3, [..., 3]."""
    u: Floats
    """The segment g - f, [..., 3]."""
    along_u: Floats
    """The parameters s of the intersections of f + s u with the lines of v1, v2, v3, [..., 3]; NaN for parallels."""
    along_edge: Floats
    """The parameters q of the same points along the edges, start + q edge, [..., 3]; NaN for parallels."""
    crossed: Bools
    """True [..., 3] for the edges that the segment from f to g crosses."""
    on_edge: Bools
    """True [..., 3] for the edges that contain f, up to rounding."""

    @property
    def count(self) -> npt.NDArray[np.int64]:
        """The number of crossings, [...]."""
        return np.asarray(self.crossed.sum(axis=-1))


def edge_vectors(triangles: Floats) -> Floats:
    """The edges v1 = b - a, v2 = c - b, v3 = a - c, [..., edge, 3], of triangles [..., 3, 3]."""
    return np.roll(triangles, -1, axis=-2) - triangles


def crossings(triangles: Floats, n: Floats, f: Floats, tolerance: Floats) -> Crossings:
    """Intersects the segment from `f` to g = a + v3 with the edges of a triangle.

    The point `f` is in the triangle's plane. `triangles` [..., 3, 3], their normals `n` [..., 3] and points `f` [...,
    3] correspond one to one. A point whose distance from an edge is at most `tolerance` [...] counts as on the edge.
    """
    edges = edge_vectors(triangles)
    starts = triangles - f[..., None, :]
    g = triangles[..., 0, :] + edges[..., 2, :]
    u = g - f
    # In the plane, left = n x u is u turned by 90 degrees. The sign of left · x is the side of u on
    # which x lies.
    left = cross(n, u)
    side = dot(left[..., None, :], starts)
    end_side = np.roll(side, -1, axis=-1)
    straddles = (side > 0) != (end_side > 0)
    parallel = side == end_side
    along_edge = np.where(parallel, np.nan, side / np.where(parallel, 1.0, side - end_side))
    meets = starts + along_edge[..., None] * edges
    u2 = dot(u, u)[..., None]
    along_u = dot(meets, u[..., None, :]) / np.where(u2 > 0, u2, 1.0)
    crossed = straddles & (along_u >= 0) & (along_u <= 1)

    edge_length = length(edges)
    safe_length = np.where(edge_length > 0, edge_length, 1.0)
    normal_length = np.where(dot(n, n) > 0, length(n), 1.0)[..., None]
    beside = np.abs(dot(cross(n[..., None, :], edges), starts)) / (safe_length * normal_length)
    along = dot(-starts, edges) / safe_length
    near = tolerance[..., None]
    on_edge = (beside <= near) & (along >= -near) & (along <= edge_length + near)
    return Crossings(g, u, along_u, along_edge, crossed, on_edge)


def inside(found: Crossings) -> Bools:
    """True for points inside their triangles: an odd number of crossings, or on an edge."""
    return np.asarray((found.count % 2 == 1) | found.on_edge.any(axis=-1))


def edge_tolerance(triangles: Floats, n: Floats, C: Floats, r: Floats, f: Floats) -> Floats:
    """Bound [...] on the rounding error of `f` within the plane of the triangle.

    Points this close to an edge count as on the edge. The coordinates are rounded. The more oblique the ray, the larger
    the part of this error within the plane.
    """
    size = np.abs(triangles).max(axis=(-2, -1)) + np.abs(C).max() + np.abs(f).max(axis=-1)
    cosine = np.abs(dot(n, r)) / (np.where(dot(n, n) > 0, length(n), 1.0) * length(r))
    return np.asarray(ROUNDING * size / np.where(cosine > 0, cosine, 1.0))


# Step 5: the closest triangle.


@dataclass(frozen=True)
class Trace:
    """The hits of rays. Every array has one entry per ray, in order."""

    index: npt.NDArray[np.int64]
    """The closest triangle's index; -1 if the ray hits no triangle."""
    t: Floats
    """The parameter of the hit point f(t) = C + t r; +inf for a miss."""
    next_t: Floats
    """The t of the second closest triangle; +inf if there is no second triangle."""


def trace(triangles: Floats, C: Floats, r: Floats, progress: Progress | None = None) -> Trace:
    """Returns the closest of `triangles` [n, 3, 3] for each ray, by testing all triangles.

    Rays start at `C` [3] and have the directions `r` [m, 3]. Memory is bounded for any n and m. Of triangles with equal
    t, the first one is returned. `progress(done, total)` is called with the number of finished rays.
    """
    n = normals(triangles)
    index = np.full(len(r), -1, dtype=np.int64)
    t = np.full(len(r), np.inf)
    next_t = np.full(len(r), np.inf)
    triangle_block = max(1, min(len(triangles), PAIRS_AT_ONCE))
    ray_block = max(1, PAIRS_AT_ONCE // triangle_block)
    for i in range(0, len(r), ray_block):
        rays = slice(i, i + ray_block)
        for j in range(0, len(triangles), triangle_block):
            some = slice(j, j + triangle_block)
            found = hit_distances(triangles[some], n[some], C, r[rays])
            # The two smallest t of the old and the new triangles; argmin returns the first of equal values.
            first = found.argmin(axis=1)
            nearest = np.take_along_axis(found, first[:, None], axis=1)[:, 0]
            np.put_along_axis(found, first[:, None], np.inf, axis=1)
            second = found.min(axis=1)
            closer = nearest < t[rays]
            next_t[rays] = np.minimum(np.maximum(nearest, t[rays]), np.minimum(second, next_t[rays]))
            index[rays] = np.where(closer, first + j, index[rays])
            t[rays] = np.where(closer, nearest, t[rays])
        if progress is not None:
            progress(min(i + ray_block, len(r)), len(r))
    return Trace(index, t, next_t)


def hit_distances(triangles: Floats, n: Floats, C: Floats, r: Floats) -> Floats:
    """The parameters t of every ray with every triangle, [rays, triangles]; +inf for a miss."""
    t = plane_distances(n, triangles[:, 0], C, r)
    in_front = t >= 0
    f = C + np.where(in_front, t, 0.0)[..., None] * r[:, None]
    tolerance = edge_tolerance(triangles, n, C, r[:, None], f)
    return np.where(in_front & inside(crossings(triangles, n, f, tolerance)), t, np.inf)
