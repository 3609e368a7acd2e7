"""Draws the figures of the light and of the search tree.

The figures consist of lines drawn over the image and over a side view.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from .. import _core
from ..camera import Camera
from ..notices import collected
from ..reference.units import Floats
from ..render import render
from ..world import World
from .digits import vector
from .light_path import LightPath
from .lighting import Lighting, ray_of
from .palette import BRIGHT, PALETTE
from .steps import PixelSteps
from .svg import Svg
from .tree import TreeSearch
from .view import Box

__all__ = [
    "Line",
    "Mark",
    "focus",
    "light_figure",
    "light_lines",
    "path_marks",
    "projected",
    "runs",
    "tree_figure",
    "tree_lines",
]

INK, FAINT, RULE = "#1d2330", "#69707f", "#d9dce3"
DASHES = "6 5"
WIDTH, HEIGHT, MARGIN, HEADING = 1280.0, 560.0, 24.0, 34.0
BOXES = 60
"""Maximum number of boxes drawn."""
FAR = 0.75
"""The drawn length of a segment without an end, as a fraction of the ray's length."""
PIECES = 24
"""Number of straight pieces that represent a line, because a lens bends lines."""
CORNERS = [(0, 1), (2, 3), (4, 5), (6, 7), (0, 2), (1, 3), (4, 6), (5, 7), (0, 4), (1, 5), (2, 6), (3, 7)]


class Line(NamedTuple):
    """A line through the world."""

    name: str
    """The name next to the line's end; empty for a line without a name."""
    color: str
    """The colour of the line where it is drawn over an image."""
    points: Floats
    """The points of the line in the world, [n, 3], metres."""
    symbol: str = ""
    """The symbol in the palette that has the line's colour; empty for lines of scripts."""
    width: float = 2.0
    is_dashed: bool = False
    is_arrow: bool = False


Mark = tuple[str, Floats]
"""A number or name, and its point [3], world, metres."""


def symbol_line(symbol: str, points: Floats, name: str = "", **style: Any) -> Line:
    """A line in its symbol's colour."""
    return Line(name, BRIGHT[symbol], points, symbol, **style)


def light_lines(world: World, lighting: Lighting, path: LightPath) -> list[Line]:
    """The light path, and the shadow rays to point lights and directional lights."""
    far = FAR * float(np.linalg.norm(path.points[1] - path.points[0]))
    points = np.array([path.origin, *(point for _, point in path_marks(path))])
    lines = [symbol_line("r", points[:2], is_arrow=True)]
    if len(points) > 2:
        lines.append(symbol_line("L", points[1:], is_arrow=True))
    if lighting.surface is None:
        return lines
    for term in lighting.terms:
        if term.to_light is None or term.cosine <= 0:
            continue
        reach = term.reach if np.isfinite(term.reach) else far
        end = lighting.surface.point + reach * term.to_light
        name = term.name if term.blocker is None else f"{term.name}: occluded by {term.blocker}"
        symbol = "L" if term.blocker is None else "axis"
        way = np.array([lighting.surface.point, end])
        lines.append(symbol_line(symbol, way, name, is_dashed=True, is_arrow=True))
    return lines


def tree_lines(explanation: PixelSteps, search: TreeSearch) -> list[Line]:
    """The edges of the opened boxes, thinner for each level, and the ray up to the triangle."""
    units, lines = explanation.units, []
    for box in search.boxes[:BOXES]:
        low, high = (units.origin + units.scale * each for each in (box.low, box.high))
        corners = np.array([[(low, high)[i >> k & 1][k] for k in range(3)] for i in range(8)])
        width = max(0.8, 3 - 0.4 * box.depth)
        lines += [symbol_line("P", corners[[a, b]], width=width) for a, b in CORNERS]
    return [*lines, symbol_line("r", np.array(focus(explanation)), is_arrow=True)]


def path_marks(path: LightPath) -> list[Mark]:
    """Returns the numbers of the path's bounces as marks.

    The segment towards the sky is shortened.
    """
    points, far = path.points, FAR * float(np.linalg.norm(path.points[1] - path.points[0]))
    marks = []
    for i, bounce in enumerate(path.bounces):
        way = points[i + 1] - points[i]
        shorter = far / float(np.linalg.norm(way)) if i and bounce.object_name == "the sky" else 1.0
        marks.append((str(i + 1), points[i] + min(shorter, 1.0) * way))
    return marks


