"""Converts the camera of an `mjvScene`."""

from __future__ import annotations

from typing import Any

import numpy as np

from raycam import Camera, SettingsError

from .originals import original

__all__ = ["gl_camera"]


def gl_camera(visual: Any, size: tuple[int, int]) -> Camera:
    """Returns the camera of an `mjvScene`, midway between its two eyes, for images of `size`.

    Its values have the precision of float32. Raises `SettingsError` for orthographic cameras.
    """
    view = original("mjv_averageCamera")(*visual.camera)
    if view.orthographic:
        raise SettingsError("mjvScene: orthographic cameras are not supported", code="unsupported_feature")
    forward, up = (np.asarray(axis, np.float64) for axis in (view.forward, view.up))
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, up)
    right /= np.linalg.norm(right)
    pose = np.eye(4)
    pose[:3, :3] = np.stack([right, np.cross(right, forward), -forward], axis=1)
    pose[:3, 3] = view.pos
    width, height = size
    extent = float(view.frustum_top) - float(view.frustum_bottom)
    focal = height * float(view.frustum_near) / extent
    column = width / 2 - height * float(view.frustum_center) / extent
    row = height * float(view.frustum_top) / extent
    k = np.array([[focal, 0, column], [0, focal, row], [0, 0, 1]])
    return Camera.from_opengl(k, pose, size, pixel_center="half")
