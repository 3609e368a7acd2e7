"""A rig at the poses of a trajectory file."""

from __future__ import annotations

import os
from collections.abc import Mapping

from ..calibration import Cameras, load_cameras
from ..camera import Camera
from ..errors import CameraError, SettingsError
from ..rig import Rig

__all__ = ["load_rigs", "times_of"]

IDENTITY = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]


def load_rigs(rig: object, path: str | os.PathLike[str]) -> tuple[Mapping[str, Rig], Cameras]:
    """Returns the rig with its body at each pose of a trajectory, and the trajectory.

    The file is a trajectory in a format such as tum, euroc or kitti-poses.

    Raises `SettingsError` if `rig` is not a rig, and the errors of `load_cameras`.
    """
    if not isinstance(rig, Rig):
        raise SettingsError(
            f"poses requires a raycam.Rig as cameras, not {type(rig).__name__}", code="wrong_type"
        )
    # A trajectory contains poses only, so any camera can provide the intrinsics.
    poses = load_cameras(path, intrinsics=Camera(IDENTITY, IDENTITY, [0, 0, 0], (1, 1)))
    if not len(poses):
        raise CameraError(
            f"{os.fspath(path)}: the trajectory has no poses; expected at least one pose",
            code="missing_value",
        )
    return {name: rig.at_pose(pose.R, pose.location) for name, pose in poses.items()}, poses


def times_of(cameras: Cameras) -> list[float] | None:
    """Returns the times of cameras or poses in seconds.

    The result is None if the time of one or more cameras is missing.
    """
    return [cameras.times[name] for name in cameras] if len(cameras.times) == len(cameras) else None