def focus(e: PixelSteps) -> tuple[Floats, Floats]:
    """Returns the start and end [3] of the ray in the world, in metres.

    A ray without a hit is as long as the world's size.
    """
    start, direction = ray_of(e)
    reach = e.distance if np.isfinite(e.distance) else _size(e.world)
    return start, start + reach * direction


def light_figure(explanation: PixelSteps, lighting: Lighting, path: LightPath) -> str:
    """The figure of the light as SVG text."""
    notes = [f"{term.name}: {vector(term.radiance, 3)}" for term in lighting.terms]
    sum_ = f"sum {vector(lighting.total, 4)}, rendered {vector(lighting.rendered.value, 4)} W/(m² sr)"
    notes.append(sum_)
    notes.append(
        f"numbered: a light path, whose bounces contribute {vector(path.radiance, 4)};"
        " dashed: the segments to the lights"
    )
    return _figure(
        explanation,
        "The light of pixel",
        light_lines(explanation.world, lighting, path),
        notes,
        path_marks(path),
    )


def tree_figure(explanation: PixelSteps, search: TreeSearch) -> str:
    """The figure of the tree as SVG text."""
    notes = [
        f"{search.triangles:,} triangles; tested: {search.tested_boxes:,} boxes "
        f"and {search.tested_triangles:,} triangles",
        f"{len(search.boxes):,} boxes opened, {min(len(search.boxes), BOXES)} drawn, with thinner lines at each level",
    ]
    return _figure(explanation, "The tree, for pixel", tree_lines(explanation, search), notes, [])


def _figure(e: PixelSteps, title: str, lines: list[Line], notes: list[str], marks: list[Mark]) -> str:
    """Draws two panels, the image and a side view, with notes below."""
    height = HEIGHT + 20 * max(0, len(notes) - 2)
    svg = Svg(WIDTH, height)
    svg.rectangle(0, 0, WIDTH, height, "#ffffff")
    svg.text((MARGIN, 40), f"{title} ({e.pixel[0]}, {e.pixel[1]})", 21, bold=True)
    half = (WIDTH - 3 * MARGIN) / 2
    for i, (name, camera) in enumerate(
        [("The picture", e.camera), ("From the side", _side_camera(e, lines, (int(half) - 20, 400)))]
    ):
        box = Box(MARGIN + i * (half + MARGIN), 60, half, 440)
        svg.rectangle(box.x, box.y, box.width, box.height, "#fbfbfd", RULE)
        svg.text((box.x + 14, box.y + 24), name, 14, bold=True)
        inner = Box(box.x + 10, box.y + HEADING, box.width - 20, box.height - HEADING - 8)
        _drawn(svg, inner, e.world, camera, lines, marks)
    for i, note in enumerate(notes):
        svg.text((MARGIN, 526 + 20 * i), note, 13, INK)
    return svg.text_of()


def _drawn(
    svg: Svg,
    box: Box,
    world: World,
    camera: Camera,
    lines: list[Line],
    marks: list[Mark],
) -> None:
    """Draws a camera's image in a box, with lines and marks clipped at the image's edges."""
    width, height = camera.size
    with collected():
        picture = render(world, camera, integrator="flat", samples=1, channels="color").to_srgb8()
    scale = min(box.width / width, box.height / height)
    left, top = box.x + (box.width - scale * width) / 2, box.y + (box.height - scale * height) / 2
    svg.png(left, top, scale * width, scale * height, _core.encode_png(_veiled(picture)), scale > 1)

    def on_page(pixels: Floats) -> Floats:
        return np.array([left, top]) + scale * pixels

    for line in lines:
        shown, own = [on_page(run) for run in runs(line, camera)], PALETTE[line.symbol]
        for color, wider in (("#ffffff", 2.2), (own, 0.0)):
            for run in shown:
                dash = DASHES if line.is_dashed and not wider else ""
                svg.polyline(run.tolist(), color, line.width + wider, dash)
        if line.name and shown:
            x, y = shown[-1][-1]
            at_right = x > left + 0.7 * scale * width
            anchor = "end" if at_right else "start"
            svg.text((x - 6 if at_right else x + 6, y - 4), line.name, 13, own, anchor=anchor, halo=True)
    for name, point in marks:
        at = on_page(projected(point[None], camera))[0]
        if np.isfinite(at).all():
            svg.dot(at, 5, PALETTE["t"], "#ffffff")
            svg.text((at[0] + 8, at[1] + 16), name, 13, PALETTE["t"], bold=True, halo=True)


