"""The lecture's procedure in NumPy float64, brute force: the oracle of raycam.

The reference shares no code with the Rust core.
Source: Nicholas Dwork, *Making Virtual Worlds* (Computer Graphics Lecture 1). Each step is one function with
the lecture's names, over arrays of points with x, y, z last; :mod:`raycam.explanation` prints what they return
for one pixel.

1. ``X' = P⁺ x`` is some point on the pixel's line, the camera centre ``C`` is another, ``X' - C`` points
   along it: `points_on_lines`, `camera_center`, `lines`.
2. The third row of ``R`` points forward; ``r`` is ``X' - C`` or ``C - X'``, whichever agrees with it:
   `third_row_of_r`, `pointed_forward`. The ray is ``f(t) = C + t r``.
3. ``n = v2 x v1`` with ``v1 = b - a`` and ``v2 = c - a``; ``t = n·(a - C) / n·r``: `normals`,
   `plane_distances`. ``t < 0`` is discarded.
4. ``f(t)`` is inside the triangle when the segment from it to the distant point ``g = a + v3`` crosses an odd
   number of edges: `crossings`, `inside`; steps 3 and 4 together: `hit_distances`.
5. The closest triangle colours the pixel: `trace`, `render_triangles`, `render`.

The lecture leaves the degenerate cases open. Here they are decided so that the triangles of a closed mesh
leave no gap:

* ``X'`` may lie at infinity (its fourth coordinate is 0). It is then the direction of the line itself, and
  takes the place of ``X' - C``. The dot product with the third row of R is never 0: no pixel's line lies in
  the plane through C parallel to the image.
* ``n·r = 0``, up to rounding: the ray runs along the plane. Discarded, a triangle seen edge-on shows nothing.
* ``n = 0``, up to rounding: the triangle has no area. Discarded.
* ``t = 0``: C lies on the triangle. Kept, because the lecture discards only negative t.
* ``f(t)`` on an edge or a vertex, up to rounding: inside, and so in every triangle that shares that edge or
  vertex.
* ``u`` through a vertex: an edge is crossed when one of its ends lies strictly to the left of ``u`` and the
  other does not. A vertex on ``u`` thus counts as right of it, for both of its edges: passing through adds
  one crossing, touching adds none or two.
* ``u`` parallel to an edge: its ends lie on the same side, it is not crossed, and nothing is divided by zero.
* Equal ``t``: the triangle that comes first, by (instance, triangle).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from .units import Bools, Floats, Units

if TYPE_CHECKING:
    from ..camera import Camera
    from ..world import World

Progress = Callable[[int, int], object]

# Rounding error of a few dozen additions and multiplications, relative to their operands.
ROUNDING = 32 * float(np.finfo(np.float64).eps)
# Pixels times triangles worked on at once: some tens of megabytes of temporary arrays.
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


# Step 1 and 2: a line through the pixel and the camera centre, pointed forward.


def camera_center(P: Floats) -> Floats:
    """C in the world, [3]: the null space of P, for P (C, 1) = 0.

    With P = [M | p4] that is M C = -p4, solved by elimination. (The last right-singular vector of P is (C, 1)
    as well, but loses digits with every factor between the units of its rows.)

    Raises ValueError when M has no inverse: the camera centre lies at infinity, or P has a rank below 3.
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
    """X' = P⁺ x for pixels [n, 2]: homogeneous points [n, 4] that P maps to their pixels x = (u, v, 1)."""
    x = np.column_stack([pixels, np.ones(len(pixels))])
    return dot(np.asarray(np.linalg.pinv(P), dtype=np.float64), x[:, None])


def third_row_of_r(P: Floats) -> Floats:
    """The third row of R, [3], a unit vector on the principal ray that points forward.

    In P = s K R [I | -C] the third row of K is (0, 0, 1), so the third row of M = s K R is s times that of R.
    The scale s is known but for its sign, which is that of det(M) = s³ det(K), as det(K) > 0 and det(R) = 1.
    """
    M = P[:, :3]
    sign = np.sign(np.linalg.det(M / np.linalg.norm(M, axis=1, keepdims=True)))
    return np.asarray(sign * M[2] / np.linalg.norm(M[2]))


def at_infinity(X: Floats) -> Bools:
    """True [n] for homogeneous points [n, 4] at infinity: their fourth coordinate is 0, up to rounding."""
    return np.asarray(np.abs(X[:, 3]) <= ROUNDING * length(X))


def lines(X: Floats, C: Floats) -> Floats:
    """X' - C for the homogeneous X' [n, 4], [n, 3]; for an X' at infinity, its first three coordinates."""
    infinite = at_infinity(X)[:, None]
    return np.where(infinite, X[:, :3], X[:, :3] / np.where(infinite, 1.0, X[:, 3:]) - C)


