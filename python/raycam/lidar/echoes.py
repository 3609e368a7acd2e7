"""Echoes: the local maxima of the waveform of each pulse."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from .. import _core
from ..arguments import Floats
from .paths import Contributions

__all__ = ["FWHM_TO_SIGMA", "Echoes", "find_echoes"]

FWHM_TO_SIGMA = 1.0 / (2.0 * math.sqrt(2.0 * math.log(2.0)))
"""The standard deviation of a Gaussian pulse of width 1 at half its maximum."""


@dataclass
class Echoes:
    """The echoes of all pulses, ordered by pulse and distance; [e] each."""

    pulse: npt.NDArray[np.int64]
    length: Floats
    """Position of the maximum: half the optical length, in metres."""
    energy: Floats
    """Sum of the energies of the echo's contributions."""
    main: npt.NDArray[np.int64]
    """Row of the largest contribution of the surface that contributes the most energy."""
    purity: npt.NDArray[np.float32]
    """The share of the echo's energy that comes from the surface of `main`; an object counts as a separate surface
    for each number of bounces."""
    is_single: bool = False
    """True if each pulse has only one surface, so at most one echo."""


def find_echoes(found: Contributions, pulse_length: float, threads: int | None = None) -> Echoes:
    """Returns the echoes: the local maxima of the pulses' waveforms.

    A waveform is the sum of energy * g(r - length), where g is a Gaussian of the pulse's length.
    `pulse_length` is the pulse's full width at half maximum in metres of distance; 0: each surface is an
    echo.
    """
    if len(found.pulse) and (np.diff(found.pulse) > 0).all():
        return _single_echoes(found)
    returns = {
        "pulses": np.ascontiguousarray(found.pulse),
        "lengths": np.ascontiguousarray(found.length),
        "energies": np.ascontiguousarray(found.energy),
        "instances": np.ascontiguousarray(found.fields["instance"]),
        "bounces": np.ascontiguousarray(found.bounces, np.int32),
        "threads": threads,
    }
    return Echoes(**_core.lidar_echoes(returns, pulse_length * FWHM_TO_SIGMA))


def _single_echoes(found: Contributions) -> Echoes:
    """Returns the echoes of pulses with one surface each, in their order."""
    count = len(found.pulse)
    ones = np.broadcast_to(np.float32(1.0), (count,))
    return Echoes(found.pulse, found.length, found.energy, np.arange(count), ones, is_single=True)
