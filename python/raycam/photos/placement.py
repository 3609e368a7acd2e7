"""Check that cameras face the world.

The check reveals cameras in another coordinate frame or unit.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ..arguments import Floats
from ..camera import Camera
from ..errors import Notice
from ..one_line import counted
from ..world import World

__all__ = ["are_cameras_inside", "pixel_grid", "placement_notices"]

GRID_SIDE = 12
"""Number of rays along each side of a photograph that test whether it shows the world."""
SCALE_FACTORS = (1000.0, 0.001, 100.0, 0.01, 10.0, 0.1, 39.3700787, 0.0254, 3.2808399, 0.3048, -1.0)
"""Scale factors that are tried: metric units, inches, feet, and a mirrored model."""
OTHER_FACTORS = tuple(2.0**power for step in range(1, 13) for power in (step, -step))
"""Factors of models without a unit, such as a reconstruction from photographs alone."""
TURNS = {
    "by 90 degrees about the x axis (from y up to z up)": np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]]),
    "by -90 degrees about the x axis (from z up to y up)": np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]]),
    "by 180 degrees about the x axis (from y down to y up)": np.diag([1.0, -1, -1]),
}
"""Rotations [3, 3] that convert between up axes, by the text of the notice."""
NEAR_SHARE = 0.5
"""Cameras are near the world's centre if their distance from it is below this multiple of the world's radius."""
FITTING_SHARE = 0.75
"""Minimum share of cameras that show the mesh after a rotation or scaling that the notice recommends."""
INSIDE_SHARE = 0.9
"""Minimum share of cameras that show fronts after scaling, if most cameras are inside the mesh's bounding box."""


def placement_notices(world: World, cameras: Mapping[str, Camera]) -> list[Notice]:
    """Returns a list with a notice if fewer than half of the cameras show the world.

    The notice is also returned if most cameras are inside the mesh's bounding box and show backs of faces, but would
    show fronts if the mesh were scaled. The notice contains the rotation or the scale factor that makes the mesh
    visible to at least three quarters of the cameras, if there is one. Otherwise, the list is empty.
    """
    given = list(cameras.values())
    seeing, fronts = count_cameras(world, given)
    bounds = world.bounds
    if 2 * fronts >= len(given) or bounds is None:
        return []
    inside = 2 * seeing >= len(given)
    if inside and not are_cameras_inside(world, given):
        return []
    if inside:
        remedy = _scale_remedy(world, given, inside=True)
        if remedy is None:
            return []
        problem = (
            f"{seeing - fronts} of {len(given)} cameras show only the backs of faces, as from inside the mesh"
        )
    else:
        remedy = (
            _turn_remedy(world, bounds, given)
            or _scale_remedy(world, given, inside=False)
            or "check that the mesh is in the coordinates of the cameras"
        )
        problem = f"the mesh is visible to only {seeing} of {len(given)} cameras"
    middle = ", ".join(f"{value:.4g}" for value in bounds.mean(axis=0))
    places = np.array([camera.location for camera in given])
    around = ", ".join(f"{value:.4g}" for value in np.median(places, axis=0))
    message = f"{problem}; {remedy} (mesh centre: ({middle}), median camera position: ({around}))"
    return [Notice(message, "misplaced_mesh")]


def _turn_remedy(world: World, bounds: Floats, cameras: Sequence[Camera]) -> str | None:
    """Returns the remedy with the best rotation; None if too few cameras would show the mesh."""
    turn, count = find_best_turn(world, bounds, cameras)
    if count < FITTING_SHARE * len(cameras):
        return None
    return f"rotate the mesh {turn} to make it visible to {counted(count, 'camera')}"


def _scale_remedy(world: World, cameras: Sequence[Camera], *, inside: bool) -> str | None:
    """Returns the remedy with the best scale; None if too few cameras would show fronts of the mesh."""
    factor, count = find_best_scale(world, cameras, inside)
    if count < (INSIDE_SHARE if inside else FITTING_SHARE) * len(cameras):
        return None
    return f"scale the mesh by {factor:g} to make it visible to {counted(count, 'camera')}"


def are_cameras_inside(world: World, cameras: Sequence[Camera]) -> bool:
    """Returns True if at least half of the cameras are inside the world's bounding box."""
    bounds = world.bounds
    if bounds is None:
        return False
    places = np.array([camera.location for camera in cameras]).reshape(-1, 3)
    inside = ((places >= bounds[0]) & (places <= bounds[1])).all(axis=1)
    return bool(2 * np.count_nonzero(inside) >= len(places))


def find_best_turn(world: World, bounds: Floats, cameras: Sequence[Camera]) -> tuple[str, int]:
    """Returns the rotation of `TURNS` after which the most cameras show fronts, and the number of these cameras.

    A rotation counts as 0 cameras if most cameras are then near the centre of the world's `bounds` [2, 3], because this
    indicates another unit instead of another up axis.
    """
    places = np.array([camera.location for camera in cameras])
    near = NEAR_SHARE * float(np.linalg.norm(bounds[1] - bounds[0])) / 2
    counts = dict.fromkeys(TURNS, 0)
    for name, turn in TURNS.items():
        distances = np.linalg.norm(places - turn @ bounds.mean(axis=0), axis=1)
        if np.median(distances) > near:
            counts[name] = count_cameras(world, cameras, turn=turn)[1]
    best = max(counts, key=lambda name: counts[name])
    return best, counts[best]


def find_best_scale(world: World, cameras: Sequence[Camera], inside: bool) -> tuple[float, int]:
    """Returns the scale at which the most cameras show fronts, and the number of these cameras.

    With `inside`, negative factors are not tried, because an inside-out mesh around the origin would look the same and
    is more common.
    """
    counts = {1.0: count_cameras(world, cameras)[1]}
    for factor in (*SCALE_FACTORS, *OTHER_FACTORS):
        if inside and factor < 0:
            continue
        counts[factor] = count_cameras(world, cameras, factor)[1]
        if counts[factor] == len(cameras):
            break
    best = max(counts, key=lambda factor: counts[factor])
    return best, counts[best]


def count_cameras(
    world: World, cameras: Sequence[Camera], factor: float = 1.0, turn: Floats | None = None
) -> tuple[int, int]:
    """Counts the cameras that show the changed world, and the cameras that show mainly fronts of its faces.

    The world is rotated by `turn` [3, 3] and scaled by `factor`, both around the origin. A camera shows the world if at
    least one ray of a grid over its image hits the world. A negative factor mirrors the world, which exchanges fronts
    and backs.
    """
    seeing = fronts = 0
    for camera in cameras:
        placed = camera
        if turn is not None or factor != 1.0:
            rotation = np.eye(3) if turn is None else turn
            placed = camera.still().at_pose(camera.R @ rotation, camera.location @ rotation / factor)
        origins, directions = placed.rays(pixel_grid(placed))
        hits = world.cast_rays(origins, directions if factor > 0 else -directions, fields=("t", "front"))
        hit = np.isfinite(hits["t"])
        seeing += bool(hit.any())
        facing = hits["front"][hit] == (factor > 0)
        fronts += bool(hit.any() and 2 * np.count_nonzero(facing) >= len(facing))
    return seeing, fronts


def pixel_grid(camera: Camera) -> Floats:
    """Returns pixels [n, 2] of an even grid over the image."""
    width, height = camera.size
    u = (np.arange(GRID_SIDE) + 0.5) / GRID_SIDE * width + camera.corner
    v = (np.arange(GRID_SIDE) + 0.5) / GRID_SIDE * height + camera.corner
    return np.stack(np.meshgrid(u, v), axis=-1).reshape(-1, 2)
