"""Measurements of an inertial measurement unit on a body that moves through given poses."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arguments import Floats
from ..errors import SettingsError
from ..one_line import counted

__all__ = ["GRAVITY", "LEAST_POSES", "BodyMotion", "specific_force"]

GRAVITY = 9.80665
"""Standard gravity in m/s²."""
LEAST_POSES = 4
"""Poses that a cubic spline without end conditions requires."""


@dataclass(frozen=True)
class BodyMotion:
    """A smooth motion through poses.

    The position and the quaternion are cubic splines (not-a-knot). The quaternion is normalised after the
    interpolation.

    Source: de Boor, A Practical Guide to Splines, chapter IV.
    """

    times: Floats
    """The times of the poses in seconds, ascending [n]."""
    values: Floats
    """Position and quaternion (x, y, z, w) at these times [n, 7]."""
    curvatures: Floats
    """Second derivatives of `values` [n, 7]."""

    @classmethod
    def of(cls, times: Floats, quaternions: Floats, positions: Floats) -> BodyMotion:
        """Returns the motion through quaternions [n, 4] and positions [n, 3].

        The quaternions are world_from_body, in the order x, y, z, w. Raises `SettingsError` for fewer than four poses,
        and for times that do not ascend.
        """
        if len(times) < LEAST_POSES or (np.diff(times) <= 0.0).any():
            raise SettingsError(
                f"imu requires at least {LEAST_POSES} poses, each with a later time than the previous pose; got "
                f"{counted(len(times), 'pose')}",
                code="missing_value",
            )
        turns = quaternions.copy()
        for i in range(1, len(turns)):
            if turns[i] @ turns[i - 1] < 0.0:
                turns[i] = -turns[i]
        values = np.concatenate([positions, turns], axis=1)
        return cls(times, values, _curvatures(times, values))

    def at(self, moments: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        """Returns the body's pose, accelerations and angular velocities at `moments` [m].

        The arrays are quaternions [m, 4], and positions, accelerations and angular velocities [m, 3].
        Accelerations are in the world's axes, in m/s²; angular velocities in the body's axes, in rad/s.
        """
        after = np.clip(np.searchsorted(self.times, moments, side="right"), 1, len(self.times) - 1)
        step = (self.times[after] - self.times[after - 1])[:, None]
        b = (moments - self.times[after - 1])[:, None] / step
        a = 1.0 - b
        low, high = self.values[after - 1], self.values[after]
        bend_low, bend_high = self.curvatures[after - 1], self.curvatures[after]
        value = a * low + b * high + ((a**3 - a) * bend_low + (b**3 - b) * bend_high) * step**2 / 6.0
        rate = (high - low) / step + (
            (3.0 * b**2 - 1.0) * bend_high - (3.0 * a**2 - 1.0) * bend_low
        ) * step / 6.0
        bend = a * bend_low + b * bend_high
        turn, spin = value[:, 3:], rate[:, 3:]
        length = np.linalg.norm(turn, axis=1, keepdims=True)
        angular = 2.0 * _conjugate_product(turn, spin) / length**2
        return turn / length, value[:, :3], bend[:, :3], angular


def specific_force(quaternions: Floats, accelerations: Floats, up: str) -> Floats:
    """Returns an accelerometer's measurements [m, 3] in the body's axes, in m/s².

    A measurement is the acceleration minus gravity. `quaternions` [m, 4] are world_from_body, `accelerations` [m, 3]
    are in world axes, and `up` is the world's up axis.
    """
    lifted = accelerations.copy()
    lifted[:, 2 if up == "z" else 1] += GRAVITY
    return _turned_back(quaternions, lifted)


def _curvatures(times: Floats, values: Floats) -> Floats:
    """Returns the second derivatives [n, k] of the cubic splines through `values`.

    The splines' third derivatives are continuous at the second and the last but one point.
    """
    h = np.diff(times)
    slopes = np.diff(values, axis=0) / h[:, None]
    right = np.diff(slopes, axis=0)
    low, middle, high = h[:-1] / 6.0, (h[:-1] + h[1:]) / 3.0, h[1:] / 6.0
    # The first and the last second derivative are replaced by the extrapolation of the next two.
    ratio, last = h[0] / h[1], h[-1] / h[-2]
    middle[0] += low[0] * (1.0 + ratio)
    high[0] -= low[0] * ratio
    middle[-1] += high[-1] * (1.0 + last)
    low[-1] -= high[-1] * last
    for i in range(1, len(middle)):  # Thomas algorithm for tridiagonal systems
        factor = low[i] / middle[i - 1]
        middle[i] -= factor * high[i - 1]
        right[i] -= factor * right[i - 1]
    inner = np.empty_like(right)
    inner[-1] = right[-1] / middle[-1]
    for i in range(len(middle) - 2, -1, -1):
        inner[i] = (right[i] - high[i] * inner[i + 1]) / middle[i]
    start = (1.0 + ratio) * inner[0] - ratio * inner[1]
    end = (1.0 + last) * inner[-1] - last * inner[-2]
    return np.concatenate([start[None], inner, end[None]])


def _conjugate_product(first: Floats, second: Floats) -> Floats:
    """Returns the vector part [m, 3] of conj(first) * second, quaternions as (x, y, z, w)."""
    v, w = first[:, :3], first[:, 3:]
    found: Floats = w * second[:, :3] - second[:, 3:] * v - np.cross(v, second[:, :3])
    return found


def _turned_back(quaternions: Floats, vectors: Floats) -> Floats:
    """Returns vectors [m, 3] of the world in the axes of bodies.

    The bodies have quaternions world_from_body [m, 4].
    """
    v, w = -quaternions[:, :3], quaternions[:, 3:]
    doubled = 2.0 * np.cross(v, vectors)
    found: Floats = vectors + w * doubled + np.cross(v, doubled)
    return found
