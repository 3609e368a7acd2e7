"""Check that cameras face the world.

The check reveals cameras in another coordinate frame or unit.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from ..arguments import Floats
from ..camera import Camera
from ..errors import Notice
from ..one_line import counted
from ..world import World
from .camera_grid import CameraGrid, GridHits, inside

__all__ = ["are_cameras_inside", "placement_notices"]

METRIC_FACTORS = (1000.0, 0.001, 100.0, 0.01, 10.0, 0.1)
"""Scale factors between metric units."""
UNIT_FACTORS = (*METRIC_FACTORS, 39.3700787, 0.0254, 3.2808399, 0.3048, -1.0)
"""Scale factors that are tried first: metric units, inches, feet, and a mirrored model."""
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
"""Minimum share of cameras that show fronts after scaling, if all or most cameras show the mesh without scaling."""
NEARLY_ALL = 0.95
"""Minimum number of cameras that show fronts at a candidate factor, as a share of the best factor's number."""
TYPICAL_COVER = 0.35
"""Share of a photograph that an object usually covers if all cameras face it."""
MAX_OBJECT_DISTANCE = 4.0
"""Ratio of the surface's distance to that of the point that all cameras face, above which the mesh is too large."""
MAX_ROOM_DISTANCE = 100.0
"""Ratio of the nearest surfaces' distance to the spread of the cameras above which the mesh is probably too large."""
USUAL_ROOM_DISTANCE = 10.0
"""Maximum of this ratio after scaling; a scale with a larger ratio is not recommended."""
MIN_CAMERAS = 3
"""Minimum number of cameras whose arrangement reveals another unit."""


def placement_notices(world: World, cameras: Mapping[str, Camera]) -> list[Notice]:
    """Returns a list with a notice if the world seems to be in another unit or place than the cameras.

    There are three reasons: fewer than half of the cameras show the world; most cameras are inside the mesh's bounding
    box and show backs of faces, but would show fronts if the mesh were scaled; the surfaces are much farther away than
    the cameras' arrangement suggests. The notice contains the rotation or the scale factor that makes the mesh visible
    to most cameras. If fewer than half of the cameras show the world, and no such change is found, the notice asks to
    check the coordinates. Without a problem, the list is empty.
    """
    given, bounds = CameraGrid(list(cameras.values())), world.bounds
    if bounds is None or not len(given.places):
        return []
    found = _problem(world, bounds, given)
    if found is None:
        return []
    middle = ", ".join(f"{value:.4g}" for value in bounds.mean(axis=0))
    around = ", ".join(f"{value:.4g}" for value in np.median(given.places, axis=0))
    message = f"{found} (mesh centre: ({middle}), median camera position: ({around}))"
    return [Notice(message, "misplaced_mesh")]


def _problem(world: World, bounds: Floats, cameras: CameraGrid) -> str | None:
    """Returns the problem with its remedy, or None."""
    count, now = len(cameras.places), cameras.view(world)
    shown, fronts = int(now.shows.sum()), int(now.fronts.sum())
    if 2 * fronts >= count:
        return _too_large(world, bounds, cameras, now)
    if 2 * shown < count:
        remedy = (
            _turn_remedy(world, bounds, cameras)
            or _scale_remedy(world, bounds, cameras)
            or "check that the mesh is in the coordinates of the cameras"
        )
        return f"the mesh is visible to only {shown} of {counted(count, 'camera')}; {remedy}"
    if count < MIN_CAMERAS or 2 * np.count_nonzero(cameras.inside(bounds)) < count:
        return None
    # A mirrored mesh is not considered, because an inside-out mesh around the origin would look the same.
    best = find_best_scale(world, bounds, cameras, [factor for factor in UNIT_FACTORS if factor > 0])
    if best[1] < INSIDE_SHARE * count:
        best = find_best_scale(world, bounds, cameras, OTHER_FACTORS)
    if best[1] < INSIDE_SHARE * count:
        return None
    backs = f"{shown - fronts} of {count} cameras show mainly backs of faces, as from inside the mesh"
    return f"{backs}; {_scale_text(*best)}"


def _too_large(world: World, bounds: Floats, cameras: CameraGrid, now: GridHits) -> str | None:
    """Returns the problem with its remedy if visible surfaces are too far away for the cameras' arrangement."""
    count = len(cameras.places)
    smaller = [factor for factor in UNIT_FACTORS if 0 < factor < 1]
    point = cameras.common_point()
    if point is not None:
        to_point = np.maximum(np.linalg.norm(point - cameras.places, axis=1), np.finfo(float).tiny)
        ratio = float(np.nanmedian(now.distance_quantile(0.5) / to_point))
        outside = [
            factor for factor in smaller if 2 * np.count_nonzero(cameras.inside(bounds, factor)) < count
        ]
        factor, fitting = 1.0, 0
        if ratio > MAX_OBJECT_DISTANCE:
            factor, fitting = find_best_scale(world, bounds, cameras, outside)
        if fitting >= INSIDE_SHARE * count:
            problem = f"the cameras face a common point, but the mesh is {ratio:.3g} times as far away"
            return f"{problem}; {_scale_text(factor, fitting)}"
    spread = float(np.median(np.linalg.norm(cameras.places - np.median(cameras.places, axis=0), axis=1)))
    # Even the nearest surfaces must be far away: cameras of a vehicle are close together, but show the ground.
    distance = float(np.nanmedian(now.distance_quantile(0.05)))
    if count < MIN_CAMERAS or not MAX_ROOM_DISTANCE * spread < distance < 1e6 * spread:
        return None
    around = [factor for factor in smaller if 2 * np.count_nonzero(cameras.inside(bounds, factor)) >= count]
    factor, fitting = find_best_scale(world, bounds, cameras, around)
    if fitting < INSIDE_SHARE * count or factor * distance > USUAL_ROOM_DISTANCE * spread:
        return None
    problem = (
        f"the distance of the nearest surfaces is {distance / spread:.3g} times the typical distance of a camera from "
        "the cameras' centre"
    )
    return f"{problem}; if the cameras are neither an array nor a panorama, {_scale_text(factor, fitting)}"


