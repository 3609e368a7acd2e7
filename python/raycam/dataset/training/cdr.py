"""ROS 2 messages in CDR, and the transforms between the frames of a rig.

Sources: OMG CDR, little endian, aligned as in XCDR1; ROS 2 `tf2_msgs`; REP-105 for the frames.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from typing import Any

import numpy as np

from ...arguments import Floats, product
from ...camera import Camera
from ..plan import Plan

__all__ = ["BODY", "WORLD", "Cdr", "body_of", "mount_of", "quaternion", "transform", "transforms_message"]

WORLD, BODY = "world", "base_link"
"""The fixed frame, and the frame of a rig's body."""


class Cdr:
    """The bytes of a message in CDR, little endian."""

    def __init__(self) -> None:
        self._body = bytearray()

    def add_numbers(self, kind: str, *values: Any) -> Cdr:
        """Appends numbers of a `struct` format, each aligned to its size."""
        size = struct.calcsize(kind)
        self._body += bytes(-len(self._body) % size)
        self._body += struct.pack(f"<{len(values)}{kind}", *values)
        return self

    def add_text(self, value: str) -> Cdr:
        """Appends a string."""
        data = value.encode() + b"\0"
        self.add_numbers("I", len(data))._body += data
        return self

    def add_bytes(self, value: bytes) -> Cdr:
        """Appends a sequence of bytes."""
        self.add_numbers("I", len(value))._body += value
        return self

    def add_header(self, stamp: int, frame: str) -> Cdr:
        """Appends a `std_msgs/Header` of a time in nanoseconds."""
        return self.add_numbers("i", stamp // 10**9).add_numbers("I", stamp % 10**9).add_text(frame)

    def to_bytes(self) -> bytes:
        """The whole message."""
        return b"\0\1\0\0" + bytes(self._body)


def quaternion(rotation: Floats) -> list[float]:
    """Returns the quaternion x, y, z, w of a rotation, with w >= 0.

    Source: S. Shepperd, Quaternion from Rotation Matrix, 1978.
    """
    r, trace = rotation, np.trace(rotation)
    squares = np.array([2 * r[0, 0] - trace, 2 * r[1, 1] - trace, 2 * r[2, 2] - trace, trace])
    largest = int(np.argmax(squares))
    pairs = [[r[0, 1] + r[1, 0], r[0, 2] + r[2, 0], r[2, 1] - r[1, 2]]]
    pairs += [[r[0, 1] + r[1, 0], r[1, 2] + r[2, 1], r[0, 2] - r[2, 0]]]
    pairs += [[r[0, 2] + r[2, 0], r[1, 2] + r[2, 1], r[1, 0] - r[0, 1]]]
    pairs += [[r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]]]
    q = np.insert(np.array(pairs[largest]), largest, 1 + squares[largest])
    q /= np.sqrt((q * q).sum())
    return [float(value) for value in (q if q[3] >= 0 else -q)]


def transform(stamp: int, parent: str, child: str, rotation: Floats, translation: Floats) -> bytes:
    """Returns a `tf2_msgs/TFMessage` with one transform.

    The transform takes coordinates in `child` to coordinates in `parent`.
    """
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = rotation, translation
    return transforms_message(stamp, [(parent, child, pose)])


def transforms_message(stamp: int, rows: Sequence[tuple[str, str, Floats]]) -> bytes:
    """Returns a `tf2_msgs/TFMessage` of transforms, given as parent, child and matrix [4, 4].

    A matrix converts coordinates in the child frame to coordinates in the parent frame.
    """
    message = Cdr().add_numbers("I", len(rows))
    for parent, child, pose in rows:
        message.add_header(stamp, parent).add_text(child)
        message.add_numbers("d", *pose[:3, 3]).add_numbers("d", *quaternion(pose[:3, :3]))
    return message.to_bytes()


def body_of(plan: Plan, pose: list[int]) -> tuple[Floats, Floats]:
    """Returns the rotation body_from_world and the position of a rig's body.

    `pose` contains the numbers of the views of one of the rig's poses.
    """
    first = plan.shots[pose[0]]
    return (first.camera.R, first.camera.C) if first.body is None else first.body


def mount_of(camera: Camera, R: Floats, C: Floats) -> tuple[Floats, Floats]:
    """The rotation body_from_camera, and the camera's position on the body."""
    return product(R, camera.R.T), product(R, camera.C - C)
