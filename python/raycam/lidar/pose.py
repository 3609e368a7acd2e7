"""Poses of a sensor over time."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..arguments import Floats, product

__all__ = ["Track", "rotation_of", "transform"]

WORLD_FROM_REFERENCE = {"z": np.eye(3), "y": np.array([[0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [-1.0, 0.0, 0.0]])}
"""Sensor axes (x forward, y left, z up) in the world at zero angles, by the world's up axis, as for cameras."""


@dataclass(frozen=True)
class Track:
    """Poses world_from_sensor at ascending times; constant before the first and after the last."""

    times: Floats
    """Seconds from the frame's start [k]."""
    rotations: Floats
    """[k, 3, 3]."""
    positions: Floats
    """[k, 3]."""

    def at(self, times: Floats) -> tuple[Floats, Floats]:
        """Returns rotations [n, 3, 3] and positions [n, 3]: lines, and the shortest arcs, between the poses."""
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


def _arc(first: Floats, last: Floats) -> tuple[Floats, float]:
    """Returns the axis and the angle of the rotation from `first` to `last`, in world coordinates."""
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


def turn_about(axis: Floats, angle: float) -> Floats:
    """Returns the rotation matrix about a unit axis by `angle` radians (Rodrigues)."""
    x, y, z = (float(value) for value in axis)
    c, s = math.cos(angle), math.sin(angle)
    k = 1.0 - c
    return np.array(
        [
            [c + x * x * k, x * y * k - z * s, x * z * k + y * s],
            [y * x * k + z * s, c + y * y * k, y * z * k - x * s],
            [z * x * k - y * s, z * y * k + x * s, c + z * z * k],
        ]
    )


def rotation_of(roll: float, pitch: float, yaw: float, up: str) -> Floats:
    """Returns world_from_sensor for angles in degrees: Rz(yaw) Ry(pitch) Rx(roll) in the axes of REP-103."""
    turn = np.eye(3)
    for axis, angle in ((2, yaw), (1, pitch), (0, roll)):
        turn = product(turn, turn_about(np.eye(3)[axis], math.radians(angle)))
    return product(WORLD_FROM_REFERENCE[up], turn)


def transform(turns: Floats, vectors: Floats) -> Floats:
    """Returns the vectors [n, 3] turned by the matrices [n, 3, 3], the same to the last bit on every processor."""
    if len(turns) and not turns.strides[0]:  # one matrix for all
        turns = turns[:1]
    x, y, z = vectors.T
    turned = np.empty(vectors.shape)
    for axis in range(3):
        turned[:, axis] = x * turns[:, axis, 0] + y * turns[:, axis, 1] + z * turns[:, axis, 2]
    return turned
