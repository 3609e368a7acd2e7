"""The vertical axis, and rotations about an axis, in float64."""

from __future__ import annotations

import math

import numpy as np

from ...arguments import Floats
from ...camera import Camera

__all__ = ["rotation_about", "turned_around", "up_axis"]


def up_axis(up: str) -> Floats:
    """The unit vector [3] of the vertical axis "y" or "z"."""
    return np.array([0.0, 0.0, 1.0] if up == "z" else [0.0, 1.0, 0.0])


def turned_around(camera: Camera, pivot: Floats, angle: float) -> Camera:
    """The camera turned by `angle` (radians) around `pivot`, as on a turntable.

    The axis of the rotation is vertical.
    """
    turn = rotation_about(up_axis(camera.up), angle)
    return camera.at_pose(camera.R @ turn.T, pivot + turn @ (camera.location - pivot))


def rotation_about(axis: Floats, angle: float) -> Floats:
    """The rotation [3, 3] by a right-handed angle about a unit axis (Rodrigues)."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + math.sin(angle) * cross + (1.0 - math.cos(angle)) * (cross @ cross))
