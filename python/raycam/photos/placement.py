"""Check that cameras face the world, which reveals cameras in another coordinate frame or unit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ..arguments import Floats
from ..camera import Camera
from ..errors import Notice
from ..world import World

__all__ = ["cameras_that_see", "pixel_grid", "placement_notices"]

GRID_SIDE = 12
"""Number of rays along each side of a photograph that test whether it shows the world."""
SCALE_FACTORS = (1000.0, 0.001, 100.0, 0.01, 10.0, 0.1, 39.3700787, 0.0254, 3.2808399, 0.3048, -1.0)
"""Scale factors that are tried: metric units, inches, feet, and a mirrored model."""


def placement_notices(world: World, cameras: Mapping[str, Camera]) -> list[Notice]:
    """Returns a notice if fewer than half of the cameras show the world, with the best scale factor; else an empty
    list.
    """
    given = list(cameras.values())
    seeing = int(np.count_nonzero(cameras_that_see(world, given)))
    bounds = world.bounds
    if 2 * seeing >= len(given) or bounds is None:
        return []
    counts = {
        factor: int(np.count_nonzero(cameras_that_see(world, given, factor))) for factor in SCALE_FACTORS
    }
    best = max(counts, key=lambda factor: counts[factor])
    remedy = "check that the mesh is in the coordinates of the cameras"
    if counts[best] > seeing:
        remedy = f"scale the mesh by {best:g} to make it visible to {counts[best]} cameras"
    middle = ", ".join(f"{value:.4g}" for value in bounds.mean(axis=0))
    places = np.array([camera.location for camera in given])
    around = ", ".join(f"{value:.4g}" for value in np.median(places, axis=0))
    message = (
        f"the mesh is visible to only {seeing} of {len(given)} cameras; {remedy} (mesh centre: ({middle}), "
        f"median camera position: ({around}))"
    )
    return [Notice(message, "implausible")]


def cameras_that_see(world: World, cameras: Sequence[Camera], factor: float = 1.0) -> list[bool]:
    """Returns, for each camera, True if a ray of a grid hits the world scaled by `factor` around the origin."""
    found = []
    for camera in cameras:
        placed = camera if factor == 1.0 else camera.still().at_pose(camera.R, camera.location / factor)
        pixels = pixel_grid(placed)
        origins, directions = placed.rays(pixels)
        directions = directions if factor > 0 else -directions
        found.append(bool(world.occluded(origins, directions).any()))
    return found


def pixel_grid(camera: Camera) -> Floats:
    """Returns pixels [n, 2] of an even grid over the image."""
    width, height = camera.size
    u = (np.arange(GRID_SIDE) + 0.5) / GRID_SIDE * width + camera.corner
    v = (np.arange(GRID_SIDE) + 0.5) / GRID_SIDE * height + camera.corner
    return np.stack(np.meshgrid(u, v), axis=-1).reshape(-1, 2)
