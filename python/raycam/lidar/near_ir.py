"""The light of the world that a lidar receives along its beams, without its own light."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from .. import _core
from ..arguments import Floats
from .beam_axes import world_axes
from .pattern import Pattern
from .surface_motion import world_moves

if TYPE_CHECKING:
    from ..world import World
    from .lidar import Lidar

__all__ = ["near_infrared"]

MOMENTS = 64
"""Times of a frame at which the light of a moving world is computed."""


def near_infrared(
    world: World,
    lidar: Lidar,
    pattern: Pattern,
    frame: int,
    pulse: npt.NDArray[np.int64],
    threads: int | None,
) -> npt.NDArray[np.float32]:
    """Returns the red radiance along the axis of the beam of each `pulse` [n], in W/(m² sr).

    The result is float32 [n]. The radiance is the light of an image (`raycam.render`), with the world's
    render settings and `near_ir_samples` paths for each pulse. In a moving world whose pulses have more than
    64 different times, the radiance is computed at the nearest of 64 times of the frame.
    """
    pulses, row = np.unique(pulse, return_inverse=True)
    origins, directions = world_axes(lidar, pattern, frame, pulses)
    times = pattern.times[pulses]
    light = np.zeros(len(pulses), np.float32)
    for moment, own in _moments(world, times, 1.0 / lidar.rate):
        at = world if moment is None else world.at(moment)
        light[own] = _radiance(at, lidar, origins[own], directions[own], pulses[own], frame, threads)
    return light[row]


def _moments(
    world: World, times: Floats, duration: float
) -> list[tuple[float | None, npt.NDArray[np.int64]]]:
    """Returns times of the world, each with the rows of `times` for which the time is used.

    None is the world's own time.
    """
    if not world_moves(world):
        return [(None, np.arange(len(times)))]
    nearest = times
    if len(np.unique(times)) > MOMENTS:
        number = np.clip(np.floor(times / duration * MOMENTS), 0, MOMENTS - 1)
        nearest = (number + 0.5) * (duration / MOMENTS)
    start = float(world._core.time or 0.0)
    return [(start + float(time), np.flatnonzero(nearest == time)) for time in np.unique(nearest)]


def _radiance(
    world: World,
    lidar: Lidar,
    origins: Floats,
    directions: Floats,
    pulses: npt.NDArray[np.int64],
    frame: int,
    threads: int | None,
) -> npt.NDArray[np.float32]:
    from ..render.request import image_request

    request, _, _ = image_request(
        world,
        {"samples": lidar.settings["near_ir_samples"], "threads": threads},
        names=["color"],
        surface="first",
        frame=frame,
        transparent_background=False,
        region=None,
    )
    request |= {"noise_threshold": None, "time_limit": None, "threads": threads}
    rays = {
        "origin": np.ascontiguousarray(origins),
        "direction": np.ascontiguousarray(directions),
        # Random numbers depend on the pixel, so each pulse gets a pixel of its own.
        "pixel": np.stack([pulses & 0xFFFF, pulses >> 16], axis=1).astype(np.int32),
    }
    light, _ = _core.world_radiance_along(world._core, rays, request)
    red: npt.NDArray[np.float32] = light[:, 0]
    return red
