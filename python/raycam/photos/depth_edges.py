"""Distances in a photograph from the nearest jump of depth, on a coarse grid."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..arguments import Bools, Floats
from ..camera import Camera
from ..world import World

__all__ = ["DepthEdges", "find_depth_edges"]

MAX_CELLS = 1 << 17
"""Number of cells of the grid; one ray is traced per cell."""
PLANE_TOLERANCE = 0.02
"""Distance of a neighbour from the tangent plane above which depth jumps, relative to the depth."""


@dataclass(frozen=True, eq=False)
class DepthEdges:
    """Distances from the nearest jump of depth."""

    distance: npt.NDArray[np.float32]
    """Pixels from the cell's middle to the nearest jump [rows, columns], at most `reach`."""
    stride: Floats
    """A cell's width and height in pixels."""

    def at(self, places: Floats) -> npt.NDArray[np.float32]:
        """The distances [n] at positions [n, 2] in pixels from the image's top left corner."""
        rows, columns = self.distance.shape
        column = np.clip((places[:, 0] / self.stride[0]).astype(int), 0, columns - 1)
        row = np.clip((places[:, 1] / self.stride[1]).astype(int), 0, rows - 1)
        found: npt.NDArray[np.float32] = self.distance[row, column]
        return found


def find_depth_edges(world: World, camera: Camera, reach: float, threads: int | None = None) -> DepthEdges:
    """Finds the distances in pixels to the nearest jump of depth, up to `reach`.

    A jump is between neighbouring pixels if one of them shows no surface, or a surface point outside the tangent plane
    of the other pixel.
    """
    width, height = camera.size
    cells = min(1.0, np.sqrt(MAX_CELLS / (width * height)))
    columns, rows = max(1, round(width * cells)), max(1, round(height * cells))
    stride = np.array([width / columns, height / rows])
    u, v = np.meshgrid((np.arange(columns) + 0.5) * stride[0], (np.arange(rows) + 0.5) * stride[1])
    pixels = np.stack([u, v], axis=-1).reshape(-1, 2) + camera.corner
    origins, directions = camera.rays(pixels)
    hits = world.cast_rays(origins, directions, fields=("t", "normal"), threads=threads)
    t = hits["t"].reshape(rows, columns)
    points = (origins + np.where(np.isfinite(hits["t"]), hits["t"], 0)[:, None] * directions).reshape(
        rows, columns, 3
    )
    edges = jumps(t, points, hits["normal"].reshape(rows, columns, 3))
    across = _row_distances(edges) * stride[0]
    best = across**2
    for step in range(1, min(rows, int(np.ceil(reach / stride[1])) + 1)):
        rise = (step * stride[1]) ** 2
        best[step:] = np.minimum(best[step:], across[:-step] ** 2 + rise)
        best[:-step] = np.minimum(best[:-step], across[step:] ** 2 + rise)
    return DepthEdges(np.minimum(np.sqrt(best), reach).astype(np.float32), stride)


def jumps(t: Floats, points: Floats, normals: Floats) -> Bools:
    """Mask [rows, columns] of the cells at a jump of depth.

    One of two neighbouring cells misses the world, or its surface point is not in the tangent plane of the other cell.
    """
    hit = np.isfinite(t)
    edges = np.zeros(hit.shape, bool)
    for a, b in (
        ((slice(None), slice(1, None)), (slice(None), slice(None, -1))),
        ((slice(1, None), slice(None)), (slice(None, -1), slice(None))),
    ):
        between = points[a] - points[b]
        limit = PLANE_TOLERANCE * np.minimum(np.where(hit[a], t[a], np.inf), np.where(hit[b], t[b], np.inf))
        with np.errstate(invalid="ignore"):
            off = np.abs((between * normals[a]).sum(axis=2)) > limit
            off |= np.abs((between * normals[b]).sum(axis=2)) > limit
        jump = (hit[a] != hit[b]) | (hit[a] & hit[b] & off)
        edges[a] |= jump
        edges[b] |= jump
    return edges


def _row_distances(edges: Bools) -> Floats:
    """Distances in cells to the nearest edge of the row [rows, columns]; inf without an edge."""
    columns = edges.shape[1]
    place = np.broadcast_to(np.arange(columns, dtype=np.float64), edges.shape)
    before = np.maximum.accumulate(np.where(edges, place, -np.inf), axis=1)
    after = np.minimum.accumulate(np.where(edges, place, np.inf)[:, ::-1], axis=1)[:, ::-1]
    found: Floats = np.minimum(place - before, after - place)
    return found
