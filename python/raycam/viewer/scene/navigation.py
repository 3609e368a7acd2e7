"""Navigation: pure functions from a camera and an intent to a camera, in float64, for every lens.

Angles are in radians, `up` is the world's axis that points up, "z" or "y".
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from ...arguments import Floats
from ...camera import Camera

__all__ = [
    *("dolly", "feet", "fit", "magnified", "move", "orbit", "pan", "roll", "rotation_about"),
    *("turn_camera", "turned_around", "walk"),
]

STEEPEST = math.radians(89.0)  # a camera never looks farther up or down, where its sides would swap


def orbit(camera: Camera, pivot: Floats, yaw: float, pitch: float) -> Camera:
    """Turns the camera by `yaw` about the world's up and `pitch` about its right; `pivot` [3] stays at its pixel."""
    turn = _turn(camera, yaw, pitch)
    return camera.at_pose(camera.R @ turn.T, pivot + turn @ (camera.location - pivot))


def turned_around(camera: Camera, pivot: Floats, angle: float) -> Camera:
    """Turns the camera about the world's up through `pivot`, as on a turntable."""
    turn = rotation_about(_up(camera), angle)
    return camera.at_pose(camera.R @ turn.T, pivot + turn @ (camera.location - pivot))


def turn_camera(camera: Camera, yaw: float, pitch: float) -> Camera:
    """Turns the camera around itself."""
    turn = _turn(camera, yaw, pitch)
    return camera.at_pose(camera.R @ turn.T, camera.location)


def roll(camera: Camera, angle: float) -> Camera:
    """Turns the camera around its principal axis."""
    return camera.at_pose(rotation_about(np.array([0.0, 0.0, 1.0]), angle) @ camera.R, camera.location)


def pan(camera: Camera, pivot: Floats, dx: float, dy: float) -> Camera:
    """Moves the camera sideways, so that `pivot` moves by (dx, dy) pixels where the picture has no distortion."""
    depth = 1.0 if camera.is_parallel else max(float(camera.forward @ (pivot - camera.location)), 1e-9)
    shift = -depth * (camera.R[0] * (dx / camera.K[0, 0]) + camera.R[1] * (dy / camera.K[1, 1]))
    return camera.at_pose(camera.R, camera.location + shift)


def dolly(camera: Camera, point: Floats, factor: float) -> Camera:
    """Moves the camera to `point` [3], to 1 / factor of the distance; the point stays at its pixel."""
    return camera.at_pose(camera.R, point + (camera.location - point) / factor)


def magnified(camera: Camera, point: Floats, factor: float) -> Camera:
    """A camera of parallel rays, which comes no nearer, with all things `factor` times as large; `point` [3] stays at
    its pixel. Raises `CameraError` for one that is given by its matrix.
    """
    K = camera.K * np.array([[factor, factor, 1.0], [1.0, factor, 1.0], [1.0, 1.0, 1.0]])
    return dolly(camera.replace(K=K), point, factor)


def move(camera: Camera, right: float, upwards: float, forward: float) -> Camera:
    """Moves the camera in metres along its own right, the world's up, and its principal axis."""
    shift = right * camera.R[0] + upwards * _up(camera) + forward * camera.forward
    return camera.at_pose(camera.R, camera.location + shift)


def walk(
    camera: Camera, right: float, upwards: float, forward: float, below: Callable[[Floats], float | None]
) -> Camera:
    """Moves the camera in metres along the ground, in the direction that it looks, at the same height above it.

    `below` tells how far below a point [3] the ground is; None where there is none, and the camera stays level.
    `upwards` changes the height.
    """
    up = _up(camera)
    level = camera.forward - (camera.forward @ up) * up
    if np.linalg.norm(level) < 1e-3:
        # Straight up or down: the way that the picture's top points, or its foot.
        level = np.cross(up, camera.R[0])
    level /= np.linalg.norm(level)
    place = camera.location + right * np.cross(level, up) + forward * level
    before, after = below(camera.location), below(place)
    change = 0.0 if before is None or after is None else before - after
    return camera.at_pose(camera.R, place + (upwards + change) * up)


def feet(camera: Camera, point: Floats, apart: float) -> Floats:
    """Points [5, 3] at and around `point` in its level, `apart` metres from it: cracks are narrower than a foot."""
    across = np.eye(3)[[0, 1] if camera.up == "z" else [0, 2]]
    return np.asarray(point + apart * np.concatenate([np.zeros((1, 3)), across, -across]))


def fit(camera: Camera, bounds: Floats) -> Camera:
    """Moves the camera back or forth along its view, so that the box `bounds` [2, 3] fills the picture."""
    middle = bounds.mean(axis=0)
    radius = max(float(np.linalg.norm(bounds[1] - bounds[0])) / 2, 1e-9)
    if camera.is_parallel:
        factor = min(
            side / (2 * radius * focal) for side, focal in zip(camera.size, np.diag(camera.K), strict=False)
        )
        return magnified(camera, middle, factor).at_pose(camera.R, middle - 2 * radius * camera.forward)
    return camera.at_pose(camera.R, middle - radius / math.sin(_half_angle(camera)) * camera.forward)


def _half_angle(camera: Camera) -> float:
    """The smallest angle between the principal axis and the edges of the picture; for wide lenses 45 degrees."""
    (width, height), corner = camera.size, camera.corner
    x, y = corner + width / 2, corner + height / 2
    edges = [(corner, y), (corner + width, y), (x, corner), (x, corner + height)]
    directions = camera.rays(np.array(edges))[1]
    angles = np.arccos(np.clip(directions @ camera.forward, -1.0, 1.0))
    angles = angles[np.isfinite(angles)]
    return float(np.clip(angles.min(), 0.01, math.radians(45))) if len(angles) else math.radians(45)


def _up(camera: Camera) -> Floats:
    return np.array([0.0, 0.0, 1.0]) if camera.up == "z" else np.array([0.0, 1.0, 0.0])


def _turn(camera: Camera, yaw: float, pitch: float) -> Floats:
    """The rotation of the world's axes by `yaw` about up and `pitch` about the camera's right."""
    elevation = math.asin(max(-1.0, min(1.0, float(camera.forward @ _up(camera)))))
    allowed = (
        max(-STEEPEST - elevation, min(STEEPEST - elevation, pitch)) if abs(elevation) <= STEEPEST else pitch
    )
    return rotation_about(_up(camera), yaw) @ rotation_about(camera.R[0], allowed)


def rotation_about(axis: Floats, angle: float) -> Floats:
    """The rotation [3, 3] by a right-handed angle about a unit axis (Rodrigues)."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + math.sin(angle) * cross + (1.0 - math.cos(angle)) * (cross @ cross))
