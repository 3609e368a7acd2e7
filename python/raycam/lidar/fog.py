"""The echo that fog itself returns."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from ..arguments import Floats
from ..elementary import exp
from .echoes import FWHM_TO_SIGMA
from .paths import HIT_FIELDS, Contributions

if TYPE_CHECKING:
    from ..world import World

__all__ = ["Fog", "attenuation", "find_fog", "fog_contributions", "soft_echo"]

BACKSCATTER = 0.046
"""Backscattering coefficient times the visibility, in 1/sr (Rasshofer, Spies and Spies 2011)."""
OVERLAP = (0.9, 1.0)
"""Distances in metres from which the receiver covers part of the beam and the whole beam (Hahner et al. 2021)."""
STEP = 0.01
"""Step of the numerical integral, in metres."""
REACH = 12.0
"""Distance in metres beyond which fog adds nothing to the maximum."""


@dataclass(frozen=True)
class Fog:
    """The fog that a lidar is in."""

    visibility: float
    """The distance in metres after which 5 % of the light remains."""
    top: tuple[int, float] | None = None
    """The world's up axis (1 or 2), and the coordinate below which the fog is; None: everywhere."""

    def contains(self, points: Floats) -> npt.NDArray[np.bool_]:
        """Returns True [n] for points [n, 3] in the fog."""
        if self.top is None:
            return np.ones(len(points), bool)
        axis, height = self.top
        below: npt.NDArray[np.bool_] = points[:, axis] <= height
        return below


def find_fog(world: World, visibility: float | None) -> Fog | None:
    """Returns the fog of a lidar's setting `visibility`, or the world's fog; None without fog.

    If `visibility` is None, the world's fog applies. The world's fog has the visibility ln(20) / extinction
    of its red light.
    """
    if visibility is not None:
        return Fog(visibility) if math.isfinite(visibility) else None
    own = world.fog
    if own is None:
        return None
    extinction = float(np.ravel(own["extinction"])[0])
    if extinction <= 0.0:
        return None
    height = own.get("height")
    return Fog(
        math.log(20.0) / extinction, None if height is None else ("xyz".index(world.up), float(height))
    )


def attenuation(visibility: float) -> float:
    """Returns the attenuation coefficient of fog in 1/m.

    After the distance `visibility`, 5 % of the light remains.
    """
    return math.log(20.0) / visibility


@lru_cache(maxsize=64)
def soft_echo(visibility: float, pulse_length: float) -> tuple[float, float]:
    """Returns the distance in metres and the energy of the fog's echo.

    `visibility` is in metres, and `pulse_length` is the full width at half maximum in metres of distance. The echo is
    the maximum over r of the integral of pi beta Q(s) exp(-2 alpha s) / s² g(r - s) ds. The unit is the echo of a
    white target at normal incidence at 1 m. In the formula, alpha is the attenuation, beta the backscattering, Q the
    receiver's overlap, and g the pulse with height 1. Source: Hahner, Sakaridis, Dai and Van Gool, ICCV 2021, section
    3.
    """
    sigma = max(pulse_length * FWHM_TO_SIGMA, STEP)
    alpha, beta = attenuation(visibility), BACKSCATTER / visibility
    count = round((min(REACH, OVERLAP[1] + 8.0 * sigma + 2.0) - OVERLAP[0]) / STEP)
    places = OVERLAP[0] + (np.arange(count) + 0.5) * STEP
    overlap = np.minimum(1.0, (places - OVERLAP[0]) / (OVERLAP[1] - OVERLAP[0]))
    profile: list[float] = (math.pi * beta * overlap * exp(-2.0 * alpha * places) / places**2).tolist()
    pulse: list[float] = exp(-0.5 * (np.arange(count) * STEP / sigma) ** 2).tolist()

    def height(at: int) -> float:
        return STEP * sum(value * pulse[abs(at - i)] for i, value in enumerate(profile))

    low, high = 0, count - 1
    while high - low > 2:  # ternary search, because `height` has a single maximum
        third = (high - low) // 3
        if height(low + third) < height(high - third):
            low += third
        else:
            high -= third
    best = max(range(low, high + 1), key=height)
    return float(places[best]), height(best)


def fog_contributions(
    pulses: npt.NDArray[np.int64],
    visibility: float,
    pulse_length: float,
    sub_rays: int,
    drift: Floats,
    found: Contributions,
) -> Contributions:
    """Returns the fog's echo as one contribution for each pulse, without an object.

    The fog is at rest: `drift` [n] is the rate of change of distances along each pulse because the sensor moves.
    The fields have the same types as the fields of the contributions `found`.
    """
    distance, energy = soft_echo(visibility, pulse_length)
    count = len(pulses)
    fields = {}
    for name in (*(name for name in HIT_FIELDS if name not in ("albedo", "distance")), "incidence"):
        like = found.fields[name]
        fields[name] = np.full((count, *like.shape[1:]), np.nan if like.dtype.kind == "f" else -1, like.dtype)
    minus = np.full(count, -1, np.int32)
    return Contributions(
        pulses,
        np.full(count, sub_rays, np.int64),
        np.full(count, distance),
        np.full(count, energy),
        np.zeros(count, np.int32),
        minus,
        drift,
        np.zeros((count, 3)),
        np.full(count, distance),
        fields,
        found.deflected,
    )
