"""The positions of a robot's joints as points of its objects, for keypoints of data sets."""

from __future__ import annotations

from collections.abc import Container
from typing import NamedTuple

import numpy as np

from ..arguments import Floats
from ..errors import Notice
from .description import Joint
from .robot import Robot

__all__ = ["JointPoint", "joint_points"]

ROTATING = ("revolute", "continuous", "ball")
"""Types of joints whose origin is a fixed point of both links."""


class JointPoint(NamedTuple):
    """The origin of a joint."""

    joint: str
    point: Floats
    """Position [3] in the coordinates of the first object's mesh."""
    objects: list[str]
    """The object with which the point moves, and then the other objects of the links that the joint connects."""
    parent: str | None
    """The nearest of the given joints between this joint and the root, or None."""


def joint_points(robot: Robot, objects: Container[str]) -> tuple[list[JointPoint], list[Notice]]:
    """Returns the origins of a robot's joints in the order of the file, and notices.

    Fixed joints are omitted. A point moves with an object of the joint's child link, or of a link that is fixed to this
    link. If no such object exists and the joint rotates, the point moves with an object of the parent link. Joints
    without such an object are omitted with a notice. `objects` are the names of the objects to use.
    """
    joints = robot.description.joints
    above = {joint.child: joint for joint in joints.values()}
    bodies = _rigid_bodies(list(robot.links), list(joints.values()))
    shapes = _shapes_of_bodies(robot, objects, bodies)
    found: dict[str, JointPoint] = {}
    notices = []
    for joint in joints.values():
        if joint.type == "fixed":
            continue
        (child, body_from_child), (parent, body_from_parent) = bodies[joint.child], bodies[joint.parent]
        of_child, of_parent = shapes.get(child, []), shapes.get(parent, [])
        if of_child:
            name, mesh_from_body = of_child[0]
            in_body = body_from_child @ _child_from_joint(joint)
        elif of_parent and joint.type in ROTATING:
            name, mesh_from_body = of_parent[0]
            in_body = body_from_parent @ joint.parent_from_joint
        else:
            text = (
                f"robot {robot.name!r}: joint {joint.name!r} has no keypoint, because no object moves with it"
            )
            notices.append(Notice(text, "ignored_element"))
            continue
        point = (mesh_from_body @ in_body[:, 3])[:3]
        own = dict.fromkeys([name, *(each for each, _ in [*of_child, *of_parent])])
        found[joint.name] = JointPoint(joint.name, point, list(own), None)
    named = [each._replace(parent=_parent(above, joints[name], found)) for name, each in found.items()]
    return named, notices


def _shapes_of_bodies(
    robot: Robot, objects: Container[str], bodies: dict[str, tuple[str, Floats]]
) -> dict[str, list[tuple[str, Floats]]]:
    """The objects of each rigid body with mesh_from_body [4, 4], in the order of the links."""
    of_links: dict[str, list[tuple[str, Floats]]] = {}
    for name, link, link_from_mesh in robot._parts:
        if name in objects and abs(np.linalg.det(link_from_mesh[:3, :3])) > 0:
            of_links.setdefault(link, []).append((name, link_from_mesh))
    shapes: dict[str, list[tuple[str, Floats]]] = {}
    for link in robot.links:
        body, body_from_link = bodies[link]
        for name, link_from_mesh in of_links.get(link, []):
            body_from_mesh: Floats = body_from_link @ link_from_mesh
            mesh_from_body: Floats = np.asarray(np.linalg.inv(body_from_mesh), np.float64)
            shapes.setdefault(body, []).append((name, mesh_from_body))
    return shapes


def _child_from_joint(joint: Joint) -> Floats:
    joint_from_child: Floats = np.eye(4) if joint.joint_from_child is None else joint.joint_from_child
    return np.asarray(np.linalg.inv(joint_from_child), np.float64)


def _rigid_bodies(links: list[str], joints: list[Joint]) -> dict[str, tuple[str, Floats]]:
    """Returns the body of each link, and body_from_link [4, 4], by link.

    The body is the first link of the group of links that fixed joints connect.
    """
    above = {joint.child: joint for joint in joints if joint.type == "fixed"}
    bodies: dict[str, tuple[str, Floats]] = {}
    for link in links:
        body = link
        pose: Floats = np.eye(4)
        while body in above:
            joint = above[body]
            pose = joint.parent_from_joint @ np.linalg.inv(_child_from_joint(joint)) @ pose
            body = joint.parent
        bodies[link] = (body, pose)
    return bodies


def _parent(above: dict[str, Joint], joint: Joint, found: Container[str]) -> str | None:
    """The nearest joint towards the root that has a point."""
    while joint.parent in above:
        joint = above[joint.parent]
        if joint.name in found:
            return joint.name
    return None
