"""The data of an explanation's figures in pages, which the client's modules in `figure/` draw."""

from __future__ import annotations

from typing import Any

import numpy as np

from .. import reference
from ..reference.units import Floats
from ..srgb import srgb_from_linear
from .steps import PixelSteps

__all__ = ["page_figure"]

TRIANGLES = 300
"""The triangles around the hit that figures show."""


def page_figure(e: PixelSteps) -> dict[str, Any]:
    """The ray, the image corners and the triangles around the hit, as JSON for `figure/pixel.js`.

    Points are in the explanation's units. `rays` are origins and directions at the image corners: top left, top right,
    bottom right, bottom left. `triangle` is None if the ray hits no plane of a triangle.
    """
    width, height = e.camera.size
    corners = np.array([[0, 0], [width, 0], [width, height], [0, height]]) + e.camera.corner
    starts, ways = e.camera.rays(corners)
    rays = np.column_stack([e.units.points(starts), ways])
    shown = e.winner or next(iter(e.candidates), None)
    end = shown.f if shown and np.isfinite(shown.f).all() else e.C
    triangles, colors = _around(e, end)
    v = e.forward if e.lens is None else e.lens.forward
    return {
        "up": [float(axis == e.camera.up) for axis in "xyz"],
        "size": [width, height],
        "C": e.C.tolist(),
        "r": e.r.tolist(),
        "v": np.asarray(v).tolist(),
        "rays": np.where(np.isfinite(rays), rays, 0.0).tolist(),
        "isFlat": e.lens is None,
        "triangle": shown.corners.ravel().tolist() if shown else None,
        "corners": triangles.ravel().tolist(),
        "colors": np.rint(255 * srgb_from_linear(colors.clip(0, 1))).astype(int).tolist(),
    }


def _around(e: PixelSteps, point: Floats) -> tuple[Floats, Floats]:
    """The triangles [n, 3, 3] whose centres are closest to a point, and their linear colours [n, 3]."""
    triangles = e.units.points(np.asarray(e.world.triangles(), dtype=np.float64))
    distances = reference.length(triangles.mean(axis=1) - point)
    order = np.argsort(distances, kind="stable")[:TRIANGLES]
    return triangles[order], np.asarray(e.world.triangle_colors(), dtype=np.float64)[order]
