"""Poses of links from joint values, in float64."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..arguments import Floats
from .description import Joint, JointType, RobotDescription
from .transforms import quaternion_matrices, quaternions_of, rotation_of, rotations_about
from .tree import joint_order

__all__ = ["WIDTHS", "Kinematics"]

WIDTHS: dict[JointType, int] = {
    "revolute": 1,
    "continuous": 1,
    "prismatic": 1,
    "planar": 3,
    "floating": 7,
    "ball": 4,
    "fixed": 0,
}
"""Number of values per joint: planar x, y, yaw; floating x y z and a quaternion x y z w, ball the quaternion."""

VELOCITIES: dict[JointType, int] = {**WIDTHS, "floating": 6, "ball": 3}
"""Number of columns of the Jacobian per joint."""


class Source(NamedTuple):
    """The rule by which a joint's values follow from a joint vector.

    The values are `multiplier` times the values of the vector from the index `start` on, plus `offset`.
    """

    start: int
    multiplier: float = 1.0
    offset: float = 0.0


class Kinematics:
    """The kinematics of a robot: `root_from_link` for vectors of joint values.

    A vector contains the values of all joints that are not fixed and do not mimic another, in the order of the file.
    """

    def __init__(self, robot: RobotDescription) -> None:
        self.order = joint_order(robot)
        self.joints = {
            name: joint
            for name, joint in robot.joints.items()
            if joint.type != "fixed" and joint.mimic is None
        }
        """The independent joints by name."""
        self.starts: dict[str, int] = {}
        """The index of each independent joint's first value."""
        self.size = 0
        """The length of a vector."""
        for name, joint in self.joints.items():
            self.starts[name] = self.size
            self.size += WIDTHS[joint.type]
        self.links = list(robot.links)
        self._joint_of = {joint.child: joint for joint in self.order}
        self._sources = {name: self._source(robot, joint) for name, joint in robot.joints.items()}
        self.root = next(name for name in robot.links if name not in self._joint_of)

    def _source(self, robot: RobotDescription, joint: Joint) -> Source:
        """Returns the source of a joint's values, which for a mimic joint is another joint."""
        multiplier, offset = 1.0, 0.0
        while joint.mimic is not None:
            followed, factor, addend = joint.mimic
            offset += multiplier * addend
            multiplier *= factor
            joint = robot.joints[followed]
        return Source(self.starts.get(joint.name, 0), multiplier, offset)

    def zero(self) -> Floats:
        """Returns the vector of initial values, from the file or else zero.

        Zeros are clamped to the joints' limits. The rotation of floating joints is the identity.
        """
        values = np.zeros(self.size)
        for name, joint in self.joints.items():
            start = self.starts[name]
            if joint.initial is not None:
                values[start : start + len(joint.initial)] = joint.initial
            elif joint.type == "floating":
                values[start + 6] = 1.0
            elif joint.type != "planar":
                values[start] = np.clip(0.0, joint.lower, joint.upper)
        return values

    def poses(self, values: Floats) -> dict[str, Floats]:
        """Returns root_from_link [n, 4, 4] of every link for joint vectors [n, size]."""
        count = len(values)
        poses = {self.root: np.broadcast_to(np.eye(4), (count, 4, 4))}
        for joint in self.order:
            poses[joint.child] = poses[joint.parent] @ self.parent_from_child(joint, values)
        return poses

    def pose(self, values: Floats, link: str) -> Floats:
        """Returns root_from_link [n, 4, 4] of one link for joint vectors [n, size].

        Only the joints between the root and the link are evaluated.
        """
        joints = {joint.child: joint for joint in self.order}
        chain = []
        while link != self.root:
            chain.append(joints[link])
            link = joints[link].parent
        found: Floats = np.broadcast_to(np.eye(4), (len(values), 4, 4))
        for joint in reversed(chain):
            found = found @ self.parent_from_child(joint, values)
        return found

    def parent_from_child(self, joint: Joint, values: Floats) -> Floats:
        """Returns the transforms of a joint's child link in its parent link.

        The shape is [n, 4, 4] for joint vectors [n, size], or [4, 4] for a fixed joint.
        """
        local = joint.parent_from_joint
        motion = self._motion(joint, values)
        moved = local if motion is None else local @ motion
        return moved if joint.joint_from_child is None else moved @ joint.joint_from_child

    def _values(self, joint: Joint, values: Floats) -> Floats:
        """The values [n, width] of a joint."""
        start, multiplier, offset = self._sources[joint.name]
        return multiplier * values[:, start : start + WIDTHS[joint.type]] + offset

    def _motion(self, joint: Joint, values: Floats) -> Floats | None:
        """The transform [n, 4, 4] of a joint's values; None for a fixed joint."""
        if joint.type == "fixed":
            return None
        given = self._values(joint, values)
        motion = np.tile(np.eye(4), (len(values), 1, 1))
        if joint.type in ("revolute", "continuous"):
            motion[:, :3, :3] = rotations_about(joint.axis, given[:, 0])
        elif joint.type == "prismatic":
            motion[:, :3, 3] = given * joint.axis
        elif joint.type == "planar":
            across, along = plane_axes(joint.axis)
            motion[:, :3, :3] = rotations_about(joint.axis, given[:, 2])
            motion[:, :3, 3] = given[:, :1] * across + given[:, 1:2] * along
        elif joint.type == "ball":
            motion[:, :3, :3] = quaternion_matrices(given)
        else:
            motion[:, :3, :3] = quaternion_matrices(given[:, 3:])
            motion[:, :3, 3] = given[:, :3]
        return motion

    @property
    def velocity_joints(self) -> list[str]:
        """The joint of each column of the Jacobian."""
        return [name for name, joint in self.joints.items() for _ in range(VELOCITIES[joint.type])]

    def advance(self, values: Floats, step: Floats) -> Floats:
        """Returns the joint vector [size] after a step [n] with the meaning of the Jacobian's columns."""
        found, column = values.copy(), 0
        for name, joint in self.joints.items():
            count, start = VELOCITIES[joint.type], self.starts[name]
            change = step[column : column + count]
            own = found[start : start + WIDTHS[joint.type]]
            if joint.type in ("floating", "ball"):
                own[:-4] += change[:-3]
                own[-4:] = quaternions_of(rotation_of(change[-3:]) @ quaternion_matrices(own[-4:][None]))[0]
            else:
                own += change
            column += count
        return found

    def jacobian(self, values: Floats, link: str) -> Floats:
        """Returns the Jacobian [6, n] of a link for one joint vector [size], in the root's axes.

        Rows 0..2 are the velocity of the link's origin, rows 3..5 the angular velocity. Each column is the derivative
        with respect to one value. A floating joint has six columns, for three translations along and three rotations
        about its parent's axes. A ball joint has three columns, for these rotations.
        """
        poses = {name: found[0] for name, found in self.poses(values[None]).items()}
        columns, count = {}, 0
        for name, independent in self.joints.items():
            columns[self.starts[name]] = count
            count += VELOCITIES[independent.type]
        jacobian = np.zeros((6, count))
        origin = poses[link][:3, 3]
        while link != self.root:
            joint = self._joint_of[link]
            if joint.type != "fixed":
                start, multiplier, _ = self._sources[joint.name]
                before, after = poses[joint.parent] @ joint.parent_from_joint, poses[link]
                if joint.joint_from_child is not None:
                    after = after @ np.linalg.inv(joint.joint_from_child)
                part = _joint_columns(joint, before, after, origin)
                jacobian[:, columns[start] : columns[start] + part.shape[1]] += multiplier * part
            link = joint.parent
        return jacobian


