"""An explanation as text: the lecture's formulas, each followed by its numbers."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from .digits import DIGITS, number, srgb, vector
from .lens import lens_section
from .steps import Candidate, PixelSteps

EDGES = (("v1", "a"), ("v2", "b"), ("v3", "c"))


def text(explanation: PixelSteps) -> str:
    """The text of all steps."""
    return "\n".join(
        [
            *title(explanation),
            *ray_section(explanation),
            *triangles_section(explanation),
            *color_section(explanation),
        ]
    )


def title(e: PixelSteps) -> Iterator[str]:
    """The title and an introduction."""
    width, height = e.camera.size
    yield f"Pixel ({e.pixel[0]}, {e.pixel[1]}) of a {width} x {height} image, by the steps of the lecture"
    yield ""
    yield "Vectors are (x, y, z); · is the dot product, x between vectors the cross product."
    yield f"{DIGITS} digits are printed, 16 were used: by hand, the last printed digits may differ."
    if not e.units.are_ordinary:
        yield ""
        yield "P⁺ combines lengths with the number 1, and would lose digits in a world this small, large"
        yield "or far from its origin. Below, points are therefore relative to"
        yield f"{vector(e.units.origin)}of the world, in units of {number(e.units.scale)}."


def ray_section(e: PixelSteps) -> Iterator[str]:
    """The lines of steps 1 and 2, the ray."""
    if e.lens is not None:
        yield from lens_section(e.lens, e.C)
        return
    yield ""
    yield "1. A LINE THROUGH THE PIXEL AND THE CAMERA CENTRE"
    yield ""
    yield f"   x  = (u, v, 1)                {vector(e.x)}, the centre of the pixel"
    yield "   P, the camera matrix, x = P X"
    yield from matrix(e.P)
    yield f"   X' = P⁺ x = Pᵀ (P Pᵀ)⁻¹ x      {vector(e.X)}, homogeneous"
    if e.X_prime is None:
        yield "   The fourth coordinate is 0: X' is at infinity. The first three are then the direction of"
        yield "   the line itself, and replace X' - C."
    else:
        yield f"      = divided by the fourth    {vector(e.X_prime)}, some point on the line"
    yield f"   C, where P (C, 1) = 0         {vector(e.C)}, the camera centre, another point on the line"
    yield f"   X' - C                        {vector(e.line)}"
    yield ""
    yield "   ORIENT THE LINE FORWARD"
    yield ""
    yield "   M, the left 3 x 3 of P, is K R times a scale. The third row of K is (0, 0, 1), so the third row"
    yield "   of M, M3, is that of R times the scale, and the sign of the scale is that of det M."
    yield f"   det M                         {number(e.det_M)}"
    label = "v  = M3 / |M3|" if e.det_M > 0 else "v  = -M3 / |M3|"
    yield f"   {label:<30}{vector(e.forward)}, the third row of R: forward"
    yield f"   v·(X' - C)                    {number(e.forward_dot_line)}"
    if e.forward_dot_line > 0:
        yield f"   Positive, X' is in front:     r = X' - C = {vector(e.r)}"
    else:
        yield f"   Negative, X' is behind:       r = C - X' = {vector(e.r)}"
    yield "   The ray is f(t) = C + t r, and t > 0 is in front of the camera."


def triangles_section(e: PixelSteps) -> Iterator[str]:
    """The lines of steps 3 and 4, the triangles."""
    yield ""
    yield f"2. FOR EACH OF {e.triangles} TRIANGLES: THE PLANE, AND INSIDE OR OUTSIDE"
    yield ""
    for count, meaning in (
        (e.without_area, "have no area, n = 0: never hit"),
        (e.parallel, "are edge-on, n·r = 0: never hit"),
        (e.behind, "are behind the camera, t < 0: discarded"),
        (e.outside, "are missed: the ray meets their planes outside of the triangles"),
        (e.inside, "are hit"),
    ):
        yield f"   {count:>9} {meaning}"
    if not e.candidates:
        return
    yield ""
    yield "   The nearest hits and the closest misses, with all steps below:"
    yield ""
    names = [name(c) for c in e.candidates]
    width = max(map(len, names))
    yield f"   {'t':>12}  {'triangle':<{width}}  crossings"
    for c, label in zip(e.candidates, names, strict=True):
        yield f"   {number(c.t):>12}  {label:<{width}}  {outcome(c, e)}"
    for c in e.candidates:
        yield ""
        yield from triangle_section(c)


def triangle_section(c: Candidate) -> Iterator[str]:
    """The text lines with one triangle's details."""
    yield f"   {name(c).upper()}"
    yield f"   a                   {vector(c.a)}"
    yield f"   b                   {vector(c.b)}"
    yield f"   c                   {vector(c.c)}"
    yield f"   n = (c-a) x (b-a)   {vector(c.n)}"
    yield f"   n·(a - C)           {number(c.n_dot_a_minus_C)}"
    yield f"   n·r                 {number(c.n_dot_r)}"
    yield f"   t = n·(a-C) / n·r   {number(c.t)}"
    yield f"   f(t) = C + t r      {vector(c.f)}"
    yield f"   v1 = b - a          {vector(c.v1)}"
    yield f"   v2 = c - b          {vector(c.v2)}"
    yield f"   v3 = a - c          {vector(c.v3)}"
    yield f"   g = a + v3          {vector(c.g)}, outside"
    yield f"   u = g - f(t)        {vector(c.u)}"
    yield "   f(t) + s u meets the line of each edge; crossed when 0 <= s <= 1 and 0 <= q <= 1:"
    for (edge, start), s, q, crossed in zip(EDGES, c.along_u, c.along_edge, c.crossed, strict=True):
        if math.isnan(s):
            yield f"      {start} + q {edge}         parallel to u, not crossed"
        else:
            numbers = f"s = {number(s):<12} q = {number(q):<12}"
            yield f"      {start} + q {edge}         {numbers} {'crossed' if crossed else '-'}"
    parity = "odd" if c.crossings % 2 else "even"
    count = f"   {c.crossings} {'crossing' if c.crossings == 1 else 'crossings'}, {parity}: "
    if c.on_edge.any():
        edges = " and ".join(edge for (edge, _), on in zip(EDGES, c.on_edge, strict=True) if on)
        yield f"{count}but f(t) lies on {edges}, and points on an edge count as inside."
    else:
        yield f"{count}f(t) is {'inside' if c.inside else 'outside'}."


