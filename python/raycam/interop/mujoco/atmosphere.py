"""Haze and fog of MuJoCo's renderer, and the distances beyond which it draws nothing.

Sources: MuJoCo's documentation (XML reference, visual/map and visual/rgba) and `mjr_render`; OpenGL 2.1 specification,
section 3.10 (fog).
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from ...arguments import Floats
from .model import GEOM_OBJECT, PLANE

__all__ = ["Atmosphere"]

Single = npt.NDArray[np.float32]
SKY_DISTANCE = 0.7
"""The radius of the skybox, a cylinder around the camera, as a share of the far plane's distance."""


class Atmosphere:
    """The far plane, the sky's distance, fog and haze of a model."""

    def __init__(self, model: Any, elements: list[tuple[int, int]]) -> None:
        extent, view = float(model.stat.extent), model.vis.map
        self.far = float(view.zfar) * extent
        """The depth of the far plane in metres."""
        self._fog = float(view.fogstart) * extent, float(view.fogend) * extent
        self._fog_color = np.asarray(model.vis.rgba.fog[:3], np.float32)
        self._haze, self._haze_color = float(view.haze), np.asarray(model.vis.rgba.haze[:3], np.float32)
        self.ground: int | None = None
        """The object of the first infinite plane; haze lies above this plane."""
        for number, (kind, geom) in enumerate(elements):
            endless = kind == GEOM_OBJECT and int(model.geom_type[geom]) == PLANE
            if endless and not np.any(model.geom_size[geom][:2]):
                self.ground = number
                break

    def limits(self, directions: Floats, forward: Floats, sky: bool) -> Floats:
        """Returns the distances [n] at which rays reach the far plane or the skybox.

        `directions` are unit vectors [n, 3], and `forward` [3] is the camera's viewing direction. If `sky` is
        False, there is no skybox.
        """
        along = directions @ forward
        limits = np.full(len(directions), np.inf)
        np.divide(self.far, along, out=limits, where=along > 0)
        if sky:
            reach = np.maximum(np.hypot(directions[:, 0], directions[:, 1]), abs(directions[:, 2]))
            limits = np.minimum(limits, SKY_DISTANCE * self.far / np.where(reach > 0, reach, np.nan))
        return limits

    def fogged(self, colors: Single, depth: Floats) -> Single:
        """Returns colours [n, 3] at depths [n] in fog."""
        start, end = self._fog
        clear = np.clip((end - depth) / max(end - start, 1e-12), 0, 1).astype(np.float32)[:, None]
        return np.asarray(clear * colors + (1 - clear) * self._fog_color, np.float32)

    def blend_haze(
        self,
        colors: Single,
        directions: Floats,
        distances: Floats,
        height: Floats,
        up: Floats,
        fog_along: Floats | None = None,
    ) -> None:
        """Blends haze over the colours [n, 3] of rays [n, 3] that end at distances [n].

        If `fog_along` [n] is given, fog is also blended over the haze; it contains depth divided by distance for each
        ray.

        The haze is a cone around the camera, which is `height` above a plane with the normal `up`. The cone rises
        outwards from a circle in the plane to the edge of the sky at the camera's height. The haze is opaque at one
        height, and fades out upwards and downwards.
        """
        radius = SKY_DISTANCE * self.far
        elevation, narrowing = float(height) / radius, self._haze
        if elevation < 0:
            return
        vertical = directions @ up
        slope = -vertical / np.sqrt(np.maximum(1 - vertical**2, 1e-30))
        # `below` is 1 at the plane and 0 at the camera's height.
        below = slope / np.maximum(elevation + slope * narrowing, 1e-30)
        reached = radius * np.hypot(1 - narrowing * below, elevation * below)
        shown = (slope > 0) & (below <= 1) & (reached <= distances)
        # The haze is densest where the cone meets a line that rises inwards at 45 degrees from the plane, below the
        # sky's edge.
        angle = np.arctan2(1, narrowing)
        densest = np.sqrt(0.5) * narrowing * np.sin(angle) / np.sin(0.75 * np.pi - angle)
        rise = 1 - below[shown]
        lower = rise / max(densest, 1e-12)
        alpha = np.where(rise < densest, lower, (1 - rise) / max(1 - densest, 1e-12)).astype(np.float32)
        haze = np.broadcast_to(self._haze_color, (len(rise), 3))
        if fog_along is not None:
            haze = self.fogged(haze, (reached * fog_along)[shown])
        colors[shown] += alpha[:, None] * (haze - colors[shown])
