"""Lines over the picture: the cameras of the world, bent as the lens that one looks through bends them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ...arguments import Floats
from ...camera import Camera
from ...errors import Error

__all__ = ["frusta", "polylines"]

MOST_CAMERAS = 100
STEPS = 12
"""Pieces of an edge."""
NARROW = 0.2
"""The cosine at the picture's edge down to which a view ends in a plane."""
FARTHEST = 1e5  # pixels beside the picture where a line ends


def frusta(
    cameras: Mapping[str, Camera], seen: Camera, length: float, hidden: str = ""
) -> list[dict[str, Any]]:
    """Name and lines in pixels of each camera's view up to `length` metres, as the camera `seen` sees them."""
    made = []
    for name, camera in list(cameras.items())[:MOST_CAMERAS]:
        if name == hidden:
            continue
        try:
            lines = polylines(_edges(camera, length), seen)
        except Error:
            continue  # a camera whose rays nobody can draw
        if lines:
            made.append({"name": name, "lines": lines})
    return made


def _edges(camera: Camera, length: float) -> list[Floats]:
    """The edges [n, 3] of a camera's view: those of its picture at `length`, and those to its corners."""
    still = camera.still()
    (width, height), corner = still.size, still.corner
    share = np.linspace(0, 1, STEPS + 1)[:-1]
    ends = np.array([[0, 0], [width, 0], [width, height], [0, height], [0, 0]], float) + corner
    around = np.concatenate(
        [ends[i] + share[:, None] * (ends[i + 1] - ends[i]) for i in range(4)] + [ends[4:]]
    )
    origins, directions = still.rays(around)
    cosines = directions @ still.forward
    flat = (
        np.isfinite(cosines).all() and cosines.min() > NARROW
    )  # else a part of a sphere, as wide lenses see
    far = np.asarray(origins + (length / cosines[:, None] if flat else length) * directions)
    steps = np.linspace(0, 1, STEPS + 1)[:, None]
    to_corners = [origins[i] + steps * (far[i] - origins[i]) for i in range(0, 4 * STEPS, STEPS)]
    return [far, *to_corners]


def polylines(edges: list[Floats], seen: Camera) -> list[list[list[float]]]:
    """Lines [n, 3] of the world in pixels from the picture's left top corner, cut where the camera has no image."""
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
