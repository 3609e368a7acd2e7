"""Rigid transforms as matrices [4, 4] in float64."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from ..arguments import Floats

__all__ = ["quaternion_matrices", "quaternions_of", "rotation_of", "rotations_about", "transform"]


def transform(xyz: Sequence[float], rpy: Sequence[float]) -> Floats:
    """Returns the matrix [4, 4] of a URDF origin.

    The matrix rotates about the fixed axes x, y, z by `rpy` [3] in radians, and then translates by `xyz` [3] in
    metres.
    """
    (cr, cp, cy), (sr, sp, sy) = np.cos(rpy), np.sin(rpy)
    matrix = np.eye(4)
    matrix[:3, :3] = [
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ]
    matrix[:3, 3] = xyz
    return matrix


def rotations_about(axis: Floats, angles: Floats) -> Floats:
    """Returns rotation matrices [n, 3, 3] about a unit axis [3] by angles [n] (Rodrigues)."""
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    sine, cosine = np.sin(angles)[:, None, None], np.cos(angles)[:, None, None]
    found: Floats = cosine * np.eye(3) + sine * cross + (1.0 - cosine) * np.outer(axis, axis)
    return found


def rotation_of(vector: Floats) -> Floats:
    """Returns the rotation matrix [3, 3] about a vector [3] by its length in radians."""
    angle = float(np.linalg.norm(vector))
    return rotations_about(vector / angle, np.array([angle]))[0] if angle > 0 else np.eye(3)


def quaternion_matrices(quaternions: npt.ArrayLike) -> Floats:
    """Returns the rotation matrices [n, 3, 3] of quaternions [n, 4] in the order x y z w.

    The quaternions are normalised first.
    """
    values = np.asarray(quaternions, np.float64)
    x, y, z, w = (values / np.linalg.norm(values, axis=-1, keepdims=True)).T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), -1, 0)


def quaternions_of(rotations: Floats) -> Floats:
    """Returns unit quaternions [n, 4], x y z w, of rotation matrices [n, 3, 3].

    Each quaternion q is computed from the largest column of q qᵀ.
    """
    r = np.moveaxis(np.asarray(rotations, np.float64), 0, -1)
    outer = np.array(
        [
            [1 + r[0, 0] - r[1, 1] - r[2, 2], r[0, 1] + r[1, 0], r[0, 2] + r[2, 0], r[2, 1] - r[1, 2]],
            [r[0, 1] + r[1, 0], 1 - r[0, 0] + r[1, 1] - r[2, 2], r[1, 2] + r[2, 1], r[0, 2] - r[2, 0]],
            [r[0, 2] + r[2, 0], r[1, 2] + r[2, 1], 1 - r[0, 0] - r[1, 1] + r[2, 2], r[1, 0] - r[0, 1]],
            [r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1], 1 + r[0, 0] + r[1, 1] + r[2, 2]],
        ]
    )
    outer = np.moveaxis(outer, -1, 0)
    largest = np.argmax(np.diagonal(outer, axis1=1, axis2=2), axis=1)
    columns = outer[np.arange(len(outer)), :, largest]
    found: Floats = columns / np.linalg.norm(columns, axis=1, keepdims=True)
    return found