def _joint_columns(joint: Joint, before: Floats, after: Floats, origin: Floats) -> Floats:
    """Returns the Jacobian's columns [6, k] of one joint.

    `before` is the joint's frame, and `after` the frame of its child, in the root's axes.
    """

    def turning(axis: Floats) -> Floats:
        return np.concatenate([np.cross(axis, origin - after[:3, 3]), axis])

    def sliding(axis: Floats) -> Floats:
        return np.concatenate([axis, np.zeros(3)])

    axis = before[:3, :3] @ joint.axis
    if joint.type == "prismatic":
        columns = [sliding(axis)]
    elif joint.type == "planar":
        columns = [sliding(before[:3, :3] @ one) for one in plane_axes(joint.axis)] + [turning(axis)]
    elif joint.type == "floating":
        columns = [move(one) for move in (sliding, turning) for one in before[:3, :3].T]
    elif joint.type == "ball":
        columns = [turning(one) for one in before[:3, :3].T]
    else:
        columns = [turning(axis)]
    return np.stack(columns, axis=1)


def plane_axes(normal: Floats) -> tuple[Floats, Floats]:
    """Returns the x and y directions of a planar joint.

    If the normal is z, they are x and y of the joint's frame.
    """
    helper = np.array([1.0, 0.0, 0.0]) if abs(normal[0]) < 0.9 else np.array([0.0, 1.0, 0.0])
    across = helper - normal * (helper @ normal)
    across /= np.linalg.norm(across)
    return across, np.cross(normal, across)
