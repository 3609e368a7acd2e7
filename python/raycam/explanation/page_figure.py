"""Returns the data of an explanation's figures in pages.

The client's modules in `figure/` draw the figures.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from .. import reference
from ..reference.units import Floats
from ..srgb import srgb_from_linear
from .scene_figure import Line, Mark, focus, projected, runs
from .steps import PixelSteps

__all__ = ["lines_figure", "page_figure"]

TRIANGLES = 300
"""Maximum number of triangles around the hit in a figure."""
MAX_COARSE_TRIANGLES = 2000
"""Maximum number of triangles around the ray in figures of lines; larger meshes are simplified."""
GRIDS = (192, 128, 96, 64, 48, 32, 24, 16, 12, 8)
"""Numbers of cells along the drawn part of the world, for the grids on which larger meshes are simplified."""
RADIUS = 0.75
"""The radius of the drawn part of the world, as a share of the ray's length."""
DIGITS = 3
"""Number of decimal places of coordinates in a figure whose radius is 1 to 10; fewer in larger figures."""


def page_figure(e: PixelSteps) -> dict[str, Any]:
    """Returns the ray, image corners and triangles around the hit as JSON.

    The data is for `figure/pixel.js`. Points are in the explanation's units. `rays` are origins and
    directions at the image corners: top left, top right, bottom right, bottom left. `triangle` is None if the
    ray does not hit the plane of any triangle.
    """
    shown = e.winner or next(iter(e.candidates), None)
    end = shown.f if shown and np.isfinite(shown.f).all() else e.C
    triangles, colors = _around(e, end)
    return {
        **_camera(e, e.C, e.units.points),
        "r": e.r.tolist(),
        "triangle": shown.corners.ravel().tolist() if shown else None,
        "corners": triangles.ravel().tolist(),
        "colors": _srgb8(colors),
    }


def lines_figure(e: PixelSteps, lines: Sequence[Line], marks: Sequence[Mark]) -> dict[str, Any]:
    """Returns lines and marks in the world and in the image as JSON.

    The data is for `figure/lines.js`. Points are in metres. Pixels are counted from the image's top left
    corner; parts of a line outside the image are omitted.
    """
    start, end = focus(e)
    radius = RADIUS * max(float(np.linalg.norm(end - start)), 1e-300)
    triangles, colors = _coarse(e, (start + end) / 2, radius)
    digits = DIGITS - int(np.floor(np.log10(radius)))

    def rounded(points: Floats) -> Any:
        return np.round(points, digits).tolist()

    return {
        **_camera(e, start, lambda points: points),
        "end": rounded(end),
        "lines": [
            {
                "name": line.name,
                "color": line.symbol,
                "width": line.width,
                "dashed": line.is_dashed,
                "arrow": line.is_arrow,
                "points": rounded(line.points),
                "pixels": [np.round(run, 2).tolist() for run in runs(line, e.camera)],
            }
            for line in lines
        ],
        "marks": [
            {
                "text": text,
                "at": rounded(point),
                "pixel": np.round(at, 2).tolist() if np.isfinite(at).all() else None,
            }
            for text, point in marks
            for at in projected(point[None], e.camera)
        ],
        "corners": rounded(triangles.ravel()),
        "colors": _srgb8(colors),
    }


def _camera(e: PixelSteps, start: Floats, to_units: Callable[[Floats], Floats]) -> dict[str, Any]:
    """The camera of a figure whose ray begins at `start`; `to_units` maps points of the world."""
    width, height = e.camera.size
    corners = np.array([[0, 0], [width, 0], [width, height], [0, height]]) + e.camera.corner
    starts, ways = e.camera.rays(corners)
    rays = np.column_stack([to_units(starts), ways])
    v = e.forward if e.lens is None else e.lens.forward
    return {
        "up": [float(axis == e.camera.up) for axis in "xyz"],
        "size": [width, height],
        "C": start.tolist(),
        "v": np.asarray(v).tolist(),
        "rays": np.where(np.isfinite(rays), rays, 0.0).tolist(),
        "isFlat": e.lens is None,
    }


def _srgb8(colors: Floats) -> list[list[int]]:
    """Linear colours [n, 3] as sRGB, 0 to 255."""
    found: list[list[int]] = np.rint(255 * srgb_from_linear(colors.clip(0, 1))).astype(int).tolist()
    return found


def _around(e: PixelSteps, point: Floats) -> tuple[Floats, Floats]:
    """Returns the triangles [n, 3, 3] nearest to a point, and their linear colours [n, 3].

    The distance to a triangle is the distance to the triangle's centre.
    """
    triangles = e.units.points(np.asarray(e.world.triangles(), dtype=np.float64))
    distances = reference.length(triangles.mean(axis=1) - point)
    order = np.argsort(distances, kind="stable")[:TRIANGLES]
    return triangles[order], np.asarray(e.world.triangle_colors(), dtype=np.float64)[order]


def _coarse(e: PixelSteps, center: Floats, radius: float) -> tuple[Floats, Floats]:
    """Returns at most `MAX_COARSE_TRIANGLES` triangles near a point.

    The result contains the triangles [n, 3, 3] and their linear colours [n, 3]. The vertices in a cell of a
    grid become the cell's first vertex (J. Rossignac and P. Borrel, "Multi-resolution 3D approximations for
    rendering complex scenes", 1993); triangles without area and repeated triangles are dropped.
    """
    every = np.asarray(e.world.triangles(), dtype=np.float64)
    near = (every.min(axis=1) <= center + radius).all(axis=1) & (every.max(axis=1) >= center - radius).all(
        axis=1
    )
    triangles, colors = every[near], np.asarray(e.world.triangle_colors(), dtype=np.float64)[near]
    if len(triangles) <= MAX_COARSE_TRIANGLES:
        return triangles, colors
    points = (triangles.reshape(-1, 3) - center) / (2 * radius)
    for cells in GRIDS:
        keys = (np.floor(points.clip(-1e3, 1e3) * cells).astype(np.int64) @ [1, 1 << 20, 1 << 40]).reshape(
            -1, 3
        )
        with_area = np.flatnonzero((keys != np.roll(keys, 1, axis=1)).all(axis=1))
        _, distinct = np.unique(np.sort(keys[with_area], axis=1), axis=0, return_index=True)
        if len(distinct) <= MAX_COARSE_TRIANGLES:
            break
    order = np.sort(with_area[distinct])[:MAX_COARSE_TRIANGLES]
    _, first, cell = np.unique(keys, return_index=True, return_inverse=True)
    return triangles.reshape(-1, 3)[first][cell.reshape(-1, 3)[order]], colors[order]
