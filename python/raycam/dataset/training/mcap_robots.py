"""Writes the robots of a world to a ROS 2 bag.

The bag contains their descriptions, their joint states, and the poses of their links in the frame tree.

Sources: ROS 2 `sensor_msgs/msg/JointState`, `tf2_msgs` and `robot_state_publisher`, which uses the same
topics.
"""

from __future__ import annotations

import base64
import re
from collections.abc import Callable, Iterator

import numpy as np

from ...arguments import Floats
from ...errors import Notice
from ...robots import WIDTHS, Robot
from ..plan import Plan, Record
from .cdr import BODY, WORLD, Cdr, transforms_message

__all__ = ["DESCRIPTION_TOPIC", "JOINT_STATE", "description_messages", "robot_notices", "robot_records"]

JOINT_STATE = "sensor_msgs/msg/JointState"
"""The type of the messages with joint values."""
DESCRIPTION_TOPIC = "/robot_description"
"""Last part of the names of topics with descriptions; late subscribers receive their messages too."""
Message = tuple[str, str, str]
"""Topic, type, and CDR in base64."""


def description_messages(plan: Plan) -> list[Message]:
    """Returns the messages with the robots' URDF."""
    return [
        (
            f"{_namespace(plan, robot)}{DESCRIPTION_TOPIC}",
            "std_msgs/msg/String",
            _text(robot.description.document),
        )
        for robot in plan.world.robots.values()
        if robot.description.document
    ]


def robot_notices(plan: Plan) -> list[Notice]:
    """Returns notices about robots whose file is not URDF.

    These robots have no description in the bag.
    """
    return [
        Notice(
            f"robot {robot.name!r}: {robot.description.file} is not URDF, so the bag contains no {DESCRIPTION_TOPIC};"
            " it contains the poses of the links",
            "not_written",
        )
        for robot in plan.world.robots.values()
        if not robot.description.document
    ]


def robot_records(
    plan: Plan, optical_frames: set[str], stamp_of: Callable[[Plan, int], int]
) -> Iterator[Record]:
    """Yields the joint states and link poses at each time of the data set, ordered by time.

    Frames have the names of the links. The names get the prefix `ROBOT/` if the world has several robots, or
    if a link has the name of another frame of the bag.
    """
    robots = list(plan.world.robots.values())
    if not robots:
        return
    moments = sorted({(stamp_of(plan, number), view.time) for number, view in enumerate(plan.shots)})
    others = {WORLD, *optical_frames, *([BODY] if plan.rigs else [])}
    prefixes = {robot.name: _prefix(robot, others, len(robots)) for robot in robots}
    known: set[int] = set()
    for stamp, time in moments:
        if stamp in known:
            continue
        first = not known
        known.add(stamp)
        messages: list[Message] = []
        for robot in robots:
            values = robot._values_at(time)
            messages += _state(plan, robot, values, stamp)
            messages += _poses(robot, values, stamp, prefixes[robot.name], first)
        yield {"stamp": stamp, "messages": messages}


def _namespace(plan: Plan, robot: Robot) -> str:
    """Returns the namespace of a robot's topics, or "" for a single robot.

    Names contain letters, digits and underscores.
    """
    if len(plan.world.robots) == 1:
        return ""
    name = re.sub(r"[^A-Za-z0-9_]", "_", robot.name)
    return f"/_{name}" if name[:1].isdigit() else f"/{name}"


def _prefix(robot: Robot, others: set[str], count: int) -> str:
    """The prefix of a robot's frames."""
    own = set(robot.links) - ({WORLD} if _is_world(robot) else set())
    return f"{robot.name}/" if count > 1 or own & others else ""


def _is_world(robot: Robot) -> bool:
    """True if the robot's root link is the world's frame, as in many URDF files."""
    return robot._kinematics.root == WORLD and np.array_equal(robot.world_from_root, np.eye(4))


def _text(value: str) -> str:
    return base64.b64encode(Cdr().add_text(value).to_bytes()).decode()


def _state(plan: Plan, robot: Robot, vector: Floats, stamp: int) -> list[Message]:
    """The `JointState` of all joints with one value, including mimic joints."""
    joints = [joint for joint in robot.description.joints.values() if WIDTHS[joint.type] == 1]
    positions = [float(robot._kinematics._values(joint, vector[None])[0, 0]) for joint in joints]
    if not joints:
        return []
    message = Cdr().add_header(stamp, "").add_numbers("I", len(joints))
    for joint in joints:
        message.add_text(joint.name)
    message.add_numbers("I", len(positions)).add_numbers("d", *positions).add_numbers("I", 0, 0)
    data = base64.b64encode(message.to_bytes()).decode()
    return [(f"{_namespace(plan, robot)}/joint_states", JOINT_STATE, data)]


def _poses(robot: Robot, vector: Floats, stamp: int, prefix: str, first: bool) -> list[Message]:
    """Returns the transforms of a robot's joints as messages.

    Moving joints are in /tf. With `first`, the other transforms are in /tf_static.
    """
    root = robot._kinematics.root
    moving: list[tuple[str, str, Floats]] = []
    fixed: list[tuple[str, str, Floats]] = []
    if prefix or not _is_world(robot):
        fixed.append((WORLD, prefix + root, robot.world_from_root))
    for joint in robot._kinematics.order:
        parent_from_child = robot._kinematics.parent_from_child(joint, vector[None]).reshape(4, 4)
        row = (prefix + joint.parent, prefix + joint.child, parent_from_child)
        (fixed if joint.type == "fixed" else moving).append(row)
    found = [("/tf", moving)] if moving else []
    found += [("/tf_static", fixed)] if first and fixed else []
    return [
        (topic, "tf2_msgs/msg/TFMessage", base64.b64encode(transforms_message(stamp, rows)).decode())
        for topic, rows in found
    ]
