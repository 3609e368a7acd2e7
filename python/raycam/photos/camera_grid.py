"""Rays of all cameras on a grid of pixels, and the share of them that hits a scaled or rotated world."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..arguments import Bools, Floats
from ..camera import Camera
from ..world import World

__all__ = ["GRID_SIDE", "CameraGrid", "GridHits", "inside", "pixel_grid"]

GRID_SIDE = 12
"""Number of rays along each side of a photograph that test whether it shows the world."""
MIN_CONVERGENCE = 0.05
"""Threshold for nearly parallel optical axes.

The axes determine a common point if the smallest eigenvalue of the mean of I - a aᵀ (a: unit axis) is at least this
value. The eigenvalue is 0 for parallel axes, and at most 2/3.
"""
CONVERGING_SHARE = 0.75
"""Minimum share of cameras that face the common point."""
MAX_AXIS_DEGREES = 20.0
"""Maximum angle between the optical axis of a camera that faces the common point and the direction to this point."""


@dataclass(frozen=True)
class GridHits:
    """The cameras' views of the world [cameras]."""

    shows: Bools
    """True for cameras that show the world."""
    fronts: Bools
    """True for cameras that show the world, and mainly fronts of its faces."""
    covered: Floats
    """The share of the camera's rays that hit the world."""
    distances: Floats
    """The distances of the hits along the rays [cameras, rays], in the cameras' unit; infinite for misses."""

    def distance_quantile(self, quantile: float) -> Floats:
        """Returns the quantile of each camera's hit distances, from 0 to 1; NaN for cameras without hits."""
        return np.array(
            [
                np.quantile(row[hit], quantile) if hit.any() else np.nan
                for row, hit in zip(self.distances, np.isfinite(self.distances), strict=True)
            ]
        )


class CameraGrid:
    """The rays of cameras through a grid of pixels."""

    def __init__(self, cameras: Sequence[Camera]) -> None:
        rays = [camera.rays(pixel_grid(camera)) for camera in cameras]
        self._origins, self._directions = (
            np.array([part[i] for part in rays]).reshape(len(cameras), GRID_SIDE**2, 3) for i in range(2)
        )
        self.places = np.array([camera.location for camera in cameras]).reshape(-1, 3)
        """The cameras' positions [cameras, 3]."""
        self._axes = np.array([camera.R[2] for camera in cameras]).reshape(-1, 3)

    def view(self, world: World, factor: float = 1.0, turn: Floats | None = None) -> GridHits:
        """Returns the cameras' views of the world after it is rotated by `turn` [3, 3], and scaled by `factor`.

        The origin is the centre of both. A negative factor mirrors the world, which exchanges fronts and backs.
        """
        rotation = np.eye(3) if turn is None else turn
        origins, directions = self._origins @ rotation / factor, self._directions @ rotation * np.sign(factor)
        hits = world.cast_rays(origins, directions, fields=("t", "front"))
        hit = np.isfinite(hits["t"])
        count, front = hit.sum(axis=1), (hit & (hits["front"] == (factor > 0))).sum(axis=1)
        fronts = (count > 0) & (2 * front >= count)
        return GridHits(count > 0, fronts, count / GRID_SIDE**2, hits["t"] * abs(factor))

    def inside(self, bounds: Floats, factor: float = 1.0) -> Bools:
        """Returns True [cameras] for cameras inside the box `bounds` [2, 3] that is scaled by `factor`."""
        return inside(self.places / factor, bounds)

    def common_point(self) -> Floats | None:
        """Returns the point [3] nearest to all optical axes; None unless most cameras face such a point."""
        across = np.eye(3) - self._axes[:, :, None] * self._axes[:, None, :]
        if len(across) < 3 or np.linalg.eigvalsh(across.mean(axis=0))[0] < MIN_CONVERGENCE:
            return None
        point: Floats = np.linalg.solve(across.sum(axis=0), (across @ self.places[:, :, None]).sum(axis=0))[
            :, 0
        ]
        way = point - self.places
        along = (way * self._axes).sum(axis=1)
        facing = along > np.cos(np.radians(MAX_AXIS_DEGREES)) * np.linalg.norm(way, axis=1)
        return point if facing.mean() >= CONVERGING_SHARE else None


def inside(places: Floats, bounds: Floats) -> Bools:
    """Returns True [n] for places [n, 3] inside the box `bounds` [2, 3]."""
    found: Bools = ((places >= bounds[0]) & (places <= bounds[1])).all(axis=1)
    return found


def pixel_grid(camera: Camera) -> Floats:
    """Returns pixels [n, 2] of an even grid over the image."""
    width, height = camera.size
    u = (np.arange(GRID_SIDE) + 0.5) / GRID_SIDE * width + camera.corner
    v = (np.arange(GRID_SIDE) + 0.5) / GRID_SIDE * height + camera.corner
    return np.stack(np.meshgrid(u, v), axis=-1).reshape(-1, 2)
