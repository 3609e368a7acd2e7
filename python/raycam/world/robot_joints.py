"""Joint values of the robots of a world."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import _core
from ..arguments import Floats
from ..camera import Camera
from ..errors import SettingsError, WorldError, nearest
from ..notices import warn_all
from ..one_line import counted
from ..robots import JointValues, MountedCamera, Robot, place_camera

if TYPE_CHECKING:
    from .contents import WorldContents

__all__ = ["find_robot", "follow_joints", "joint_poses", "mounted_camera", "move_robot"]


def find_robot(world: WorldContents, name: object) -> Robot:
    """Returns the robot of this name; raises `WorldError` with the nearest known name."""
    if not isinstance(name, str) or name not in world._robots:
        raise WorldError(nearest("robot", name, list(world._robots)), code="unknown_name")
    return world._robots[name]


def move_robot(world: WorldContents, name: str, joints: JointValues, *, clamp: bool) -> None:
    """Sets joint values of a robot and moves its objects and cameras."""
    robot = find_robot(world, name)
    if joints is None:
        raise WorldError("set_joints: expected joint values, got None", code="wrong_type")
    vectors, single = robot._vectors(joints)
    if not single:
        raise WorldError(
            f"set_joints: expected one joint vector, got {len(vectors)}; for several vectors, use render_many(joints=)",
            code="wrong_shape",
        )
    vectors, notices = robot._limited(vectors, clamp)
    current = {item[0]: np.array(item[4]) for item in world._core.objects}
    for which, matrices in robot._object_matrices(vectors).items():
        if which in current and not np.array_equal(current[which], matrices[0]):
            _core.world_set_object(world._core, which, {"matrix": matrices[0]})
    robot._values = vectors[0].copy()
    if world._core.time is not None:
        robot._motion = None
    for camera, link, on_link in robot._cameras:
        if camera in world.cameras:
            _core.world_set_camera(world._core, camera, place_camera(on_link, robot.pose(link))._core)
    warn_all(notices)


def joint_poses(world: WorldContents, joints: Mapping[str, JointValues]) -> dict[str, Floats]:
    """Returns world_from_mesh [n, 4, 4] of the objects of robots.

    There is one matrix for each row of joint values; each row belongs to an image.
    """
    if not isinstance(joints, Mapping):
        raise WorldError(
            f"joints must map robot names to joint values, got {type(joints).__name__}", code="wrong_type"
        )
    poses: dict[str, Floats] = {}
    present = {item[0] for item in world._core.objects}
    for name, values in joints.items():
        robot = find_robot(world, name)
        vectors, notices = robot._limited(robot._vectors(values)[0], clamp=False)
        if len(vectors) == 0:
            raise WorldError(
                f"joints[{name!r}] is empty; expected a vector for each image", code="missing_value"
            )
        warn_all(notices)
        poses |= {key: found for key, found in robot._object_matrices(vectors).items() if key in present}
    return poses


def mounted_camera(world: WorldContents, camera: Any) -> Any:
    """Returns a robot's mounted camera for its name; all other values are returned unchanged."""
    if isinstance(camera, str):
        for robot in world._robots.values():
            for name, link, on_link in robot._cameras:
                if name == camera and name in world.cameras:
                    return MountedCamera(on_link, robot, link)
    return camera


def follow_joints(
    world: WorldContents, cameras: list[Camera], joints: Mapping[str, JointValues]
) -> list[Camera]:
    """Returns the cameras of many images.

    Cameras on the robots of `joints` are placed for each joint vector. Raises `SettingsError` if the numbers of cameras
    and joint vectors differ and neither is 1.
    """
    placed: list[list[Camera]] = []
    for camera in cameras:
        if isinstance(camera, MountedCamera) and camera.robot.name in joints:
            robot = find_robot(world, camera.robot.name)
            vectors, _ = robot._vectors(joints[robot.name])
            poses = robot.pose(camera.link, vectors)
            placed.append([place_camera(camera.on_link, pose) for pose in poses])
        else:
            placed.append([camera])
    if len(placed) == 1:
        return placed[0]
    for number, one in enumerate(placed):
        if len(one) not in (1, len(placed)):
            raise SettingsError(
                f"joints: got {counted(len(one), 'joint vector')} for {counted(len(placed), 'camera')}; "
                "pass one vector per camera, or one camera",
                code="wrong_shape",
            )
        placed[number] = [one[number if len(one) > 1 else 0]]
    return [one[0] for one in placed]
