"""A robot of a world: its links, joints, joint values and poses."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from ..arguments import Floats, floats
from ..camera import Camera
from ..errors import Notice, WorldError, nearest
from ..read_only import read_only_array
from .description import RobotDescription
from .joint_motion import JointMotion
from .kinematics import WIDTHS, Kinematics
from .transforms import quaternions_of

__all__ = ["JointValues", "Robot"]

JointValues = Mapping[str, npt.ArrayLike] | npt.ArrayLike
"""Values by joint name, or a vector in the order of `Robot.joints`."""


@dataclass
class Robot:
    """A robot in a world, from `World.robots`; `World.set_joints` moves it.

    Poses are float64 matrices [4, 4]. Joint values are in radians and metres, as in the robot's file. A vector of
    values contains the numbers of all joints in the order of `joints`: one for each revolute, continuous or prismatic
    joint, three for a planar joint (x, y, yaw), seven for a floating joint (x y z, and a quaternion x y z w) and four
    for a ball joint (the quaternion).
    """

    name: str
    """The name in `World.robots`."""
    description: RobotDescription = field(repr=False)
    """Links, joints and shapes, as read from the file."""
    world_from_root: Floats = field(repr=False)
    """The pose of the root link [4, 4]."""
    _kinematics: Kinematics = field(repr=False)
    _values: Floats = field(repr=False)
    _parts: list[tuple[str, str, Floats]] = field(default_factory=list, repr=False)
    """The object's name, the link's name and link_from_mesh [4, 4] of each object."""
    _cameras: list[tuple[str, str, Camera]] = field(default_factory=list, repr=False)
    """The name in the world, the link, and the camera with its pose relative to the link."""
    _motion: JointMotion | None = field(default=None, repr=False)
    """The motion by the world's video, or None."""
    _inner_cameras: frozenset[str] = field(default=frozenset(), repr=False)
    """The names in the world of the cameras that the robot's file has on links other than the root."""

    @classmethod
    def at_zero(cls, name: str, description: RobotDescription, world_from_root: Floats) -> Robot:
        """Returns the robot with all joints at zero, or at the limit nearest to zero."""
        kinematics = Kinematics(description)
        return cls(name, description, world_from_root, kinematics, kinematics.zero())

    @property
    def joints(self) -> tuple[str, ...]:
        """The names of the joints that can be set, in the order of the file.

        Fixed and mimic joints are not included.
        """
        return tuple(self._kinematics.joints)

    @property
    def links(self) -> tuple[str, ...]:
        """The names of the links, in the order of the file."""
        return tuple(self._kinematics.links)

    @property
    def limits(self) -> dict[str, tuple[float, float]]:
        """The lower and upper limit of each joint in `joints`, in radians or metres.

        Limits are infinite for joints without limits.
        """
        return {name: (joint.lower, joint.upper) for name, joint in self._kinematics.joints.items()}

    @property
    def values(self) -> Floats:
        """The current joint vector, float64 [n], read-only."""
        return read_only_array(
            self._values, f"world.set_joints({self.name!r}, ...) changes joints", WorldError
        )

    @property
    def objects(self) -> dict[str, str]:
        """The link of each of the robot's objects, by the object's name in the world."""
        return {name: link for name, link, _ in self._parts}

    def pose(self, link: str, joints: JointValues | None = None) -> Floats:
        """Returns world_from_link [4, 4] of a link.

        With `joints`, returns the pose for these values instead of the current ones; for vectors [n, k], poses [n, 4,
        4]. Raises `WorldError` with the nearest name for an unknown link or joint.
        """
        self._check_link(link)
        values, single = self._vectors(joints)
        poses = self.world_from_root @ self._kinematics.pose(values, link)
        return poses[0] if single else poses

    def jacobian(self, link: str, joints: JointValues | None = None) -> Floats:
        """Returns the Jacobian [6, n] of a link's pose with respect to the joint values.

        The Jacobian is in world axes and computed in closed form. Rows 0..2 are the velocity of the link's origin in
        metres, rows 3..5 its angular velocity in radians, per unit of each value in the order of `joints`. A floating
        joint has six columns: translations along its parent's axes and rotations about them. A ball joint has three
        columns, for these rotations. Raises the errors of `pose`.
        """
        self._check_link(link)
        values, single = self._vectors(joints)
        if not single:
            raise WorldError(f"jacobian: expected one joint vector, got {len(values)}", code="wrong_shape")
        rotation = self.world_from_root[:3, :3]
        return np.kron(np.eye(2), rotation) @ self._kinematics.jacobian(values[0], link)

    def __repr__(self) -> str:
        """Returns the name, the number of links and the joints as text."""
        return f"Robot {self.name!r}: {len(self.links)} links, joints {', '.join(self.joints) or 'none'}"

    # For the world ------------------------------------------------------------------------------------------

    def _copy(self) -> Robot:
        return Robot(
            self.name,
            self.description,
            self.world_from_root,
            self._kinematics,
            self._values.copy(),
            self._parts,
            self._cameras,
            self._motion,
            self._inner_cameras,
        )

    def _values_at(self, time: float | None) -> Floats:
        """Returns the joint vector at a time of the world's video.

        The result is the current joint vector if `time` is None or the video does not move the robot.
        """
        return self._values if self._motion is None or time is None else self._motion.at(time)

    def _object_matrices(self, values: Floats) -> dict[str, Floats]:
        """world_from_mesh [n, 4, 4] of every object for joint vectors [n, k]."""
        poses = self._kinematics.poses(values)
        return {
            name: self.world_from_root @ poses[link] @ link_from_mesh
            for name, link, link_from_mesh in self._parts
        }

    @property
    def _velocity_joints(self) -> list[str]:
        """The joint of each column of `jacobian`."""
        return self._kinematics.velocity_joints

    def _advance(self, values: Floats, step: Floats) -> Floats:
        """The joint vector after a step with the meaning of the columns of `jacobian`."""
        return self._kinematics.advance(values, step)

    def _vectors(self, joints: JointValues | None) -> tuple[Floats, bool]:
        """Joint vectors [n, k], and True if a single vector was given."""
        if joints is None:
            return self._values[None], True
        if isinstance(joints, Mapping):
            return self._from_mapping(joints)
        array = np.asarray(joints)
        size = self._kinematics.size
        if array.ndim not in (1, 2) or array.shape[-1] != size:
            names = ", ".join(self._described_joints()) or "none"
            raise WorldError(
                f"robot {self.name!r}: expected joint values [{size}] or [n, {size}], got the shape"
                f" {list(array.shape)}; the order is: {names}",
                code="wrong_shape",
            )
        found = floats("joints", joints, (size,), ("n", size), error=WorldError)
        self._check_values(found.reshape(-1, size))
        return found.reshape(-1, size), array.ndim == 1

    def _from_mapping(self, joints: Mapping[str, npt.ArrayLike]) -> tuple[Floats, bool]:
        parts = {name: self._joint_values(name, value) for name, value in joints.items()}
        counts = {len(part) for part, single in parts.values() if not single}
        if len(counts) > 1:
            raise WorldError(
                f"robot {self.name!r}: joints have different numbers of values "
                f"({' and '.join(map(str, sorted(counts)))}); expected equal numbers",
                code="wrong_shape",
            )
        found = np.tile(self._values, (next(iter(counts), 1), 1))
        for name, (part, _) in parts.items():
            start = self._kinematics.starts[name]
            found[:, start : start + part.shape[1]] = part
        self._check_values(found)
        return found, not counts

    def _joint_values(self, name: str, value: npt.ArrayLike) -> tuple[Floats, bool]:
        """Values [n, width] of one joint, and True if they are for a single vector."""
        joint = self._kinematics.joints.get(name)
        if joint is None:
            raise WorldError(f"robot {self.name!r}: {self._explain_unknown(name)}", code="unknown_name")
        what, width = f"joint {name!r}", WIDTHS[joint.type]
        if joint.type == "floating" and np.shape(value)[-2:] == (4, 4):
            array = floats(what, value, (4, 4), ("n", 4, 4), error=WorldError)
            return _floating_values(array.reshape(-1, 4, 4)), array.ndim == 2
        if width == 1:
            array = floats(what, value, (), ("n",), error=WorldError)
            return array.reshape(-1, 1), array.ndim == 0
        array = floats(what, value, (width,), ("n", width), error=WorldError)
        return array.reshape(-1, width), array.ndim == 1

    def _explain_unknown(self, name: object) -> str:
        joint = self.description.joints.get(str(name))
        if joint is not None and joint.mimic is not None:
            return f"joint {name!r} mimics {joint.mimic[0]!r} and cannot be set; set that joint instead"
        if joint is not None:
            return f"joint {name!r} is fixed; joints that can be set: {', '.join(self.joints) or 'none'}"
        return nearest("joint", name, list(self.joints))

    def _check_values(self, values: Floats) -> None:
        if not np.isfinite(values).all():
            wrong = [
                name
                for name, joint in self._kinematics.joints.items()
                for start in [self._kinematics.starts[name]]
                if not np.isfinite(values[:, start : start + WIDTHS[joint.type]]).all()
            ]
            raise WorldError(
                f"robot {self.name!r}: joint values must be finite: {', '.join(wrong)}", code="out_of_range"
            )
        for name, joint in self._kinematics.joints.items():
            start = self._kinematics.starts[name]
            quaternion = values[:, start : start + WIDTHS[joint.type]][:, -4:]
            if joint.type in ("floating", "ball") and not np.linalg.norm(quaternion, axis=1).all():
                raise WorldError(
                    f"robot {self.name!r}: joint {name!r}: the quaternion must not be 0 0 0 0",
                    code="not_a_rotation",
                )

    def _described_joints(self) -> list[str]:
        return [
            name if WIDTHS[joint.type] == 1 else f"{name} ({WIDTHS[joint.type]} values)"
            for name, joint in self._kinematics.joints.items()
        ]

    def _check_link(self, link: str) -> None:
        if link not in self._kinematics.links:
            raise WorldError(
                f"robot {self.name!r}: {nearest('link', link, self._kinematics.links)}", code="unknown_name"
            )

    def _limited(self, values: Floats, clamp: bool) -> tuple[Floats, list[Notice]]:
        """The vectors, clamped to the limits if `clamp`, and notices about values beyond the limits."""
        beyond, turns, held = [], [], values.copy()
        for name, joint in self._kinematics.joints.items():
            column = self._kinematics.starts[name]
            own = values[:, column]
            if joint.type not in ("revolute", "prismatic"):
                continue
            margin = 1e-9 * max(1.0, abs(joint.lower), abs(joint.upper)) if np.isfinite(joint.upper) else 0.0
            outside = (own < joint.lower - margin) | (own > joint.upper + margin)
            if joint.type == "revolute" and (outside & (abs(own) > 2 * np.pi)).any():
                turns.append(name)
            if outside.any():
                worst = own[np.argmax(np.maximum(joint.lower - own, own - joint.upper))]
                beyond.append(f"{name} = {worst:g} ({joint.lower:g} to {joint.upper:g})")
            held[:, column] = np.clip(own, joint.lower, joint.upper)
        notices = []
        if turns:
            notices.append(
                Notice(
                    f"robot {self.name!r}: joint values exceed one turn: {', '.join(turns)}; pass radians "
                    "(numpy.radians converts degrees)",
                    "implausible",
                )
            )
        if beyond and not clamp:
            notices.append(
                Notice(
                    f"robot {self.name!r}: joint values beyond their limits: {', '.join(beyond)};"
                    " clamp_joints=True clamps them",
                    "outside_limits",
                )
            )
        return (held if clamp else values), notices


def _floating_values(matrices: Floats) -> Floats:
    """Returns x y z and the quaternion x y z w of rigid transforms [n, 4, 4].

    Raises `WorldError` for other matrices.
    """
    rotation = matrices[:, :3, :3]
    rigid = np.allclose(rotation @ rotation.transpose(0, 2, 1), np.eye(3), atol=1e-6)
    if not rigid or (np.linalg.det(rotation) < 0).any() or not (matrices[:, 3] == [0, 0, 0, 1]).all():
        raise WorldError(
            "a floating joint's matrix must be a rigid transform with the last row 0 0 0 1",
            code="not_a_rotation",
        )
    found = np.empty((len(matrices), 7))
    found[:, :3] = matrices[:, :3, 3]
    found[:, 3:] = quaternions_of(rotation)
    return found
