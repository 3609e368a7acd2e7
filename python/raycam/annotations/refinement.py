"""Estimates the joint values of robots from the pixels of known points: the inverse of `keypoints`."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..arguments import Bools, Floats, floats, real, wholes
from ..camera import Camera
from ..errors import Notice, SettingsError, nearest
from ..notices import warn_all
from ..one_line import one_line
from ..render.arguments import camera_of, world_of
from ..robots import Robot
from ..world import World
from .point_projection import PointProjection

__all__ = ["Refined", "refine"]

PREFIX = "joints:"
MAX_STEPS = 200
MAX_DAMPING = 1e12
TOLERANCE = 1e-13
"""Relative change of the joint values or of the sum of squares below which the estimate has converged."""
UNDETERMINED = 1e-9
"""Singular values of the scaled Jacobian below this share of the largest one determine no joint."""


@one_line
@dataclass(frozen=True, eq=False)
class Refined:
    """Joint values from `refine`."""

    world: World
    """A copy of the world with the estimated joint values."""
    joints: dict[str, Floats]
    """For each robot, its joint vector [k] in the order of `Robot.joints`."""
    deviations: dict[str, Floats]
    """For each robot, the standard deviation of each column of `Robot.jacobian`, in radians or metres; infinite for
    joints that the points do not determine.
    """
    residuals: Floats
    """Projected minus measured pixels [c, n, 2]; NaN for points that were not measured."""
    rms: float
    """Root mean square of the residuals' lengths, in pixels."""
    converged: bool
    """False if the number of steps was not sufficient."""


def refine(
    world: World | str | os.PathLike[str],
    cameras: Camera | str | Sequence[Camera | str] | None,
    pixels: npt.ArrayLike,
    points: npt.ArrayLike,
    objects: Sequence[int],
    parameters: Sequence[str],
    *,
    sigma: float = 1.0,
) -> Refined:
    """Estimates joint values of robots from the pixels of known points.

    `points` [n, 3] are in the coordinates of the meshes of `objects`, one object id for each point, as in `keypoints`.
    `pixels` are their measured pixels [n, 2] in one camera, or [c, n, 2] in several `cameras`; NaN marks points that
    were not measured. A camera is a `Camera` or the name of one of the world's cameras. Cameras on a robot's link
    follow its joints. `parameters` contains `joints:ROBOT` for each robot whose joint values are estimated. The
    estimate starts at the world's joint values, which should be near (for revolute joints, about 0.5 rad).

    The sum of squared pixel differences is minimised with the Jacobian of the robot in closed form and the method of
    Levenberg and Marquardt. `sigma` is the standard deviation of a measured pixel coordinate, from which `deviations`
    follow. Joints that the points do not determine keep their values, with a notice. Limits of joints are not applied;
    a notice names values beyond them. Source: Marquardt, An algorithm for least-squares estimation of nonlinear
    parameters, 1963.

    Raises `SettingsError` for unknown parameters, robots and objects, for arrays of a wrong shape, and if a camera does
    not show a measured point at the initial joint values.
    """
    source = world_of(world)
    robots = [_robot(source, name) for name in parameters]
    one = cameras is None or isinstance(cameras, Camera | str)
    views = [camera_of(source, camera) for camera in ([cameras] if one else cameras)]  # type: ignore[union-attr]
    places = floats("points", points, ("n", 3))
    measured = _pixels(pixels, len(views), len(places))
    numbers = wholes("objects", objects, 0, len(source.objects) - 1)
    if len(numbers) != len(places):
        raise SettingsError(
            f"objects has {len(numbers)} entries for {len(places)} points; expected one entry for each point",
            code="wrong_shape",
        )
    names = [source.objects[int(number)].name for number in numbers]
    fixed = np.array([source.objects[int(number)].matrix for number in numbers])
    model = PointProjection(robots, views, places, names, fixed)
    shown: Bools = np.asarray(np.isfinite(measured).all(axis=2))
    _check_shown(model, shown)
    values, converged = _minimise(model, measured, shown)
    residuals = np.where(shown[..., None], model.pixels(values) - measured, np.nan)
    spread = _deviations(model, values, shown, real("sigma", sigma, 0.0, above=True))
    found = source.copy()
    for robot in robots:
        found.set_joints(robot.name, values[robot.name])
    unknown = [
        f"{name}: {joint}"
        for name, joint, deviation in model.name_columns(spread)
        if not np.isfinite(deviation)
    ]
    if unknown:
        text = f"refine: the points do not determine all joints; unchanged: {', '.join(unknown)}"
        warn_all([Notice(text, "missing_value")])
    length = np.linalg.norm(residuals[shown], axis=1)
    rms = float(np.sqrt(np.mean(length**2))) if len(length) else 0.0
    return Refined(found, values, spread, residuals, rms, converged)