def projected(points: Floats, camera: Camera) -> Floats:
    """Returns the pixels [n, 2] of points [n, 3], from the image's top left corner.

    Points outside the image have the pixel NaN.
    """
    pixels, in_front = camera.project(points)
    apart = np.linalg.norm(points - camera.rays(np.zeros(2) + camera.corner)[0], axis=1)
    in_front = in_front & (apart > 1e-9 * (1 + np.abs(points).max()))  # the camera's centre has no pixel
    pixels = np.asarray(pixels) - camera.corner
    inside = in_front & ((pixels >= 0) & (pixels <= camera.size)).all(axis=1)
    return np.where(inside[:, None], pixels, np.nan)


def runs(line: Line, camera: Camera) -> list[Floats]:
    """The visible parts of a line in pixels [n, 2], curved by the lens distortion."""
    spread = np.linspace(0, 1, PIECES + 1)[:, None]
    pieces = [a + spread * (b - a) for a, b in zip(line.points[:-1], line.points[1:], strict=True)]
    flat = projected(np.concatenate(pieces), camera).reshape(len(pieces), PIECES + 1, 2)
    return [_plain(run) for piece in flat for run in _runs(piece)]


def _runs(points: Floats) -> list[Floats]:
    """Returns the pieces of a line [n, 2] between NaN points, if they have at least two points."""
    finite = np.isfinite(points).all(axis=1)
    pieces = np.split(points, np.nonzero(~finite)[0])
    pieces = [piece[np.isfinite(piece).all(axis=1)] for piece in pieces]
    return [piece for piece in pieces if len(piece) > 1]


def _plain(points: Floats) -> Floats:
    """Returns the points [n, 2] of a line, or only the two ends if the line is straight.

    A line is straight if all points are within a hundredth of a pixel of the line between the ends.
    """
    way = points[-1] - points[0]
    away = points[1:-1] - points[0]
    aside = np.abs(way[0] * away[:, 1] - way[1] * away[:, 0])
    return points[[0, -1]] if (aside <= 0.01 * np.hypot(*way)).all() else points


def _veiled(picture: npt.NDArray[np.uint8]) -> npt.NDArray[np.uint8]:
    """A paler copy of the image, on which lines are visible."""
    return np.asarray(255 - (255 - picture.astype(np.uint16)) * 5 // 8, np.uint8)


def _side_camera(e: PixelSteps, lines: list[Line], size: tuple[int, int]) -> Camera:
    """A camera that shows the lines near the ray from the side, and slightly from above."""
    start, end = focus(e)
    points = np.concatenate([line.points for line in lines])
    is_near = np.linalg.norm(points - (start + end) / 2, axis=1) <= 1.5 * np.linalg.norm(end - start)
    points = np.concatenate([points[is_near], [start, end]])
    low, high = points.min(axis=0), points.max(axis=0)
    middle, radius = (low + high) / 2, max(float(np.linalg.norm(high - low)) / 2, 1e-9)
    up = np.eye(3)[2 if e.world.up == "z" else 1]
    _, ray = ray_of(e)
    aside = np.cross(ray, up)
    if np.linalg.norm(aside) < 1e-3:
        aside = np.roll(up, 1)
    way = aside / np.linalg.norm(aside) - 0.3 * ray + 0.45 * up
    eye = middle + 3.4 * radius * way / np.linalg.norm(way)
    return Camera.look_at(eye, middle, up, size=size, fov=36)


def _size(world: World) -> float:
    """The world's diagonal in metres; 1 for an empty world."""
    bounds = world.bounds
    return 1.0 if bounds is None else float(np.linalg.norm(bounds[1] - bounds[0]))
