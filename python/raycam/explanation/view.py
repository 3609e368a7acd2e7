"""Viewpoints and projections for figures of a triangle, its plane and a ray."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .. import reference
from ..camera import Camera
from ..reference.units import Floats
from .steps import Candidate


@dataclass(frozen=True)
class Box:
    """A rectangle of the page."""

    x: float
    y: float
    width: float
    height: float

    def inner(self, margin: float) -> Box:
        """Returns the box without a strip of the width `margin` along each side."""
        return Box(self.x + margin, self.y + margin, self.width - 2 * margin, self.height - 2 * margin)


def unit(vector: Floats) -> Floats:
    """Returns a vector scaled to length 1."""
    return vector / float(reference.length(vector))


def choose_viewpoint(points: Floats, front: Floats, d: Floats, right: Floats, up: Floats, box: Box) -> Floats:
    """Returns the best viewing direction on the camera's side.

    The view shows the plane with the normal `front` and the ray with the direction `d` obliquely, and fills the box
    with `points` as well as possible. `right` and `up` are the image's directions in the world.
    """
    reach = points - points.mean(axis=0)
    reach /= reference.length(reach).max()

    def score(eye: Floats) -> float:
        plane = float(eye @ front)
        aside = math.sqrt(max(0.0, 1 - float(eye @ d) ** 2))
        across = unit(reference.cross(up, eye))
        flat = np.column_stack([reach @ across, reach @ reference.cross(eye, across)])
        fill = float(np.min(np.array([box.width / box.height, 1.0]) / np.ptp(flat, axis=0)))
        from_above = min(float(eye @ up) / 0.3, 1.0)
        return min(plane / 0.5, aside / 0.75, 1.0) + 0.1 * from_above + 0.5 * min(fill, 1.2)

    eyes = []
    for turn in range(-175, 180, 5):
        for lift in range(-60, 65, 10):
            azimuth, elevation = math.radians(turn), math.radians(lift)
            level = math.sin(azimuth) * right - math.cos(azimuth) * d
            eye = math.cos(elevation) * level + math.sin(elevation) * up
            eyes.append(unit(eye))
    return max(eyes, key=score)


def view(points: Floats, eye: Floats, up: Floats, box: Box) -> Callable[[Floats], Floats]:
    """Returns a projection from space to the page, by a raycam camera.

    The projection shows all `points` in `box`, from the direction `eye`, with `up` upwards.
    """
    center = (points.min(axis=0) + points.max(axis=0)) / 2
    radius = float(reference.length(points - center).max())
    size = (int(box.width), int(box.height))
    camera = Camera.look_at(4.5 * eye, (0.0, 0.0, 0.0), up, size=size, fov=30)

    def project(some: Floats) -> Floats:
        pixels, _ = camera.project((some - center) / radius)
        return np.asarray(pixels)

    return fit_to_box(project, points, box)


def fit_to_box(project: Callable[[Floats], Floats], points: Floats, box: Box) -> Callable[[Floats], Floats]:
    """The projection `project`, scaled and shifted so that the `points` fill the box."""
    flat = project(points)
    low, high = flat.min(axis=0), flat.max(axis=0)
    scale = float(np.min(np.array([box.width, box.height]) / np.maximum(high - low, 1e-300)))
    corner = np.array([box.x, box.y]) + (np.array([box.width, box.height]) - scale * (high - low)) / 2
    return lambda some: corner + scale * (project(some) - low)


def plane_grid(c: Candidate, front: Floats) -> tuple[Floats, list[tuple[Floats, Floats]]]:
    """Returns the corners [4, 3] of a rectangle in the plane around all points, and grid lines."""
    points = np.array([c.a, c.b, c.c, c.f, c.g])
    i, j, low, high = min((extent(points, c.a, edge, front) for edge in (c.v1, c.v2, c.v3)), key=area)
    step = float((high - low).max()) / 10
    low, high = low - step, high + step

    def on_plane(x: float, y: float) -> Floats:
        return np.asarray(c.a + x * i + y * j)

    quad = np.array(
        [
            on_plane(low[0], low[1]),
            on_plane(high[0], low[1]),
            on_plane(high[0], high[1]),
            on_plane(low[0], high[1]),
        ]
    )
    lines = [(on_plane(x, low[1]), on_plane(x, high[1])) for x in np.arange(low[0] + step, high[0], step)]
    lines += [(on_plane(low[0], y), on_plane(high[0], y)) for y in np.arange(low[1] + step, high[1], step)]
    return quad, lines


Extent = tuple[Floats, Floats, Floats, Floats]


def extent(points: Floats, origin: Floats, edge: Floats, front: Floats) -> Extent:
    """Returns the axes of the plane along and across `edge`, and the extent of the points.

    The extent is the minimum and maximum of the points along both axes.
    """
    i = unit(edge)
    j = reference.cross(front, i)
    flat = np.column_stack([(points - origin) @ i, (points - origin) @ j])
    return i, j, flat.min(axis=0), flat.max(axis=0)


def area(extent: Extent) -> float:
    """Returns the area of the rectangle `extent`."""
    return float(np.prod(extent[3] - extent[2]))
