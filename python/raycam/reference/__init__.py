"""The lecture's procedure in NumPy float64 by brute force: an independent check of raycam.

The reference shares no code with the Rust core.
Source: Nicholas Dwork, *Making Virtual Worlds* (Computer Graphics Lecture 1). Each step is one function with
the lecture's names, over arrays of points with x, y, z last; :mod:`raycam.explanation` prints their results
for one pixel.

1. ``X' = P⁺ x`` is some point on the pixel's line, the camera centre ``C`` is another, ``X' - C`` points
   along it: `points_on_lines`, `camera_center`, `lines`.
2. The third row of ``R`` points forward; ``r`` is ``X' - C`` or ``C - X'``, whichever agrees with it:
   `third_row_of_r`, `pointed_forward`. The ray is ``f(t) = C + t r``.
3. ``n = v2 x v1`` with ``v1 = b - a`` and ``v2 = c - a``; ``t = n·(a - C) / n·r``: `normals`,
   `plane_distances`. ``t < 0`` is discarded.
4. ``f(t)`` is inside the triangle if the segment from it to the distant point ``g = a + v3`` crosses an odd
   number of edges: `crossings`, `inside`; steps 3 and 4 together: `hit_distances`.
5. The closest triangle colours the pixel: `trace`, `render_triangles`, `render`.

The lecture leaves the degenerate cases open. Here they are decided so that the triangles of a closed mesh
leave no gap:

* ``X'`` may lie at infinity (its fourth coordinate is 0). It is then the direction of the line itself, and
  replaces ``X' - C``. The dot product with the third row of R is never 0: no pixel's line is in
  the plane through C parallel to the image.
* ``n·r = 0``, up to rounding: the ray is parallel to the plane. Discarded: a triangle seen edge-on is invisible.
* ``n = 0``, up to rounding: the triangle has no area. Discarded.
* ``t = 0``: C is on the triangle. Kept, because the lecture discards only negative t.
* ``f(t)`` on an edge or a vertex, up to rounding: inside, and so in every triangle that shares that edge or
  vertex.
* ``u`` through a vertex: an edge is crossed if one of its ends is strictly to the left of ``u`` and the
  other is not. A vertex on ``u`` counts as right of it for both of its edges: passing through the vertex adds
  one crossing, touching it adds none or two.
* ``u`` parallel to an edge: its ends are on the same side, so it is not crossed, and no division by zero occurs.
* Equal ``t``: the triangle that comes first, by (instance, triangle).
"""

from .picture import background, pixel_centers, render, render_triangles
from .procedure import (
    ROUNDING,
    Crossings,
    Trace,
    at_infinity,
    camera_center,
    cross,
    crossings,
    dot,
    edge_tolerance,
    edge_vectors,
    hit_distances,
    inside,
    length,
    lines,
    normals,
    plane_distances,
    pointed_forward,
    points_on_lines,
    third_row_of_r,
    trace,
)
from .units import Units

__all__ = [
    "ROUNDING",
    "Crossings",
    "Trace",
    "Units",
    "at_infinity",
    "background",
    "camera_center",
    "cross",
    "crossings",
    "dot",
    "edge_tolerance",
    "edge_vectors",
    "hit_distances",
    "inside",
    "length",
    "lines",
    "normals",
    "pixel_centers",
    "plane_distances",
    "pointed_forward",
    "points_on_lines",
    "render",
    "render_triangles",
    "third_row_of_r",
    "trace",
]
