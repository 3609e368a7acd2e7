"""`PulseTracer`: the light that surfaces and fog return to the pulses of a frame."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from ..arguments import Floats
from ..elementary import exp
from .beam import beam_rays
from .beam_axes import azimuth_errors, rotate_about_z
from .fog import attenuation, find_fog, fog_contributions, soft_echo
from .paths import Contributions, trace_paths
from .pattern import Pattern
from .radial_velocity import sensor_drift
from .random_numbers import PulseNumbers
from .scan_notices import warn_of_assumed_reflectance
from .surfaces import SurfaceTable

if TYPE_CHECKING:
    from ..world import World
    from .lidar import Lidar

__all__ = ["THRESHOLD", "PulseTracer"]

THRESHOLD = 5.0
"""The detection threshold, in standard deviations of the receiver's noise."""
CERTAIN = 4.9
"""Margin below the threshold, in standard deviations, at which fewer than one echo in a million is detected."""
RAYS_PER_BLOCK = 1 << 15
"""Number of rays traced at a time, which limits the memory."""


class PulseTracer:
    """Traces the pulses of a lidar's frame in a world, a block of consecutive pulses at a time."""

    def __init__(self, world: World, lidar: Lidar, pattern: Pattern, frame: int, threads: int | None) -> None:
        self.world, self.lidar, self.pattern, self.threads = world, lidar, pattern, threads
        self.numbers = PulseNumbers(lidar.settings["seed"], frame)
        """The random numbers of the frame's pulses."""
        self._surfaces = SurfaceTable(world)
        self._fog = find_fog(world, lidar.settings["visibility"])
        self._azimuth_errors = azimuth_errors(lidar, pattern, frame)

    def blocks(self) -> Iterator[range]:
        """Yields ranges of pulses that are traced at a time: at least one range, which may be empty."""
        count, step = len(self.pattern), max(1, RAYS_PER_BLOCK // self.lidar.settings["beam_samples"])
        for first in range(0, max(count, 1), step):
            yield range(first, min(count, first + step))

    def trace(self, block: range) -> Contributions:
        """Returns the light that surfaces and fog return to the pulses of a block.

        The array `deflected` of the result has one value for each pulse of the block.
        """
        settings, pattern, fog = self.lidar.settings, self.pattern, self._fog
        chosen = slice(block.start, block.stop)
        times = pattern.times[chosen]
        rotations, places = self.lidar.track.at(times)
        offsets, directions, weights = beam_rays(
            pattern.origins[chosen],
            rotate_about_z(pattern.directions[chosen], self._azimuth_errors[chosen]),
            rotations[:1] if not rotations.strides[0] else rotations,
            settings["beam_width"],
            settings["beam_divergence"],
            settings["beam_samples"],
            self._beam_turns(block),
            self.threads,
        )
        drift = None
        if self.lidar.is_moving:
            drift = sensor_drift(self.lidar.track, times, offsets, directions)
        origins = offsets + places[:, None]
        found = trace_paths(
            self.world,
            self._surfaces,
            origins,
            directions,
            float(weights[0]),
            None if self.world._core.time is None else times,
            drift=drift,
            fog_top=None if fog is None else fog.top,
            max_bounces=settings["max_bounces"],
            threads=self.threads,
        )
        found.pulse = found.pulse + block.start
        if settings["overlap"] is not None:
            distances, shares = np.array(settings["overlap"]).T
            found.energy = found.energy * np.interp(found.length, distances, shares)
        if fog is None:
            return found
        found.energy = found.energy * exp(-2.0 * attenuation(fog.visibility) * found.fogged)
        inside = np.flatnonzero(fog.contains(origins[:, 0]))
        still = np.zeros(len(inside)) if drift is None else drift[inside, 0]
        return self._with_fog_echoes(found, fog.visibility, block.start + inside, still)

    def _beam_turns(self, block: range) -> Floats:
        """Returns the rotation of each beam's rays, as a fraction of a full turn."""
        if self.lidar.settings["beam_samples"] == 1:
            return np.zeros(len(block))
        return self.numbers.uniforms("beam", block.start, block.stop)

    def _with_fog_echoes(
        self, found: Contributions, visibility: float, pulses: npt.NDArray[np.int64], drift: Floats
    ) -> Contributions:
        """Returns the contributions with the fog's own echo of each of the `pulses`.

        The fog's echo is omitted if it is far too weak to be detected.
        """
        settings, extent = self.lidar.settings, self.lidar.pulse_extent
        reach = settings["range_10"]
        signal = math.inf
        if reach is not None:
            signal = THRESHOLD * soft_echo(visibility, extent)[1] * reach**2 / 0.1
        if signal < THRESHOLD - CERTAIN:
            return found
        echo = fog_contributions(pulses, visibility, extent, settings["beam_samples"], drift, found)
        return Contributions.joined([found, echo], found.deflected).sorted()

    def warn_of_colors(self) -> None:
        """Warns if reflectances were derived from colours other than grey."""
        warn_of_assumed_reflectance(self.lidar.settings["wavelength"], self._surfaces.is_colored)
