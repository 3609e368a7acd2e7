"""The intensity numbers that devices report."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ..elementary import log

__all__ = ["device_intensity", "near_ir_counts", "signal_counts"]

MAX_COUNT = 65535
"""The largest count of light."""
LARGEST = 1000.0
"""The reflectivity that devices with a logarithmic range report as 255."""


def device_intensity(family: str, reflectivity: npt.NDArray[np.float32]) -> npt.NDArray[np.uint8]:
    """Returns the 8-bit number that devices of a `family` report for a reflectivity.

    A reflectivity of 1 is white, and larger values are retroreflective. For Velodyne and Ouster, the number
    is 100 for white, proportional below white, and logarithmic above white up to 255. For other devices, the
    number for white is 255.
    """
    if family not in ("velodyne", "ouster"):
        linear: npt.NDArray[np.uint8] = np.rint(np.clip(reflectivity, 0.0, 1.0) * 255.0).astype(np.uint8)
        return linear
    below = np.rint(np.clip(reflectivity, 0.0, 1.0) * 100.0)
    bright = np.clip(reflectivity, 1.0, LARGEST)
    above = 100.0 + np.ceil(155.0 * log(bright) / log(LARGEST))
    number: npt.NDArray[np.uint8] = np.where(reflectivity > 1.0, above, below).astype(np.uint8)
    return number


def signal_counts(energy: npt.NDArray[np.float64], gain: float) -> npt.NDArray[np.uint16]:
    """Returns the counts of returned photons, at most 65535.

    `energy` is 1 for a white target at 1 m, for which the count is `gain`.
    """
    counts: npt.NDArray[np.uint16] = np.rint(np.minimum(energy * gain, MAX_COUNT)).astype(np.uint16)
    return counts


def near_ir_counts(radiance: npt.NDArray[np.float32], gain: float) -> npt.NDArray[np.uint16]:
    """Returns `radiance` in W/(m² sr) times `gain` as counts of at most 65535; 0 for NaN."""
    counts = np.rint(np.clip(np.nan_to_num(radiance.astype(float)) * gain, 0.0, MAX_COUNT))
    found: npt.NDArray[np.uint16] = counts.astype(np.uint16)
    return found
