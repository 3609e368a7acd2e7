"""Rotation matrices, the same to the last bit on every processor."""

from __future__ import annotations

import math

import numpy as np

from .arguments import Floats, product
from .elementary import cos, sin

__all__ = ["WORLD_FROM_REFERENCE", "rotation_of", "turn_about"]

WORLD_FROM_REFERENCE = {"z": np.eye(3), "y": np.array([[0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [-1.0, 0.0, 0.0]])}
"""World axes of the body axes (x forward, y left, z up) at zero angles, by the world's up axis, [3, 3]."""


def turn_about(axis: Floats, angle: float) -> Floats:
    """Returns the rotation matrix about a unit axis by `angle` radians (Rodrigues)."""
    x, y, z = (float(value) for value in axis)
    c, s = float(cos(angle)), float(sin(angle))
    k = 1.0 - c
    return np.array(
        [
            [c + x * x * k, x * y * k - z * s, x * z * k + y * s],
            [y * x * k + z * s, c + y * y * k, y * z * k - x * s],
            [z * x * k - y * s, z * y * k + x * s, c + z * z * k],
        ]
    )


def rotation_of(roll: float, pitch: float, yaw: float, up: str) -> Floats:
    """Returns world_from_body [3, 3] for roll, pitch and yaw in degrees.

    The matrix is Rz(yaw) Ry(pitch) Rx(roll) in the body axes of REP-103 (x forward, y left, z up).
    """
    turn = np.eye(3)
    for axis, angle in ((2, yaw), (1, pitch), (0, roll)):
        turn = product(turn, turn_about(np.eye(3)[axis], math.radians(angle)))
    return product(WORLD_FROM_REFERENCE[up], turn)
