"""An object's placement as numbers: location, roll, pitch, yaw and scales, and its matrix."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ...arguments import Floats
from ...errors import SettingsError
from ...rotations import WORLD_FROM_REFERENCE, rotation_of

__all__ = ["matrix_of_placement", "placement_of_matrix"]

LENGTH = 9
"""Numbers of a placement: location [3], roll, pitch, yaw in degrees, scales [3]."""
SHEAR_LIMIT = 1e-6


def matrix_of_placement(values: Any, up: str) -> Floats:
    """Returns the matrix [4, 4] of a placement, with the angles of `World.add_object`.

    Raises `SettingsError` unless `values` are `LENGTH` finite numbers with scales other than 0.
    """
    if not isinstance(values, list) or len(values) != LENGTH or not np.isfinite(values).all():
        raise SettingsError(
            f"place: expected {LENGTH} finite numbers (position, rotation, scale)", code="wrong_shape"
        )
    if not all(values[6:]):
        raise SettingsError("scale: must not be 0", code="out_of_range")
    matrix = np.eye(4)
    turn = rotation_of(values[3], values[4], values[5], up) @ WORLD_FROM_REFERENCE[up].T
    matrix[:3, :3] = turn * np.array(values[6:])
    matrix[:3, 3] = values[:3]
    return matrix


def placement_of_matrix(matrix: Floats, up: str) -> list[float] | None:
    """The placement [9] of a matrix, or None if the matrix shears the object."""
    linear = np.asarray(matrix, float)[:3, :3]
    scales = np.linalg.norm(linear, axis=0)
    if not np.isfinite(linear).all() or not scales.all():
        return None
    if np.linalg.det(linear) < 0:
        scales = scales * [1, 1, -1]
    turn = linear / scales
    if np.abs(turn.T @ turn - np.eye(3)).max() > SHEAR_LIMIT:
        return None
    body = WORLD_FROM_REFERENCE[up].T @ turn @ WORLD_FROM_REFERENCE[up]
    pitch = math.asin(min(max(-float(body[2, 0]), -1.0), 1.0))
    if abs(body[2, 0]) < 1 - 1e-12:
        roll, yaw = math.atan2(body[2, 1], body[2, 2]), math.atan2(body[1, 0], body[0, 0])
    else:  # if the camera looks straight up or down, only the sum of roll and yaw is defined
        roll, yaw = 0.0, math.atan2(-body[0, 1], body[1, 1])
    angles = np.degrees([roll, pitch, yaw])
    return [float(each) + 0.0 for each in (*np.asarray(matrix)[:3, 3], *angles, *scales)]
