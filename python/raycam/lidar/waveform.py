"""Samples of the waveform around each echo."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ..arguments import Floats
from ..elementary import exp
from .echoes import FWHM_TO_SIGMA
from .paths import Contributions

__all__ = ["sample_waveforms", "waveform_offsets"]

SAMPLES = 65
"""Samples of each echo; the middle one is at the echo's maximum."""
SAMPLES_PER_PULSE = 16
"""Samples within the pulse's full width at half maximum."""
BLOCK = 1 << 14
"""Echoes processed at a time."""


def waveform_offsets(pulse_length: float) -> Floats:
    """Returns the distances of the samples from the echo's maximum in metres, float64 [65].

    `pulse_length` is the pulse's full width at half maximum in metres of distance. The samples cover four pulse
    lengths.
    """
    offsets: Floats = (np.arange(SAMPLES, dtype=float) - SAMPLES // 2) * (pulse_length / SAMPLES_PER_PULSE)
    return offsets


def sample_waveforms(
    found: Contributions, pulse: npt.NDArray[np.int64], length: Floats, pulse_length: float
) -> npt.NDArray[np.float32]:
    """Returns the waveforms around echoes, float32 [n, 65].

    A waveform is the sum of E g(r - L) over the contributions of the echo's pulse. E and L are the energy and the
    length of a contribution, r is `length` + `waveform_offsets`, and g is the pulse with height 1. The unit is
    therefore the energy of a white target at normal incidence at 1 m. `pulse` and `length` [n] are the echoes' pulses
    and maxima. `found` is sorted by pulse.
    """
    sigma, offsets = pulse_length * FWHM_TO_SIGMA, waveform_offsets(pulse_length)
    first = np.searchsorted(found.pulse, pulse, side="left")
    count = np.searchsorted(found.pulse, pulse, side="right") - first
    waves = np.zeros((len(pulse), SAMPLES), np.float32)
    for start in range(0, len(pulse), BLOCK):
        block = slice(start, start + BLOCK)
        sums = np.zeros((len(pulse[block]), SAMPLES))
        for number in range(int(count[block].max(initial=0))):
            own = np.flatnonzero(count[block] > number)
            row = first[block][own] + number
            apart = (length[block][own] - found.length[row])[:, None] + offsets
            sums[own] += found.energy[row][:, None] * exp(-0.5 * (apart / sigma) ** 2)
        waves[block] = sums
    return waves