def pointed_forward(line: Floats, forward: Floats) -> Floats:
    """The rays r [n, 3]: each `line`, or its opposite if the dot product with `forward` is negative."""
    return np.where(dot(line, forward)[:, None] > 0, line, -line)


# Step 3: the plane containing the triangle.


def normals(triangles: Floats) -> Floats:
    """The normals n = v2 x v1 with v1 = b - a and v2 = c - a, [n, 3], of triangles [n, 3, 3]. Zero for zero area."""
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
    """The crossings of the segment from f to g with a triangle's edges; [...] is the shape of the points."""

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
    """True [..., 3] for the edges that f lies on, up to rounding."""

    @property
    def count(self) -> npt.NDArray[np.int64]:
        """The number of crossings, [...]."""
        return np.asarray(self.crossed.sum(axis=-1))


def edge_vectors(triangles: Floats) -> Floats:
    """The edges v1 = b - a, v2 = c - b, v3 = a - c, [..., edge, 3], of triangles [..., 3, 3]."""
    return np.roll(triangles, -1, axis=-2) - triangles


def crossings(triangles: Floats, n: Floats, f: Floats, tolerance: Floats) -> Crossings:
    """Intersects the segment from `f` to g = a + v3 with the edges of the triangle in whose plane `f` lies.

    `triangles` [..., 3, 3], their normals `n` [..., 3] and points `f` [..., 3] go one to one. A point as near
    to an edge as `tolerance` [...], a length, lies on it.
    """
    edges = edge_vectors(triangles)
    starts = triangles - f[..., None, :]
    g = triangles[..., 0, :] + edges[..., 2, :]
    u = g - f
    # In the plane, n x u is u turned by 90 degrees: its dot product says on which side of u a vertex lies.
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
    """Bound on the rounding error of `f` within the plane, a length [...]; points this near to an edge lie on it.

    The coordinates round. The more oblique the ray, the more of that error lies within the plane.
    """
    size = np.abs(triangles).max(axis=(-2, -1)) + np.abs(C).max() + np.abs(f).max(axis=-1)
    cosine = np.abs(dot(n, r)) / (np.where(dot(n, n) > 0, length(n), 1.0) * length(r))
    return np.asarray(ROUNDING * size / np.where(cosine > 0, cosine, 1.0))


# Step 5: the closest triangle.


@dataclass(frozen=True)
class Trace:
    """The hits of rays. Every array has one entry per ray, in order."""

    index: npt.NDArray[np.int64]
    """The closest triangle, -1 for none."""
    t: Floats
    """The parameter of the hit point f(t) = C + t r; +inf for a miss."""
    next_t: Floats
    """The t of the second closest triangle; +inf for none."""