def _turn_remedy(world: World, bounds: Floats, cameras: CameraGrid) -> str | None:
    """Returns the remedy with the best rotation; None if too few cameras would show the mesh."""
    turn, count = find_best_turn(world, bounds, cameras)
    if count < FITTING_SHARE * len(cameras.places):
        return None
    return f"rotate the mesh {turn} to make it visible to {counted(count, 'camera')}"


def _scale_remedy(world: World, bounds: Floats, cameras: CameraGrid) -> str | None:
    """Returns the remedy with the best scale; None if too few cameras would show fronts of the mesh."""
    for factors in (UNIT_FACTORS, OTHER_FACTORS):
        factor, count = find_best_scale(world, bounds, cameras, factors)
        if count >= FITTING_SHARE * len(cameras.places):
            return _scale_text(factor, count)
    return None


def _scale_text(factor: float, count: int) -> str:
    change = (
        "mirror the mesh at the origin (scale by -1)" if factor == -1 else f"scale the mesh by {factor:g}"
    )
    return f"{change} to make its fronts visible to {counted(count, 'camera')}"


def are_cameras_inside(world: World, cameras: Sequence[Camera]) -> bool:
    """Returns True if at least half of the cameras are inside the world's bounding box."""
    bounds = world.bounds
    if bounds is None or not cameras:
        return False
    places = np.array([camera.location for camera in cameras])
    return bool(2 * np.count_nonzero(inside(places, bounds)) >= len(places))


def find_best_turn(world: World, bounds: Floats, cameras: CameraGrid) -> tuple[str, int]:
    """Returns the rotation of `TURNS` after which the most cameras show fronts, and the number of these cameras.

    A rotation counts as 0 cameras if most cameras are then near the centre of the world's `bounds` [2, 3], because this
    indicates another unit instead of another up axis.
    """
    near = NEAR_SHARE * float(np.linalg.norm(bounds[1] - bounds[0])) / 2
    counts = dict.fromkeys(TURNS, 0)
    for name, turn in TURNS.items():
        distances = np.linalg.norm(cameras.places - turn @ bounds.mean(axis=0), axis=1)
        if np.median(distances) > near:
            counts[name] = int(cameras.view(world, turn=turn).fronts.sum())
    best = max(counts, key=lambda name: counts[name])
    return best, counts[best]


def find_best_scale(
    world: World, bounds: Floats, cameras: CameraGrid, factors: Iterable[float]
) -> tuple[float, int]:
    """Returns the scale that fits the cameras best, and the number of cameras that then show fronts.

    Several factors can make a world of the given `bounds` [2, 3] visible to nearly all cameras. If the cameras face a
    common point, the best one keeps them outside the world, which then covers a usual share of the photographs.
    Otherwise, the factor with which the world covers most of the photographs is the best. If the coverage is equal to
    about 5 %, the factor with the smallest absolute value is the best, because the surfaces are then nearest to the
    cameras.
    """
    views = {factor: cameras.view(world, factor) for factor in factors}
    most = max((int(view.fronts.sum()) for view in views.values()), default=0)
    if not most:
        return 1.0, 0
    fitting = [factor for factor, view in views.items() if view.fronts.sum() >= NEARLY_ALL * most]
    if cameras.common_point() is None:
        cover = {factor: round(20 * float(views[factor].covered.mean())) for factor in fitting}
        best = min(fitting, key=lambda factor: (-cover[factor], abs(factor), -factor))
    else:
        best = min(fitting, key=lambda factor: _misfit(factor, views[factor], bounds, cameras))
    return best, int(views[best].fronts.sum())


def _misfit(factor: float, view: GridHits, bounds: Floats, cameras: CameraGrid) -> tuple[bool, float, float]:
    """Returns how badly a scale of the world fits cameras that face a common point."""
    is_around = bool(2 * np.count_nonzero(cameras.inside(bounds, factor)) >= len(cameras.places))
    cover = abs(float(np.log(max(view.covered.mean(), 1e-3) / TYPICAL_COVER)))
    # Metric units are more common than inches, feet and mirrored models.
    return is_around, cover + (not is_around and factor not in METRIC_FACTORS), abs(factor)
