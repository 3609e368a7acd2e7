"""Pixels of points on robots as a function of the joint values, with derivatives."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ..arguments import Floats
from ..camera import Camera
from ..robots import MountedCamera, Robot
from ..robots.mounted import place_camera

__all__ = ["PointProjection"]

STEP = 1e-6
"""Step of the numerical derivative of a projection, as a share of the distance."""
Values = dict[str, Floats]


class PointProjection:
    """The pixels of points in cameras as a function of joint values.

    `points` [n, 3] are in the coordinates of the meshes of the objects `names`, whose matrices without motion are
    `fixed` [n, 4, 4].
    """

    def __init__(
        self,
        robots: Sequence[Robot],
        cameras: Sequence[Camera],
        points: Floats,
        names: Sequence[str],
        fixed: Floats,
    ) -> None:
        self._robots = {robot.name: robot for robot in robots}
        self._cameras, self._points, self._names, self._fixed = list(cameras), points, list(names), fixed
        self._owner = {name: robot for robot in robots for name in robot.objects}
        self._starts: dict[str, int] = {}
        self.columns = 0
        """The number of columns of the Jacobian."""
        for robot in robots:
            self._starts[robot.name] = self.columns
            self.columns += len(robot._velocity_joints)

    def start(self) -> Values:
        """The current joint vector of each robot."""
        return {name: robot.values.copy() for name, robot in self._robots.items()}

    def advance(self, values: Values, step: Floats) -> Values:
        """The joint vectors after a step [columns]."""
        steps = self.by_robot(step)
        return {name: robot._advance(values[name], steps[name]) for name, robot in self._robots.items()}

    def by_robot(self, columns: Floats) -> Values:
        """Splits an array [columns] by robot."""
        counts = {name: len(robot._velocity_joints) for name, robot in self._robots.items()}
        return {name: columns[start : start + counts[name]] for name, start in self._starts.items()}

    def name_columns(self, by_robot: Values) -> Iterator[tuple[str, str, float]]:
        """Iterates over the robot, the joint and the value of each column."""
        for name, found in by_robot.items():
            for joint, value in zip(self._robots[name]._velocity_joints, found, strict=True):
                yield name, joint, float(value)

    def pixels(self, values: Values) -> Floats:
        """The pixels [c, n, 2]; NaN for points that a camera does not show."""
        world = self._world_points(values)
        return np.array([_project(self._placed(camera, values), world) for camera in self._cameras])

    def jacobian(self, values: Values) -> Floats:
        """The derivatives of the pixels [c, n, 2, columns]."""
        world = self._world_points(values)
        moved = np.zeros((len(world), 3, self.columns))
        for name in dict.fromkeys(self._names):
            if name in self._owner:
                robot, chosen = self._owner[name], [other == name for other in self._names]
                moved[chosen] = self._velocities(robot, robot.objects[name], values, world[chosen])
        found = []
        for camera in self._cameras:
            relative = moved
            if isinstance(camera, MountedCamera) and camera.robot.name in self._robots:
                # A camera that moves with its link shows the points as if they moved in the other direction.
                robot = self._robots[camera.robot.name]
                relative = moved - self._velocities(robot, camera.link, values, world)
            found.append(_derivative(self._placed(camera, values), world) @ relative)
        return np.array(found)

    def _velocities(self, robot: Robot, link: str, values: Values, points: Floats) -> Floats:
        """The velocities [n, 3, columns] of points that move with a link."""
        jacobian = robot.jacobian(link, values[robot.name])
        arms = points - robot.pose(link, values[robot.name])[:3, 3]
        found = np.zeros((len(points), 3, self.columns))
        turning = np.cross(jacobian[3:].T[None], arms[:, None])
        start = self._starts[robot.name]
        found[:, :, start : start + jacobian.shape[1]] = jacobian[:3] + turning.transpose(0, 2, 1)
        return found

    def _world_points(self, values: Values) -> Floats:
        matrices = {
            name: found[0]
            for robot in self._robots.values()
            for name, found in robot._object_matrices(values[robot.name][None]).items()
        }
        placed = np.array(
            [matrices.get(name, fixed) for name, fixed in zip(self._names, self._fixed, strict=True)]
        ).reshape(-1, 4, 4)
        found: Floats = np.einsum("nij,nj->ni", placed[:, :3, :3], self._points) + placed[:, :3, 3]
        return found

    def _placed(self, camera: Camera, values: Values) -> Camera:
        """The camera at joint values."""
        if isinstance(camera, MountedCamera) and camera.robot.name in self._robots:
            robot = self._robots[camera.robot.name]
            return place_camera(camera.on_link, robot.pose(camera.link, values[robot.name]))
        return camera


def _project(camera: Camera, points: Floats) -> Floats:
    pixels, in_front = camera.project(points)
    return np.where(in_front[:, None], pixels, np.nan)


def _derivative(camera: Camera, points: Floats) -> Floats:
    """The derivatives [n, 2, 3] of pixels with respect to points, by central differences."""
    steps = STEP * np.linalg.norm(points - camera.location, axis=1)
    columns = []
    for axis in np.eye(3):
        ahead, behind = (camera.project(points + sign * steps[:, None] * axis)[0] for sign in (1, -1))
        columns.append((ahead - behind) / (2 * steps[:, None]))
    return np.stack(columns, axis=2)