def trace(triangles: Floats, C: Floats, r: Floats, progress: Progress | None = None) -> Trace:
    """The closest of all `triangles` [n, 3, 3] for rays from `C` [3] along `r` [m, 3], by trying every one.

    Memory stays bounded whatever n and m are. Equal t goes to the triangle that comes first. `progress(done, total)`
    is told how many rays are done.
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
            # The two smallest t of old and new ones; argmin takes the first among equals.
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


# The whole picture.


def pixel_centers(size: tuple[int, int], pixel_center: str = "integer") -> Floats:
    """The centre (u, v) of every pixel, [height * width, 2], row by row; `size` is (width, height).

    The first pixel's centre is (0, 0) for `pixel_center` "integer", (0.5, 0.5) for "half".
    """
    if pixel_center not in ("integer", "half"):
        raise ValueError(f'pixel_center must be "integer" or "half", not {pixel_center!r}')
    width, height = size
    v, u = np.mgrid[0:height, 0:width]
    return np.column_stack([u.ravel(), v.ravel()]) + (0.5 if pixel_center == "half" else 0.0)


def render_triangles(
    triangles: npt.ArrayLike,
    P: npt.ArrayLike,
    size: tuple[int, int],
    *,
    pixel_center: str = "integer",
    colors: npt.ArrayLike | None = None,
    ids: npt.ArrayLike | None = None,
    background: npt.ArrayLike = (0.0, 0.0, 0.0),
    progress: Progress | None = None,
) -> dict[str, npt.NDArray[Any]]:
    """A picture of triangles by the lecture's procedure, one exact ray through each pixel's centre.

    `triangles` are corners [n, 3, 3] in the world, `P` is the camera matrix [3, 4], finite, of rank 3, of any
    scale and sign. `size` is (width, height). `colors` [n, 3] are linear RGB per triangle (default white),
    `ids` [n, 2] are (instance, triangle) (default: instance 0 and the place in `triangles`). `progress(done, total)` is
    told how many pixels are done; an exception that it raises stops the picture.

    Returns arrays [height, width, ...]:

    ============ ======= ========================================================================== ==========
    color        float32 [..., 3], linear RGB of the closest triangle                               background
    depth        float64 z of the hit point along the principal axis, in units of the world          +inf
    distance     float64 from the camera centre to the hit point, in units of the world              +inf
    position     float64 [..., 3], the hit point in the world                                        NaN
    instance     int32   first column of `ids`                                                       -1
    triangle     int32   second column of `ids`                                                      -1
    t            float64 the lecture's t, in lengths of r (which differ from pixel to pixel)         +inf
    next_t       float64 the t of the second closest triangle                                        +inf
    ============ ======= ========================================================================== ==========

    Raises ValueError if an array has the wrong shape or is not finite, or if P has no camera centre.
    """
    corners = _floats("triangles", triangles, (-1, 3, 3))
    matrix = _floats("P", P, (3, 4))
    rgb = np.ones((len(corners), 3)) if colors is None else _floats("colors", colors, (len(corners), 3))
    if ids is None:
        ids = np.column_stack([np.zeros(len(corners)), np.arange(len(corners))])
    names = np.asarray(ids, dtype=np.int32).reshape(len(corners), 2)

    units = Units.for_world(corners.reshape(-1, 3), camera_center(matrix))
    matrix = units.camera(matrix)
    C = camera_center(matrix)
    forward = third_row_of_r(matrix)
    X = points_on_lines(matrix, pixel_centers(size, pixel_center))
    r = pointed_forward(lines(X, C), forward)
    seen = trace(units.points(corners), C, r, progress)

    hit = seen.index >= 0
    t = np.where(hit, seen.t, 0.0)
    f = C + t[:, None] * r
    row = np.where(hit, seen.index, 0)
    last = np.zeros((1, 3))  # lets a world without triangles be indexed too
    color = np.where(hit[:, None], np.vstack([rgb, last])[row], _floats("background", background, (3,)))
    name = np.where(hit[:, None], np.vstack([names, last.astype(np.int32)[:, :2]])[row], -1)

    def image(values: npt.NDArray[Any], dtype: npt.DTypeLike) -> npt.NDArray[Any]:
        return values.reshape(size[1], size[0], *values.shape[1:]).astype(dtype)

    def where_hit(values: Floats, miss: float) -> Floats:
        return np.where(hit.reshape(-1, *[1] * (values.ndim - 1)), values, miss)

    return {
        "color": image(color, np.float32),
        "depth": image(where_hit((t * dot(r, forward)) * units.scale, np.inf), np.float64),
        "distance": image(where_hit(t * length(r) * units.scale, np.inf), np.float64),
        "position": image(where_hit(units.origin + f * units.scale, np.nan), np.float64),
        "instance": image(name[:, 0], np.int32),
        "triangle": image(name[:, 1], np.int32),
        "t": image(seen.t, np.float64),
        "next_t": image(seen.next_t, np.float64),
    }


def render(world: World, camera: Camera, progress: Progress | None = None) -> dict[str, npt.NDArray[Any]]:
    """`render_triangles` of a :class:`raycam.World` seen by a :class:`raycam.Camera`.

    A triangle has one colour: its object's, its face's, or the mean of its vertex colours. Raises
    :class:`raycam.CameraError` for a camera with a lens, which P does not describe.
    """
    camera._require_pinhole("the reference")
    return render_triangles(
        world.triangles(),
        camera.P,
        camera.size,
        pixel_center=camera.pixel_center,
        colors=world.triangle_colors(),
        ids=world.triangle_ids(),
        background=background(world),
        progress=progress,
    )


def background(world: World) -> Floats:
    """Linear RGB [3] of a pixel without a hit: the sum of the uniform skies; other skies count as black."""
    skies = [light["radiance"] for light in world.lights if light["type"] == "sky" and "radiance" in light]
    return np.asarray(np.sum(np.asarray(skies, dtype=np.float64).reshape(-1, 3), axis=0))


def _floats(name: str, values: npt.ArrayLike, shape: tuple[int, ...]) -> Floats:
    array = np.asarray(values, dtype=np.float64)
    fits = array.ndim == len(shape) and all(w in (-1, n) for w, n in zip(shape, array.shape, strict=True))
    if not fits:
        wanted = ", ".join("n" if side == -1 else str(side) for side in shape)
        raise ValueError(f"{name} must be [{wanted}], not {list(array.shape)}")
    if not np.isfinite(array).all():
        raise ValueError(f"{name} must be finite, but {np.count_nonzero(~np.isfinite(array))} are not")
    return array