def _robot(world: World, parameter: str) -> Robot:
    """The robot of a parameter `joints:ROBOT`."""
    name = str(parameter).removeprefix(PREFIX)
    if not isinstance(parameter, str) or not parameter.startswith(PREFIX):
        raise SettingsError(
            f"parameters: unknown parameter {parameter!r}; expected joints:ROBOT", code="unknown_name"
        )
    if name not in world.robots:
        raise SettingsError(f"parameters: {nearest('robot', name, list(world.robots))}", code="unknown_name")
    return world.robots[name]


def _pixels(pixels: npt.ArrayLike, cameras: int, points: int) -> Floats:
    """The measured pixels [c, n, 2]."""
    found = np.asarray(pixels, np.float64)
    if found.shape == (points, 2) and cameras == 1:
        found = found[None]
    if found.shape != (cameras, points, 2):
        raise SettingsError(
            f"pixels must have the shape [{cameras}, {points}, 2], got {list(found.shape)}",
            code="wrong_shape",
        )
    return found


def _check_shown(model: PointProjection, shown: Bools) -> None:
    """Raises `SettingsError` if a camera does not show a measured point at the initial values."""
    missing = np.argwhere(shown & ~np.isfinite(model.pixels(model.start())).all(axis=2))
    if len(missing):
        camera, point = missing[0]
        raise SettingsError(
            f"pixels: camera {camera} does not show point {point} at the initial joint values; set joint values near "
            "the expected ones, or mark the point with NaN",
            code="out_of_range",
        )


def _minimise(model: PointProjection, measured: Floats, shown: Bools) -> tuple[dict[str, Floats], bool]:
    """The values with the smallest sum of squares, and whether the search has converged."""
    values, damping = model.start(), 1e-3
    error = (model.pixels(values) - measured)[shown]
    for _ in range(MAX_STEPS):
        jacobian = model.jacobian(values)[shown].reshape(-1, model.columns)
        scale = np.linalg.norm(jacobian, axis=0)
        scale[scale == 0] = 1.0
        u, singular, turned = np.linalg.svd(jacobian / scale, full_matrices=False)
        used = singular > UNDETERMINED * singular.max(initial=0.0)
        right = u.T[used] @ error.ravel()
        while damping < MAX_DAMPING:
            step = -(turned[used].T @ (singular[used] / (singular[used] ** 2 + damping) * right)) / scale
            moved = model.advance(values, step)
            new = (model.pixels(moved) - measured)[shown]
            if np.isfinite(new).all() and np.sum(new**2) <= np.sum(error**2):
                break
            damping *= 4
        else:
            return values, True  # no step reduces the error any further
        size = 1.0 + max((float(np.abs(one).max(initial=0.0)) for one in values.values()), default=0.0)
        gain = np.sum(error**2) - np.sum(new**2)
        is_last = gain <= TOLERANCE * np.sum(new**2) or np.abs(step).max(initial=0.0) <= TOLERANCE * size
        values, error, damping = moved, new, max(damping / 10, 1e-15)
        if is_last:
            return values, True
    return values, False


def _deviations(
    model: PointProjection, values: dict[str, Floats], shown: Bools, sigma: float
) -> dict[str, Floats]:
    """The standard deviation of each column of the robots' Jacobians."""
    jacobian = model.jacobian(values)[shown].reshape(-1, model.columns)
    scale = np.linalg.norm(jacobian, axis=0)
    scale[scale == 0] = 1.0
    _, singular, turned = np.linalg.svd(jacobian / scale, full_matrices=True)
    full = np.zeros(model.columns)
    full[: len(singular)] = singular
    used = full > UNDETERMINED * full.max(initial=0.0)
    inverse = np.where(used, 1 / np.where(used, full, 1.0), 0.0)
    found = sigma * np.linalg.norm(inverse[:, None] * turned, axis=0) / scale
    found[(np.abs(turned[~used]) > 1e-6).any(axis=0)] = np.inf
    return model.by_robot(found)
