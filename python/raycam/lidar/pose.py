"""Poses of a sensor over time."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..arguments import Floats, product
from ..rotations import turn_about

__all__ = ["Track", "transform"]


@dataclass(frozen=True)
class Track:
    """Poses world_from_sensor at ascending times; constant before the first and after the last."""

    times: Floats
    """Seconds from the frame's start [k]."""
    rotations: Floats
    """The rotations of the poses [k, 3, 3]."""
    positions: Floats
    """The positions of the poses [k, 3], metres."""

    def at(self, times: Floats) -> tuple[Floats, Floats]:
        """Returns rotations [n, 3, 3] and positions [n, 3] at `times` [n].

        Positions are interpolated linearly, and rotations along the shortest arc.
        """
        if len(self.times) == 1:
            return np.broadcast_to(self.rotations[0], (len(times), 3, 3)), np.broadcast_to(
                self.positions[0], (len(times), 3)
            )
        moments, where = np.unique(times, return_inverse=True)
        clamped = np.clip(moments, self.times[0], self.times[-1])
        after = np.clip(np.searchsorted(self.times, clamped, side="right"), 1, len(self.times) - 1)
        start, end = self.times[after - 1], self.times[after]
        part = (clamped - start) / (end - start)
        first, last = self.positions[after - 1], self.positions[after]
        places = first + (last - first) * part[:, None]
        turns = np.empty((len(moments), 3, 3))
        for piece in np.unique(after):
            chosen = after == piece
            axis, angle = _arc(self.rotations[piece - 1], self.rotations[piece])
            turns[chosen] = [
                product(turn_about(axis, angle * share), self.rotations[piece - 1]) for share in part[chosen]
            ]
        return turns[where], places[where]

    def velocity_at(self, times: Floats) -> tuple[Floats, Floats]:
        """Returns velocities in m/s and angular velocities in rad/s in world axes, [n, 3] each.

        Both are 0 before the first pose and after the last. At the time of a pose, they are the velocities of the
        motion that follows.
        """
        linear, angular = np.zeros((len(times), 3)), np.zeros((len(times), 3))
        piece = np.searchsorted(self.times, times, side="right")
        for after in np.unique(piece).tolist():
            if 0 < after < len(self.times):
                span = float(self.times[after] - self.times[after - 1])
                axis, angle = _arc(self.rotations[after - 1], self.rotations[after])
                linear[piece == after] = (self.positions[after] - self.positions[after - 1]) / span
                angular[piece == after] = axis * (angle / span)
        return linear, angular


def _arc(first: Floats, last: Floats) -> tuple[Floats, float]:
    """Returns the axis and the angle in radians of the rotation from `first` to `last`.

    The axis is in world coordinates.
    """
    step = product(last, first.T)
    axis = np.array([step[2, 1] - step[1, 2], step[0, 2] - step[2, 0], step[1, 0] - step[0, 1]])
    sine = math.sqrt(sum(float(x) ** 2 for x in axis)) / 2.0
    cosine = (float(step[0, 0] + step[1, 1] + step[2, 2]) - 1.0) / 2.0
    angle = math.atan2(sine, cosine)
    if sine > 1e-9:
        return axis / (2.0 * sine), angle
    if cosine > 0.0:
        return np.array([0.0, 0.0, 1.0]), 0.0
    largest = int(np.argmax(np.diag(step)))
    column = step[:, largest] + np.eye(3)[:, largest]
    return column / math.sqrt(sum(float(x) ** 2 for x in column)), math.pi


def transform(turns: Floats, vectors: Floats) -> Floats:
    """Returns the vectors [n, 3] rotated by the matrices [n, 3, 3].

    The result has the same bits on every processor.
    """
    if len(turns) and not turns.strides[0]:  # the same matrix for all pulses
        turns = turns[:1]
    x, y, z = vectors.T
    turned = np.empty(vectors.shape)
    for axis in range(3):
        turned[:, axis] = x * turns[:, axis, 0] + y * turns[:, axis, 1] + z * turns[:, axis, 2]
    return turned
