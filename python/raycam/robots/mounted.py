"""Cameras mounted on a robot's link, which follow its joints."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from .._core import Camera as CoreCamera
from ..arguments import Floats
from ..camera import Camera
from .robot import Robot

__all__ = ["MountedCamera"]


class MountedCamera(Camera):
    """A camera on a link, from `Camera.mounted`; its pose follows the joints of the robot.

    It can be used like any camera. Copies (`replace`, `resized`, ...) and pickles are plain cameras at the current
    pose.
    """

    __slots__ = ("_link", "_on_link", "_robot")

    def __init__(self, camera: Camera, robot: Robot, link: str) -> None:
        robot.pose(link)  # raises an error for an unknown link
        self._on_link, self._robot, self._link = camera, robot, link
        self._lens, self._up = camera._lens, camera._up

    @property
    def robot(self) -> Robot:
        """The robot."""
        return self._robot

    @property
    def link(self) -> str:
        """The name of the link."""
        return self._link

    @property
    def on_link(self) -> Camera:
        """The camera with its pose relative to the link.

        R is camera_from_link, C the centre in the link's frame.
        """
        return self._on_link

    @property
    def _core(self) -> CoreCamera:  # type: ignore[override]
        return place_camera(self._on_link, self._robot.pose(self._link))._core

    @classmethod
    def _of(cls, core: CoreCamera, up: str, lens: Any = None) -> Any:
        return Camera._of(core, up, lens)

    def __reduce__(self) -> tuple[Callable[..., Any], tuple[Any, ...]]:
        """Pickles the camera at its current pose, as a plain camera."""
        return Camera._of(self._core, self._up).__reduce__()


def place_camera(on_link: Camera, world_from_link: Floats) -> Camera:
    """Returns the camera in the world: `on_link` has its pose relative to the link."""
    rotation = world_from_link[:3, :3]
    r, c = on_link.R @ rotation.T, rotation @ on_link.location + world_from_link[:3, 3]
    return Camera._of(on_link._core.at_pose(np.asarray(r).tolist(), c.tolist()), on_link._up, None)