def color_section(e: PixelSteps) -> Iterator[str]:
    """The lines of step 5, the colour."""
    yield ""
    yield "3. COLOUR THE PIXEL WITH THE COLOUR OF THE CLOSEST TRIANGLE"
    yield ""
    if e.winner is None:
        if e.triangles == 0:
            yield "   There are no triangles in this world: the pixel shows the background."
        elif e.outside == 0:
            yield "   The ray meets no triangle's plane in front of the camera: the pixel shows the background."
        else:
            yield "   The ray meets no triangle: it meets every plane in front of the camera outside of the"
            yield "   triangle. The pixel shows the background."
        return
    b, rgb = e.winner, ", ".join(map(str, srgb(e.color)))
    yield f"   The smallest t            {number(b.t)}, {name(b)}"
    yield f"   Its colour                {vector(e.color)}, linear RGB; as sRGB bytes {rgb}"
    yield f"   distance = t |r|          {number(e.distance)}, from C to f(t)"
    yield f"   depth = t (v·r)           {number(e.depth)}, along the principal axis{aside(e)}"


def aside(e: PixelSteps) -> str:
    """Returns the principal axis of a camera with a lens as text; empty without a lens.

    With a lens, no earlier step contains the principal axis.
    """
    return "" if e.lens is None else f" v = {vector(e.lens.forward)}"


def name(c: Candidate) -> str:
    """Returns a triangle's index, object number and object name as text."""
    return f'triangle {c.triangle} of object {c.instance} "{c.object_name}"'


def outcome(c: Candidate, e: PixelSteps) -> str:
    """The outcome of a candidate as text: the closest hit, a farther hit, or a miss."""
    if c is e.winner:
        said = "inside, and the closest: it colours the pixel"
    elif c.inside:
        said = "inside, but farther away"
    else:
        said = "outside"
    return f"{c.crossings}: {said}"


def matrix(rows: npt.NDArray[np.float64]) -> Iterator[str]:
    """The rows of a matrix with aligned columns."""
    cells = [[number(value) for value in row] for row in rows]
    widths = [max(len(row[i]) for row in cells) for i in range(len(cells[0]))]
    for row in cells:
        yield (
            "      [ " + "  ".join(cell.rjust(width) for cell, width in zip(row, widths, strict=True)) + " ]"
        )
