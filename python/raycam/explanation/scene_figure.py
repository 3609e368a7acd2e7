"""Figures of the light and of the search tree: lines drawn over the image and over a side view."""

from __future__ import annotations

from typing import NamedTuple

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
from .steps import PixelSteps
from .svg import Svg
from .tree import TreeSearch
from .view import Box

__all__ = ["Line", "light_figure", "light_lines", "tree_figure", "tree_lines"]

INK, FAINT, RULE = "#1d2330", "#69707f", "#d9dce3"
RAY, LIT, BLOCKED = "#d9381e", "#e0a800", "#5b3fb8"
LEVELS = ("#2456c8", "#0b7a75", "#3f7d20", "#e08a00", "#8e3ab5")
WIDTH, HEIGHT, MARGIN, HEADING = 1280.0, 560.0, 24.0, 34.0
BOXES = 60
"""The boxes that are drawn."""
PIECES = 24
"""Pieces of a line, which a lens bends."""
CORNERS = [(0, 1), (2, 3), (4, 5), (6, 7), (0, 2), (1, 3), (4, 6), (5, 7), (0, 4), (1, 5), (2, 6), (3, 7)]


class Line(NamedTuple):
    """A line through the world."""

    name: str
    """The name beside its end; empty for none."""
    color: str
    points: Floats
    """[n, 3], world, metres."""


def light_lines(world: World, lighting: Lighting, path: LightPath) -> list[Line]:
    """The light path, and the shadow rays to point lights and directional lights."""
    lines = [Line("", RAY, path.points)]
    if lighting.surface is None:
        return lines
    far = 0.5 * _size(world)
    for term in lighting.terms:
        if term.to_light is None or term.cosine <= 0:
            continue
        end = lighting.surface.point + min(term.reach, far) * term.to_light
        name = term.name if term.blocker is None else f"{term.name}: {term.blocker} in the way"
        color = LIT if term.blocker is None else BLOCKED
        lines.append(Line(name, color, np.array([lighting.surface.point, end])))
    return lines


def tree_lines(explanation: PixelSteps, search: TreeSearch) -> list[Line]:
    """The edges of the opened boxes, in one colour per level, and the ray up to the triangle."""
    units, lines = explanation.units, []
    for box in search.boxes[:BOXES]:
        low, high = (units.origin + units.scale * each for each in (box.low, box.high))
        corners = np.array([[(low, high)[i >> k & 1][k] for k in range(3)] for i in range(8)])
        color = LEVELS[box.depth % len(LEVELS)]
        lines += [Line("", color, corners[[a, b]]) for a, b in CORNERS]
    origin, direction = ray_of(explanation)
    reach = explanation.distance if np.isfinite(explanation.distance) else _size(explanation.world)
    return [*lines, Line("", RAY, np.array([origin, origin + reach * direction]))]


def light_figure(explanation: PixelSteps, lighting: Lighting, path: LightPath) -> str:
    """The figure of the light as SVG text."""
    notes = [f"{term.name}: {vector(term.radiance, 3)}" for term in lighting.terms]
    sum_ = f"sum {vector(lighting.total, 4)}, the renderer {vector(lighting.rendered.value, 4)} W/(m² sr)"
    notes.append(sum_)
    notes.append(f"red: a path of light, whose bounces gather {vector(path.radiance, 4)}")
    return _figure(
        explanation,
        "The light of pixel",
        light_lines(explanation.world, lighting, path),
        notes,
        [(str(i + 1), each.point) for i, each in enumerate(path.bounces)],
    )


def tree_figure(explanation: PixelSteps, search: TreeSearch) -> str:
    """The figure of the tree as SVG text."""
    notes = [
        f"{search.triangles:,} triangles; tested are {search.tested_boxes:,} boxes "
        f"and {search.tested_triangles:,} triangles",
        f"{len(search.boxes):,} boxes opened, {min(len(search.boxes), BOXES)} drawn: each colour is a level",
    ]
    return _figure(explanation, "The tree, for pixel", tree_lines(explanation, search), notes, [])


