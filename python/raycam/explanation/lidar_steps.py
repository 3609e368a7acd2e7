"""The numbers of one pulse of a lidar: surfaces, echoes and the waveform."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..arguments import Floats
from ..lidar import Lidar
from ..lidar.echoes import FWHM_TO_SIGMA
from ..lidar.lidar import LIGHT_SPEED
from ..one_line import one_line

__all__ = ["BeamSteps"]


@one_line
@dataclass(frozen=True)
class BeamSteps:
    """One pulse of a lidar.

    Arrays with [m] have a row for each surface that returns light to a sub-ray, arrays with [e] one for each echo.
    """

    lidar: Lidar
    firing: int
    """Index of the pulse in the lidar's pattern."""
    time: float
    """Seconds from the frame's start."""
    ring: int
    origin: Floats
    """The start of the beam [3], in sensor axes."""
    direction: Floats
    """The beam's axis [3], in sensor axes."""
    ray: npt.NDArray[np.int64]
    """The sub-ray [m]; 0 is the beam's axis."""
    length: Floats
    """Distance [m] along the path, in metres."""
    offset: Floats
    """Distance [m] of the surface from the beam's axis, in metres; NaN behind mirrors and glass."""
    energy: Floats
    """Returned energy [m], in units of a white target at normal incidence at 1 m."""
    bounces: npt.NDArray[np.int32]
    names: list[str]
    """The object's name [m]."""
    echo_length: Floats
    """Distance [e] of the echo: the maximum of the waveform."""
    echo_energy: Floats
    signal: Floats
    """Signal-to-noise ratio [e]; the threshold is 5; infinite if the lidar's `range_10` is unknown."""
    purity: Floats
    """Share [e] of an echo's energy that comes from its main object."""
    lost: list[str]
    """The reason [e] for which the echo is not reported; "kept" for reported echoes."""

    @property
    def sigma(self) -> float:
        """Standard deviation of the pulse in metres of distance."""
        return float(self.lidar.settings["pulse_length"] * LIGHT_SPEED / 2.0 * FWHM_TO_SIGMA)

    @property
    def threshold(self) -> float | None:
        """The energy of an echo that is detected with probability 1/2.

        The value is None if `range_10` is unknown.
        """
        reach = self.lidar.settings["range_10"]
        return None if reach is None else 0.1 / reach**2

    def waveform(self, distances: npt.ArrayLike) -> Floats:
        """Returns the sum of the pulses that the surfaces return, at distances [n] in metres.

        The height of a pulse is its energy E.
        """
        at = np.asarray(distances, np.float64)
        apart = (at[:, None] - self.length) / max(self.sigma, 1e-9)
        total: Floats = (self.energy * np.exp(-0.5 * apart**2)).sum(axis=1)
        return total
