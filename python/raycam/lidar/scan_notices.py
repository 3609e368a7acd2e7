"""Notices of scans: assumptions about the device, the world's time and its materials."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from ..errors import Notice
from ..notices import warn

if TYPE_CHECKING:
    from ..world import World
    from .lidar import Lidar

__all__ = ["warn_of_assumed_reflectance", "warn_of_device", "warn_of_empty_scan", "warn_of_times"]

LOST = ("kept", "nothing hit", "too weak", "too near", "too far", "reflected away", "missed at random")
"""The meaning of the values of the field `lost`."""


def warn_of_device(lidar: Lidar) -> None:
    """Warns if the angles are the model's nominal angles; the angles of each unit differ."""
    if not lidar.is_generic:
        return
    remedy = 'load your device\'s calibration file with raycam.load_lidar("FILE")'
    if lidar.family == "golden":
        text = f"using a substitute pattern that covers the field of view evenly; {remedy}"
    else:
        text = f"using generic angles; those of a single device differ by up to a few degrees; {remedy}"
    warn(Notice(f"{lidar.name}: {text}", "generic_angles"))


def warn_of_times(world: World, lidar: Lidar) -> None:
    """Warns if a moving world has no time, and if a frame ends after the world's motion."""
    time = world._core.time
    if world._core.is_animated and time is None:
        warn(
            Notice(
                "the scan shows a static world, because no time is set for the animated world; use "
                "world.at(time), or --at SECONDS on the command line",
                "unused_times",
            )
        )
    if time is None:
        return
    video = world.video
    ends = [animation.duration for animation in world.animations]
    ends.extend([video.frames / video.fps] if video is not None else [])
    end, last = max(ends, default=np.inf), time + 1.0 / lidar.rate
    if last > end + 1e-9:
        text = f"the frame ends at {last:g} s, but the world's motion ends at {end:g} s; objects do not move after that"
        warn(Notice(text, "outside_times"))


def warn_of_assumed_reflectance(wavelength: float, colored: bool) -> None:
    """Warns that colours were used as reflectances, if the colours are not grey."""
    if colored:
        text = (
            f"materials have no reflectance at {wavelength:g} nm; the red channel of their colour is used; set "
            "lidar = {reflectance = ...} on the objects"
        )
        warn(Notice(text, "assumed_reflectance"))


def warn_of_empty_scan(lidar: Lidar, counts: npt.NDArray[np.int64]) -> None:
    """Warns about a scan without points.

    `counts` contains the number of pulses for each value of the field `lost`.
    """
    reasons = ", ".join(f"{reason}: {count}" for reason, count in zip(LOST, counts, strict=True) if count)
    warn(Notice(f"{lidar.name}: the scan has no points; pulses lost: {reasons}", "empty_scan"))
