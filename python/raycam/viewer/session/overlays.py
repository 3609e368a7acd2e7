"""The lines that a session draws over its image."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...camera import Camera
from ...explanation.scene_figure import Line
from ..scene.overlay import MAX_CAMERAS, frusta, grid, polylines
from ..scene.scan_points import ScanPoints
from .view import View

__all__ = ["Overlays"]

PIECES_PER_LINE = 24
CAMERA_LENGTH = 0.15
"""The length of a drawn camera, as a share of the world's diagonal."""


@dataclass(frozen=True)
class Overlays:
    """The parts that are drawn over the image.

    The parts are the world's cameras, its grid, the rays of the explained pixel, and a lidar's points.
    """

    cameras: bool = False
    grid: bool = False
    explained: bool = True
    rays: tuple[Line, ...] = ()
    scan: ScanPoints | None = None

    def drawn(self, view: View, more: Sequence[Line] = ()) -> list[dict[str, Any]]:
        """Names, colours and lines in pixels of the view's still image.

        `more` are the script's lines.
        """
        camera = view.still_camera
        lines = grid(view.bounds, camera) if self.grid else []
        if self.cameras:
            length = CAMERA_LENGTH * float(np.linalg.norm(view.bounds[1] - view.bounds[0]))
            names = [name for name in view.base.cameras if name != view.camera_name][:MAX_CAMERAS]
            lines += frusta({name: view.camera_of(name) for name in names}, camera, length)
        if self.scan is not None:
            lines.append(self.scan.drawn(view.world, camera))
        if self.explained:
            lines += [line for line in (_projected(each, camera) for each in self.rays) if line["lines"]]
        return lines + [line for line in (_projected(each, camera) for each in more) if line["lines"]]


def _projected(line: Line, camera: Camera) -> dict[str, Any]:
    """Projects a line of the world to pixels of a camera."""
    share = np.linspace(0, 1, PIECES_PER_LINE + 1)[:, None]
    pieces = [a + share * (b - a) for a, b in zip(line.points[:-1], line.points[1:], strict=True)]
    return {"name": line.name, "color": line.color, "lines": polylines(pieces, camera)}
