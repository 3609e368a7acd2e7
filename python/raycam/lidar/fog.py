"""The echo that fog itself returns."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from .echoes import FWHM_TO_SIGMA
from .paths import HIT_FIELDS, Contributions

__all__ = ["attenuation", "fog_contributions", "soft_echo"]

BACKSCATTER = 0.046
"""Backscattering coefficient times the visibility, in 1/sr (Rasshofer, Spies and Spies 2011)."""
OVERLAP = (0.9, 1.0)
"""Distances in metres from which the receiver covers part of the beam and the whole beam (Hahner et al. 2021)."""
STEP = 0.01
"""Step of the numerical integral, in metres."""
REACH = 12.0
"""Distance in metres beyond which fog adds nothing to the maximum."""


def attenuation(visibility: float) -> float:
    """Returns the attenuation coefficient of fog in 1/m: 5 % of the light remains after the distance `visibility`."""
    return math.log(20.0) / visibility


@lru_cache(maxsize=64)
def soft_echo(visibility: float, pulse_length: float) -> tuple[float, float]:
    """Returns the distance in metres and the energy of the fog's echo.

    `pulse_length` is the full width at half maximum in metres of distance. The echo is the maximum over r of
    integral pi beta Q(s) exp(-2 alpha s) / s² g(r - s) ds, where g is the pulse with height 1, in units of a white
    target at normal incidence at 1 m. Source: Hahner, Sakaridis, Dai and Van Gool, ICCV 2021, section 3.
    """
    sigma = max(pulse_length * FWHM_TO_SIGMA, STEP)
    alpha, beta = attenuation(visibility), BACKSCATTER / visibility
    count = round((min(REACH, OVERLAP[1] + 8.0 * sigma + 2.0) - OVERLAP[0]) / STEP)
    places = [OVERLAP[0] + (i + 0.5) * STEP for i in range(count)]
    profile = [
        math.pi
        * beta
        * min(1.0, (s - OVERLAP[0]) / (OVERLAP[1] - OVERLAP[0]))
        * math.exp(-2.0 * alpha * s)
        / s**2
        for s in places
    ]
    pulse = [math.exp(-0.5 * (i * STEP / sigma) ** 2) for i in range(count)]

    def height(at: int) -> float:
        return STEP * sum(value * pulse[abs(at - i)] for i, value in enumerate(profile))

    low, high = 0, count - 1
    while high - low > 2:  # `height` has a single maximum
        third = (high - low) // 3
        if height(low + third) < height(high - third):
            low += third
        else:
            high -= third
    best = max(range(low, high + 1), key=height)
    return places[best], height(best)


def fog_contributions(
    pulses: range, visibility: float, pulse_length: float, sub_rays: int, found: Contributions
) -> Contributions:
    """Returns the fog's echo as one contribution for each pulse, without an object; `found` determines the types of the
    fields.
    """
    distance, energy = soft_echo(visibility, pulse_length)
    count = len(pulses)
    fields = {}
    for name in (*(name for name in HIT_FIELDS if name not in ("albedo", "distance")), "incidence"):
        like = found.fields[name]
        fields[name] = np.full((count, *like.shape[1:]), np.nan if like.dtype.kind == "f" else -1, like.dtype)
    minus = np.full(count, -1, np.int32)
    return Contributions(
        np.arange(pulses.start, pulses.stop, dtype=np.int64),
        np.full(count, sub_rays, np.int64),
        np.full(count, distance),
        np.full(count, energy),
        np.zeros(count, np.int32),
        minus,
        fields,
        found.deflected,
    )
