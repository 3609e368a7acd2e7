"""Lines over the image that show the world's cameras.

The lens of the current camera distorts the lines.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from ...arguments import Floats
from ...camera import Camera
from ...errors import Error

__all__ = ["MAX_CAMERAS", "frusta", "grid", "polylines"]

MAX_CAMERAS = 100
"""Maximum number of cameras that are drawn."""
CELLS = 10
"""Approximate number of cells along a side of the grid."""
PIECES_OF_CELL = 4
AXES = {"x": "#ff4d4d", "y": "#4cd964", "z": "#5aa9ff"}
GRID_COLOR = "#9aa3b2"
STEPS = 12
"""Number of straight pieces of a drawn line, because a lens bends lines."""
NARROW = 0.2
"""A camera is drawn with a flat image plane if the cosines between its principal axis and the rays at the image's edge
are above this value; the field of view of other cameras is drawn as a part of a sphere."""
FARTHEST = 1e5  # pixels outside of the image at which lines are clipped


def frusta(
    cameras: Mapping[str, Camera], seen: Camera, length: float, hidden: str = ""
) -> list[dict[str, Any]]:
    """Returns each camera's name and the lines of its frustum, in pixels of the camera `seen`.

    A frustum has the length `length` in metres.
    """
    made = []
    for name, camera in list(cameras.items())[:MAX_CAMERAS]:
        if name == hidden:
            continue
        try:
            lines = polylines(_edges(camera, length), seen)
        except Error:
            continue  # a camera whose rays cannot be drawn
        if lines:
            made.append({"name": name, "lines": lines})
    return made


def grid(bounds: Floats, seen: Camera) -> list[dict[str, Any]]:
    """The world's axes and a grid under `bounds` [2, 3], in pixels of the camera `seen`.

    The grid is on the ground. The side of its cells is 1, 2 or 5 times a power of ten metres; the name of the grid
    contains this length. The axes start at the world's origin if it is near, else at the centre of the grid, and are
    one cell long.
    """
    up = 2 if seen.up == "z" else 1
    first, second = (axis for axis in range(3) if axis != up)
    sides = bounds[1] - bounds[0]
    cell = _round_length(max(float(sides[first]), float(sides[second]), float(sides[up]) / 2, 1e-9) / CELLS)
    low, high = np.floor(bounds[0] / cell) * cell, np.ceil(bounds[1] / cell) * cell
    edges = []
    for along, across in ((first, second), (second, first)):
        count = round((high[along] - low[along]) / cell) * PIECES_OF_CELL + 1
        for place in np.linspace(low[across], high[across], round((high[across] - low[across]) / cell) + 1):
            edge = np.empty((max(count, 2), 3))
            edge[:, along] = np.linspace(low[along], high[along], len(edge))
            edge[:, across], edge[:, up] = place, bounds[0][up]
            edges.append(edge)
    made: list[dict[str, Any]] = []
    lines = polylines(edges, seen)
    if lines:
        name = f"grid of {cell:g} m"
        made.append({"name": name, "color": GRID_COLOR, "lines": lines, "thin": True})
    is_near = bool((bounds[0] - sides - cell <= 0).all() and (bounds[1] + sides + cell >= 0).all())
    middle = np.round((low + high) / 2 / cell) * cell
    middle[up] = bounds[0][up]
    origin = np.zeros(3) if is_near else middle
    steps = np.linspace(0, cell, STEPS + 1)[:, None]
    for (name, color), axis in zip(AXES.items(), np.eye(3), strict=True):
        lines = polylines([origin + steps * axis], seen)
        if lines:
            made.append({"name": name, "color": color, "lines": lines})
    return made


def _round_length(length: float) -> float:
    """The smallest of 1, 2 and 5 times a power of ten that is not less than `length`."""
    power = 10.0 ** math.floor(math.log10(length))
    return float(next(each * power for each in (1, 2, 5, 10) if each * power >= length * (1 - 1e-9)))


def _edges(camera: Camera, length: float) -> list[Floats]:
    """Returns the edges [n, 3] of a camera's view.

    The edges are the edges of the camera's image at `length`, and the edges from the camera to the image's
    corners.
    """
    still = camera.still()
    (width, height), corner = still.size, still.corner
    share = np.linspace(0, 1, STEPS + 1)[:-1]
    ends = np.array([[0, 0], [width, 0], [width, height], [0, height], [0, 0]], float) + corner
    around = np.concatenate(
        [ends[i] + share[:, None] * (ends[i + 1] - ends[i]) for i in range(4)] + [ends[4:]]
    )
    origins, directions = still.rays(around)
    cosines = directions @ still.forward
    # The end of a camera's field of view is drawn as a plane, or for a wide lens as a part of a sphere.
    flat = np.isfinite(cosines).all() and cosines.min() > NARROW
    far = np.asarray(origins + (length / cosines[:, None] if flat else length) * directions)
    steps = np.linspace(0, 1, STEPS + 1)[:, None]
    to_corners = [origins[i] + steps * (far[i] - origins[i]) for i in range(0, 4 * STEPS, STEPS)]
    return [far, *to_corners]


def polylines(edges: list[Floats], seen: Camera) -> list[list[list[float]]]:
    """Converts lines [n, 3] of the world to pixels from the image's top left corner.

    Parts of a line that have no pixel, for example behind the camera, are removed.
    """
    made: list[list[list[float]]] = []
    for edge in edges:
        pixels, in_front = seen.project(np.nan_to_num(edge, nan=np.inf))
        pixels = pixels - seen.corner
        good = in_front & np.isfinite(pixels).all(axis=1) & (np.abs(pixels) < FARTHEST).all(axis=1)
        start = 0
        for end in [*np.flatnonzero(~good), len(edge)]:
            if end - start > 1:
                made.append(np.round(pixels[start:end], 1).tolist())
            start = end + 1
    return made
