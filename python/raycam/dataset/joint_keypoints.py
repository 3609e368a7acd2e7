"""The option keypoints="joints": a robot's joints as keypoints of its category."""

from __future__ import annotations

from typing import Any

from ..errors import Notice, SettingsError
from ..randomize import Recipe
from ..robots import joint_points
from ..world import World
from .world_sequence import WorldSequence

__all__ = ["JOINTS", "joint_keypoints"]

JOINTS = "joints"
"""The value of the option `keypoints` that selects the joints of the robots."""


def joint_keypoints(
    world: World | Recipe | WorldSequence, format: str
) -> tuple[dict[str, Any], list[Notice]]:
    """Returns the value of the option `keypoints` for the robots of a world, and notices.

    For "coco", the value contains an entry for each robot, by category; for "yolo", these entries are in a dict under
    the key "robots". The names are the names of all joints that are not fixed. The skeleton connects each joint with
    the next joint towards the root. Raises `SettingsError` for other formats, and if no robot was added with
    `category="robot"`.
    """
    if format not in ("coco", "yolo"):
        raise SettingsError(
            f'keypoints="{JOINTS}" is not supported by the format {format}; supported: coco, yolo',
            code="unsupported_feature",
        )
    objects = {} if not isinstance(world, World) else {item.name: item.category for item in world.objects}
    found: dict[str, Any] = {}
    notices: list[Notice] = []
    for robot in world.robots.values() if isinstance(world, World) else ():
        own = {name for name in robot.objects if objects.get(name) == robot.name}
        points, more = joint_points(robot, own)
        if not own or not points:
            continue
        notices += more
        numbers = {point.joint: number for number, point in enumerate(points, start=1)}
        found[robot.name] = {
            "names": list(numbers),
            "points": [point.point.tolist() for point in points],
            "objects": [point.objects for point in points],
            "skeleton": [
                [numbers[point.parent], numbers[point.joint]] for point in points if point.parent is not None
            ],
        }
    if not found:
        raise SettingsError(
            f'keypoints="{JOINTS}" requires a robot with joints that are not fixed, added with '
            'add_robot(..., category="robot") or with category = "robot" in [[robot]]',
            code="missing_value",
        )
    return (found if format == "coco" else {"robots": found}), notices
