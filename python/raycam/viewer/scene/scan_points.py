"""The points of a lidar's scan over the image."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from ...arguments import Floats
from ...camera import Camera
from ...lidar import Lidar, scan
from ...world import World

__all__ = ["ScanPoints", "lidar_names", "scan_points"]

MAX_POINTS = 6000
"""The largest number of points that are drawn; of a larger scan, only every k-th point is drawn."""
FIELDS = ("ring", "time", "intensity", "instance", "distance", "return")
"""The fields that the client shows for a point."""
SURFACE = 1e-3
"""Tolerance (a fraction of the distance, and metres) within which a surface counts as the source of the point."""


@dataclass(frozen=True)
class ScanPoints:
    """Points in the world, with their fields."""

    lidar: str
    positions: Floats
    """The positions of the points in the world [n, 3], metres."""
    fields: dict[str, npt.NDArray[Any]]
    total: int
    """The number of points of the whole scan."""

    def message(self) -> dict[str, Any]:
        """The message `scan`: the fields of the points, by name; times in milliseconds."""
        values = {name: array.tolist() for name, array in self.fields.items()}
        values["time"] = np.round(1e3 * self.fields["time"], 4).tolist()
        values["distance"] = np.round(self.fields["distance"], 4).tolist()
        return {"type": "scan", "lidar": self.lidar, "total": self.total, "fields": values}

    def drawn(self, world: World, camera: Camera) -> dict[str, Any]:
        """Returns number, column and row of each visible point.

        Columns and rows are in pixels from the top left corner of the camera's image.
        """
        pixels, in_front = camera.project(self.positions)
        pixels = pixels - camera.corner
        width, height = camera.size
        inside = in_front & (pixels >= 0).all(axis=1) & (pixels <= [width, height]).all(axis=1)
        shown = np.flatnonzero(inside)
        origins, directions = camera.rays(pixels[shown] + camera.corner)
        reach = np.linalg.norm(self.positions[shown] - origins, axis=-1)
        nearer = np.maximum(reach * (1.0 - SURFACE) - SURFACE, 0.0)
        hidden = world.occluded(origins, directions, nearer) if len(shown) else np.zeros(0, bool)
        shown = shown[~hidden]
        rows = np.column_stack([shown, np.round(pixels[shown], 1)])
        return {"name": "", "lines": [], "points": rows.reshape(-1).tolist()}


def lidar_names(world: World) -> list[str]:
    """Returns the names of a world's lidars."""
    if not world.has_sensors:
        return []
    return [name for name, sensor in world.sensors.items() if isinstance(sensor, Lidar)]


def scan_points(world: World, name: str) -> ScanPoints:
    """Returns the points of frame 0 of a lidar of the world.

    Raises `LidarError` for an unknown name.
    """
    points = scan(world, name)
    step = max(1, -(-points.count // MAX_POINTS))
    positions = points.in_world()[::step]
    return ScanPoints(name, positions, {field: points[field][::step] for field in FIELDS}, points.count)
