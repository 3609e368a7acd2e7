"""Draws the figure of an explanation.

The figure contains the image with the marked pixel, the ray and the triangle in 3D, and the inside test. The
figure shows the same subjects as the lecture's figures, with the same colours and marks, and requires no
browser. The 3D drawing is scaled to the triangle for any distance of the camera; a long ray is shortened with
an axis break. Directions and all points of the plane are exact.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
import numpy.typing as npt

from .. import _core, reference
from ..reference.units import Bools, Floats
from ..render import render
from .digits import number, srgb, vector
from .palette import PALETTE, SHADES
from .steps import Candidate, PixelSteps
from .svg import MONO, Label, Svg
from .text import EDGES, name
from .view import Box, choose_viewpoint, fit_to_box, plane_grid, unit, view

INK, FAINT, RULE = "#1d2330", "#69707f", "#d9dce3"
WIDTH, HEIGHT, MARGIN, HEADING = 1280.0, 930.0, 24.0, 34.0
ZOOMED = 11
SOFT = "#f0ede6"
EDGE_NAMES = ("v₁", "v₂", "v₃")


def figure(e: PixelSteps) -> str:
    """The figure as SVG text."""
    picture = render(e.world, e.camera, integrator="flat", samples=1, channels="color").to_srgb8()
    svg = Svg(WIDTH, HEIGHT)
    svg.rectangle(0, 0, WIDTH, HEIGHT, "#ffffff")
    heading(svg, e)
    left, right = 560.0, WIDTH - 560.0 - 3 * MARGIN
    top, low = Box(MARGIN, 70, left, 430), Box(MARGIN + left + MARGIN, 70, right, 430)
    third = (WIDTH - 4 * MARGIN) / 3
    below = [Box(MARGIN + i * (third + MARGIN), 524, third, 382) for i in range(2)]

    marked_picture(svg, panel(svg, top, "The image, and the pixel"), e, picture)
    shown = e.winner or (e.candidates[0] if e.candidates else None)
    inner = panel(svg, low, "The ray, the plane and the triangle" if shown else "The ray")
    if shown is None:
        svg.text(
            (inner.x + 16, inner.y + 30),
            "The ray meets no triangle's plane in front of the camera.",
            14,
            FAINT,
        )
    else:
        ray_and_triangle(svg, inner, e, shown)
    others = [c for c in e.candidates if c is not shown]
    others.sort(key=lambda c: c.inside == (shown is not None and shown.inside))
    flat = [c for c in (shown, *others[:1]) if c is not None]
    for box, c in zip(below, flat, strict=False):
        parity = "odd" if c.crossings % 2 else "even"
        place = "inside" if c.inside else "outside"
        count = f"{c.crossings} crossing{'' if c.crossings == 1 else 's'}, {parity}: {place}"
        why = "on an edge: inside" if c.on_edge.any() else count
        flat_test(
            svg, panel(svg, box, f"Triangle {c.triangle} of {shortened(c.object_name, 14)}: {why}"), e, c
        )
    x = MARGIN + len(flat) * (third + MARGIN)
    numbers(svg, panel(svg, Box(x, 524, WIDTH - MARGIN - x, 382), "The numbers"), e, shown)
    return svg.text_of()


def heading(svg: Svg, e: PixelSteps) -> None:
    """Draws the heading: the pixel, its colour and the triangle."""
    r, g, b = srgb(e.color)
    svg.rectangle(MARGIN, 20, 32, 32, f"#{r:02x}{g:02x}{b:02x}", RULE)
    seen = f"shows {shortened(name(e.winner), 70)}" if e.winner else "shows no triangle"
    svg.text((MARGIN + 46, 43), f"Pixel ({e.pixel[0]}, {e.pixel[1]}) {seen}", 21, bold=True)


def shortened(text: str, length: int) -> str:
    """The text, shortened to `length` characters."""
    return text if len(text) <= length else text[: length - 1] + "…"


def panel(svg: Svg, box: Box, title: str) -> Box:
    """Draws a frame with a title; returns the box inside."""
    svg.rectangle(box.x, box.y, box.width, box.height, "#fbfbfd", RULE)
    svg.text((box.x + 14, box.y + 24), title, 14, bold=True)
    return Box(box.x, box.y + HEADING, box.width, box.height - HEADING)


def marked_picture(svg: Svg, box: Box, e: PixelSteps, picture: npt.NDArray[np.uint8]) -> None:
    """Draws the image with a cross at the pixel, and an enlargement of the pixels around it."""
    box = box.inner(14)
    width, height = e.camera.size
    scale = min(box.width / width, box.height / height)
    x, y = box.x + (box.width - width * scale) / 2, box.y + (box.height - height * scale) / 2
    svg.png(x, y, width * scale, height * scale, _core.encode_png(picture), pixelated=scale > 1)
    u, v = x + (e.pixel[0] + 0.5) * scale, y + (e.pixel[1] + 0.5) * scale
    ring = max(9.0, scale)
    ends = [
        ((x, v), (u - ring, v)),
        ((u + ring, v), (x + width * scale, v)),
        ((u, y), (u, v - ring)),
        ((u, v + ring), (u, y + height * scale)),
    ]
    for color, thick in (("#000000", 2.5), ("#ffffff", 1.0)):
        for p, q in ends:
            if x <= p[0] <= q[0] <= x + width * scale and y <= p[1] <= q[1] <= y + height * scale:
                svg.line(p, q, color, thick, opacity=0.55 if thick > 2 else 1.0)
        svg.dot((u, v), ring, "none", color, thick)

    cell = 13.0
    side = ZOOMED * cell
    zoom_x = x + (width * scale - side - 9 if u < x + width * scale / 2 else 9)
    zoom_y = y + (height * scale - side - 9 if v < y + height * scale / 2 else 9)
    svg.rectangle(zoom_x - 3, zoom_y - 3, side + 6, side + 6, "#ffffff", INK)
    for i in range(ZOOMED):
        for j in range(ZOOMED):
            row, column = e.pixel[1] + i - ZOOMED // 2, e.pixel[0] + j - ZOOMED // 2
            if 0 <= row < height and 0 <= column < width:
                r, g, b = picture[row, column]
                fill = f"#{r:02x}{g:02x}{b:02x}"
                svg.rectangle(zoom_x + j * cell, zoom_y + i * cell, cell - 0.5, cell - 0.5, fill)
    middle = (zoom_x + side / 2, zoom_y + side / 2)
    square = [
        (middle[0] + dx * cell / 2, middle[1] + dy * cell / 2)
        for dx, dy in ((-1, -1), (1, -1), (1, 1), (-1, 1))
    ]
    svg.polygon(square, "none", stroke="#000000", width=4)
    svg.polygon(square, "none", stroke="#ffffff", width=2)
    svg.dot(middle, 2, PALETTE["x"], "#ffffff", 1)


def ray_and_triangle(svg: Svg, box: Box, e: PixelSteps, c: Candidate) -> None:
    """Draws the camera, the ray, the plane, the triangle, g, u and the crossings from the side."""
    d, forward = unit(e.r), e.forward
    known = np.array([c.a, c.b, c.c, c.f, c.g])
    center = (known.min(axis=0) + known.max(axis=0)) / 2
    radius = float(reference.length(known - center).max())
    distance = float(reference.length(c.f - e.C))
    shown_distance = min(max(distance, 0.7 * radius), 1.8 * radius)
    C = c.f - shown_distance * d

    # The camera's frustum: the image at some distance in front of the centre.
    width, height = e.camera.size
    half = e.x[:2] - np.array(e.pixel) - 0.5
    corners = np.array([[0, 0], [width, 0], [width, height], [0, height]]) + half
    rays = reference.pointed_forward(
        reference.lines(reference.points_on_lines(e.P, np.vstack([corners, e.x[:2]])), e.C), forward
    )
    rays /= (rays @ forward)[:, None]
    spread = float(reference.length(rays[0] - rays[2]))
    held = min(0.55 * radius / spread, 0.6 * shown_distance)
    frame = C + held * rays

    front = unit(c.n) * (1 if c.n @ d < 0 else -1)
    right, up = unit(frame[1] - frame[0]), unit(frame[0] - frame[3])
    n_length = 0.4 * radius
    middle = c.corners.mean(axis=0)
    n_tip = middle + n_length * unit(c.n)
    beyond = c.f + 0.3 * radius * d
    v_tip = C + 1.7 * held * forward
    quad, grid = plane_grid(c, front)

    points = np.vstack([known, C, frame, v_tip, n_tip, beyond, quad])
    to_page = view(points, choose_viewpoint(points, front, d, right, up, box), up, box.inner(30))
    A, B, Cc, F, G, eye, *window, pixel, V, N, E = to_page(points[:-4])
    plane = to_page(quad)
    behind = c.n @ d > 0  # the triangle hides n if n points away from the camera

    strokes = [(A, B), (B, Cc), (Cc, A), (A, G), (F, G), (eye, F), (F, E), (to_page(middle[None])[0], N)]
    strokes += [(window[i], window[(i + 1) % 4]) for i in range(4)] + [(eye, corner) for corner in window]

    svg.line(F, E, PALETTE["r"], 1.5, "4 5", 0.7)
    if behind:
        svg.arrow(to_page(middle[None])[0], N, PALETTE["n"])
    color, opacity = SHADES["plane"]
    svg.polygon(list(plane), color, opacity, PALETTE["n"], 1.5)
    for p, q in grid:
        a, b = to_page(np.array([p, q]))
        svg.line(a, b, PALETTE["n"], 0.6, opacity=0.3)
    r, g, b = srgb(c.color)
    svg.polygon([A, B, Cc], f"#{r:02x}{g:02x}{b:02x}", 0.75)
    triangle_and_test(svg, [A, B, Cc, F, G], c, *to_page_points(to_page, c))
    if not behind:
        svg.arrow(to_page(middle[None])[0], N, PALETTE["n"])
    for corner in window:
        svg.line(eye, corner, PALETTE["K"], 1.1)
    svg.polygon(window, "#ffffff", 0.55, PALETTE["K"], 1.8)
    svg.arrow(eye, V, PALETTE["R"], 2)
    svg.line(eye, F, PALETTE["r"], 2.5)
    head = eye + 0.62 * (F - eye)
    svg.arrow(head - 0.01 * (F - eye), head, PALETTE["r"], 2.5)
    if shown_distance < distance:
        axis_break(svg, eye + 0.78 * (F - eye), F - eye)
    svg.dot(eye, 5, PALETTE["C"], "#ffffff")
    svg.dot(pixel, 5, PALETTE["x"], "#ffffff")
    svg.dot(F, 5, PALETTE["t"], "#ffffff")

    labels = _labels([A, B, Cc], F, G, eye, pixel, N, V, F - E)
    strokes += [(dot - 4, dot + 4) for dot in (F, G, eye, pixel)]
    svg.labels(labels, strokes, (box.x + 4, box.y, box.width - 8, box.height - 22))
    note = f"C is {number(distance * e.units.scale)} away from f(t)"
    if shown_distance == distance:
        note += "; everything is drawn to scale"
    else:
        longer = "shorter" if shown_distance < distance else "longer"
        note += f": the ray is drawn {longer}; directions and the plane are to scale"
    svg.text((box.x + 14, box.y + box.height - 10), note, 12, FAINT)


def _labels(
    corners: Sequence[Floats],
    F: Floats,
    G: Floats,
    eye: Floats,
    pixel: Floats,
    N: Floats,
    V: Floats,
    towards_eye: Floats,
) -> list[Label]:
    """The labels of `ray_and_triangle`, next to points of the page."""
    A, B, Cc = corners
    out = np.array(corners).mean(axis=0)
    return [
        Label(F, "f(t)", PALETTE["t"], towards_eye),
        Label(eye, "C", PALETTE["C"], eye - F),
        Label(pixel, "x", PALETTE["x"], (-1, -1)),
        *_corner_labels(A, B, Cc, out),
        Label(G, "g", PALETTE["u"], G - A),
        Label((F + G) / 2, "u", PALETTE["u"], (0, -1)),
        Label(N, "n", PALETTE["n"], N - out),
        Label(V, "v", PALETTE["R"], V - eye),
        Label(eye + 0.5 * (F - eye), "r", PALETTE["r"], (0, -1)),
    ]


def _corner_labels(A: Floats, B: Floats, C: Floats, middle: Floats) -> list[Label]:
    """The labels of the corners and the edges."""
    corners = (A, B, C)
    ends = [(corners[i] + corners[(i + 1) % 3]) / 2 for i in range(3)]
    return [
        *(Label(at, name, PALETTE["a"], at - middle) for name, at in zip("abc", corners, strict=True)),
        *(Label(at, name, PALETTE["edge"], at - middle) for name, at in zip(EDGE_NAMES, ends, strict=True)),
    ]


def to_page_points(to_page: Callable[[Floats], Floats], c: Candidate) -> tuple[Floats, Floats]:
    """Returns the points on the page at which the line of u meets the lines of the edges.

    The first array [n, 2] contains the crossings of the segment u with the edges; the second array [m, 2] contains
    other intersections that are at most one length of u away from f.
    """

    def places(chosen: Bools) -> Floats:
        points = np.asarray(c.f + c.along_u[chosen][:, None] * c.u)
        return to_page(points) if len(points) else np.empty((0, 2))

    return places(c.crossed), places(~c.crossed & (np.abs(c.along_u) <= 1))


def triangle_and_test(
    svg: Svg, corners: Sequence[Floats], c: Candidate, crossings: Floats, others: Floats
) -> None:
    """Draws the edges, g, u and the intersections, for `corners` a, b, c, f, g on the page."""
    a, b, third, f, g = corners
    svg.line(a, g, PALETTE["edge"], 1, "4 4")
    for p, q in ((a, b), (b, third), (third, a)):
        svg.arrow(p, q, PALETTE["edge"], 3)
    svg.arrow(f, g, PALETTE["u"], 3)
    for other in others:
        svg.dot(other, 4, FAINT, "#ffffff")
    for crossing in crossings:
        svg.dot(crossing, 7, PALETTE["r"], "#ffffff")
    for corner in (a, b, third):
        svg.dot(corner, 4.5, PALETTE["edge"], "#ffffff")
    svg.dot(g, 5, PALETTE["u"], "#ffffff")


def axis_break(svg: Svg, at: Floats, along: Floats) -> None:
    """Draws an axis break: two strokes and a gap."""
    along = along / math.hypot(*along)
    across = np.array([-along[1], along[0]])
    svg.line(at - 4 * along, at + 4 * along, "#fbfbfd", 5)
    for side in (-4, 4):
        middle = at + side * along
        slant = 7 * across + 3 * along
        svg.line(middle - slant, middle + slant, PALETTE["r"], 1.8)


def flat_test(svg: Svg, box: Box, e: PixelSteps, c: Candidate) -> None:
    """Draws the inside test in the triangle's plane.

    The plane is viewed from the camera's side and in the camera's orientation.
    """
    front = c.n / float(reference.length(c.n)) * (1 if c.n @ e.r < 0 else -1)
    corners = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, -1.0]])
    rays = reference.lines(reference.points_on_lines(e.P, corners), e.C)
    rays = reference.pointed_forward(rays, e.forward)
    rays /= (rays @ e.forward)[:, None]
    # The figure's right axis is the image's right axis, projected to the plane. If the plane is nearly
    # orthogonal to it, the image's up axis is used instead.
    right, up = (axis - (axis @ front) * front for axis in (rays[1] - rays[0], rays[2] - rays[0]))
    if reference.length(right) < 0.3 * reference.length(rays[1] - rays[0]):
        right = reference.cross(up, front)
    right = right / float(reference.length(right))
    basis = np.column_stack([right, -reference.cross(front, right)])

    points = np.array([c.a, c.b, c.c, c.f, c.g])
    to_page = fit_to_box(lambda some: (some - c.a) @ basis, points, box.inner(40))
    A, B, Cc, F, G = to_page(points)
    crossings, others = to_page_points(to_page, c)
    color, opacity = SHADES["inside"] if c.inside else (SOFT, 1.0)
    svg.polygon([A, B, Cc], color, opacity)
    triangle_and_test(svg, [A, B, Cc, F, G], c, crossings, others)
    svg.dot(F, 6, PALETTE["t"], "#ffffff")
    middle = (A + B + Cc) / 3
    labels = [
        Label(F, f"f(t): {'inside' if c.inside else 'outside'}", PALETTE["t"], F - G),
        Label(G, "g = a + v₃", PALETTE["u"], G - A),
        *_corner_labels(A, B, Cc, middle),
        Label(F + 0.6 * (G - F), "u", PALETTE["u"], (0, -1)),
    ]
    strokes = [(A, B), (B, Cc), (Cc, A), (A, G), (F, G)]
    strokes += [(dot - 4, dot + 4) for dot in (F, G, *crossings, *others)]
    svg.labels(labels, strokes, (box.x + 4, box.y, box.width - 8, box.height - 4))


def numbers(svg: Svg, box: Box, e: PixelSteps, c: Candidate | None) -> None:
    """Draws the formulas with their numbers."""
    rows: list[tuple[str, str, str]] = [
        ("x", vector(e.x, 4), PALETTE["x"]),
        ("C", vector(e.C, 4), PALETTE["C"]),
    ]
    if e.lens is None:
        rows += [
            ("X' - C", vector(e.line, 4), PALETTE["r"]),
            ("v·(X' - C)", number(e.forward_dot_line, 4), PALETTE["R"]),
            ("r = X' - C" if e.forward_dot_line > 0 else "r = C - X'", vector(e.r, 4), PALETTE["r"]),
        ]
    else:
        rows += [
            ("m' = K⁻¹ x", vector(e.lens.image_point, 4), PALETTE["K"]),
            ("d, in the camera", vector(e.lens.in_camera, 4), PALETTE["r"]),
            ("r = Rᵀ d", vector(e.r, 4), PALETTE["r"]),
        ]
    if c is not None:
        rows += [
            ("n = (c-a) x (b-a)", vector(c.n, 4), PALETTE["n"]),
            ("t = n·(a-C) / n·r", f"{number(c.n_dot_a_minus_C, 4)} / {number(c.n_dot_r, 4)}", PALETTE["t"]),
            ("", f"= {number(c.t, 4)}", PALETTE["t"]),
            ("f(t) = C + t r", vector(c.f, 4), PALETTE["t"]),
            ("g = a + v3", vector(c.g, 4), PALETTE["u"]),
            ("u = g - f(t)", vector(c.u, 4), PALETTE["u"]),
        ]
        for (edge, start), s, q, crossed in zip(EDGES, c.along_u, c.along_edge, c.crossed, strict=True):
            met = "parallel to u" if math.isnan(s) else f"s = {number(s, 4)}, q = {number(q, 4)}"
            rows.append(
                (
                    f"{start} + q {edge}",
                    f"{met}{'  crossed' if crossed else ''}",
                    PALETTE["r"] if crossed else FAINT,
                )
            )
    if e.winner is not None:
        rows += [
            ("colour, linear RGB", vector(e.color, 4), INK),
            ("depth, distance", f"{number(e.depth, 4)}, {number(e.distance, 4)}", INK),
        ]
    for i, (formula, value, color) in enumerate(rows):
        y = box.y + 16 + i * 20.6
        svg.text((box.x + 14, y), formula, 11, color, family=MONO, bold=True)
        svg.text((box.x + 142, y), value, 11, family=MONO)
