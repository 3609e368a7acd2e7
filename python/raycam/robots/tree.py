"""The tree of links: checks, and the order in which joints are evaluated."""

from __future__ import annotations

from ..errors import FormatError, Notice, nearest
from .description import Joint, RobotDescription

__all__ = ["check_tree", "joint_order"]


def check_tree(robot: RobotDescription) -> None:
    """Checks that the joints connect all links into one tree, and that no mimics form a circle.

    Raises `FormatError`, with the joint's file and line, for other robots.
    """
    parents: dict[str, Joint] = {}
    for joint in robot.joints.values():
        for end in (joint.parent, joint.child):
            if end not in robot.links:
                text = nearest("link", end, list(robot.links))
                raise FormatError(
                    f"{robot.file}:{joint.line}: joint {joint.name!r}: {text}", code="unknown_name"
                )
        other = parents.setdefault(joint.child, joint)
        if other is not joint:
            raise FormatError(
                f"{robot.file}:{joint.line}: link {joint.child!r} has two parents: joint {joint.name!r} and joint"
                f" {other.name!r} (line {other.line})",
                code="not_a_tree",
            )
    roots = [link for name, link in robot.links.items() if name not in parents]
    if len(roots) > 1:
        named = ", ".join(f"{root.name!r} (line {root.line})" for root in roots[:10])
        raise FormatError(
            f"{robot.file}:{roots[1].line}: {len(roots)} links have no parent, expected one root: {named};"
            " connect them with joints",
            code="not_a_tree",
        )
    _check_loops(robot, parents)
    _check_mimics(robot)


def joint_order(robot: RobotDescription) -> list[Joint]:
    """Returns all joints; each joint comes after the joint of its parent link."""
    children: dict[str, list[Joint]] = {}
    for joint in robot.joints.values():
        children.setdefault(joint.parent, []).append(joint)
    moved = {joint.child for joint in robot.joints.values()}
    waiting = [name for name in robot.links if name not in moved]
    order = []
    while waiting:
        for joint in children.get(waiting.pop(), []):
            order.append(joint)
            waiting.append(joint.child)
    return order


def _check_loops(robot: RobotDescription, parents: dict[str, Joint]) -> None:
    reached: set[str] = set()
    for name in robot.links:
        path: list[str] = []
        while name in parents and name not in reached:
            reached.add(name)
            path.append(name)
            name = parents[name].parent
        if name in path:
            loop = path[path.index(name) :]
            lines = ", ".join(f"{parents[link].name!r} (line {parents[link].line})" for link in loop[:10])
            raise FormatError(
                f"{robot.file}:{parents[name].line}: the links {', '.join(loop[:10])} form a loop through the joints"
                f" {lines}; a robot must be a tree",
                code="cyclic_reference",
            )


def _check_mimics(robot: RobotDescription) -> None:
    for joint in robot.joints.values():
        path = [joint.name]
        while (mimic := robot.joints[path[-1]].mimic) is not None:
            at = f"{robot.file}:{robot.joints[path[-1]].line}: joint {path[-1]!r}"
            if mimic[0] not in robot.joints:
                text = nearest("joint", mimic[0], list(robot.joints))
                robot.notices.append(
                    Notice(f"{at}: mimic: {text}; the joint is set independently", "ignored_key")
                )
                robot.joints[path[-1]].mimic = None
                break
            if robot.joints[mimic[0]].type not in ("revolute", "continuous", "prismatic"):
                raise FormatError(
                    f"{at} mimics {mimic[0]!r}, a {robot.joints[mimic[0]].type} joint; expected a revolute, "
                    "continuous or prismatic joint",
                    code="invalid_value",
                )
            if mimic[0] in path:
                raise FormatError(
                    f"{at}: the joints {', '.join([*path, mimic[0]])} mimic each other in a circle",
                    code="cyclic_reference",
                )
            path.append(mimic[0])