def _figure(
    e: PixelSteps, title: str, lines: list[Line], notes: list[str], marks: list[tuple[str, Floats]]
) -> str:
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
    marks: list[tuple[str, Floats]],
) -> None:
    """Draws a camera's image in a box, with lines and marks clipped at the image's edges."""
    width, height = camera.size
    with collected():
        picture = render(world, camera, integrator="flat", samples=1, channels="color").to_srgb8()
    scale = min(box.width / width, box.height / height)
    left, top = box.x + (box.width - scale * width) / 2, box.y + (box.height - scale * height) / 2
    svg.png(left, top, scale * width, scale * height, _core.encode_png(_veiled(picture)), scale > 1)

    def on_page(points: Floats) -> Floats:
        pixels, in_front = camera.project(points)
        apart = np.linalg.norm(points - camera.rays(np.zeros(2) + camera.corner)[0], axis=1)
        in_front = in_front & (apart > 1e-9 * (1 + np.abs(points).max()))  # the camera's centre has no pixel
        pixels = np.asarray(pixels) - camera.corner
        inside = in_front & ((pixels >= 0) & (pixels <= (width, height))).all(axis=1)
        return np.where(inside[:, None], np.array([left, top]) + scale * pixels, np.nan)

    for line in lines:
        spread = np.linspace(0, 1, PIECES + 1)[:, None]
        pieces = [a + spread * (b - a) for a, b in zip(line.points[:-1], line.points[1:], strict=True)]
        flat = on_page(np.concatenate(pieces)).reshape(len(pieces), PIECES + 1, 2)
        shown = [_plain(run) for piece in flat for run in _runs(piece)]
        for color, wide in (("#ffffff", 4.0), (line.color, 1.8)):
            for run in shown:
                svg.polyline(run.tolist(), color, wide)
        visible = flat[np.isfinite(flat).all(axis=2)]
        if line.name and len(visible):
            x, y = visible[-1]
            at_right = x > left + 0.7 * scale * width
            anchor = "end" if at_right else "start"
            svg.text(
                (x - 6 if at_right else x + 6, y - 4), line.name, 13, line.color, anchor=anchor, halo=True
            )
    for name, point in marks:
        at = on_page(point[None])[0]
        if np.isfinite(at).all():
            svg.dot(at, 5, RAY, "#ffffff")
            svg.text((at[0] + 8, at[1] + 16), name, 13, INK, bold=True, halo=True)


def _runs(points: Floats) -> list[Floats]:
    """The runs of at least two points of [n, 2] without NaN between them."""
    finite = np.isfinite(points).all(axis=1)
    pieces = np.split(points, np.nonzero(~finite)[0])
    pieces = [piece[np.isfinite(piece).all(axis=1)] for piece in pieces]
    return [piece for piece in pieces if len(piece) > 1]


def _plain(points: Floats) -> Floats:
    """Points [n, 2] of a line, or only its two ends if it is straight within a hundredth of a pixel."""
    way = points[-1] - points[0]
    away = points[1:-1] - points[0]
    aside = np.abs(way[0] * away[:, 1] - way[1] * away[:, 0])
    return points[[0, -1]] if (aside <= 0.01 * np.hypot(*way)).all() else points


def _veiled(picture: npt.NDArray[np.uint8]) -> npt.NDArray[np.uint8]:
    """A paler copy of the image, on which lines are visible."""
    return np.asarray(255 - (255 - picture.astype(np.uint16)) * 5 // 8, np.uint8)


def _side_camera(e: PixelSteps, lines: list[Line], size: tuple[int, int]) -> Camera:
    """A camera that shows all lines from the side of the ray, and slightly from above."""
    points = np.concatenate([line.points for line in lines])
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
    """The diagonal of the world, metres; 1 for an empty one."""
    bounds = world.bounds
    return 1.0 if bounds is None else float(np.linalg.norm(bounds[1] - bounds[0]))
