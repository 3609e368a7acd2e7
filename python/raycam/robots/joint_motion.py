"""The joint values of a robot over the time of a video."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arguments import Floats

__all__ = ["JointMotion"]


@dataclass(frozen=True)
class JointMotion:
    """Joint values at increasing times, with linear interpolation in between.

    The values are constant before the first time and after the last. Values of continuous joints are unwrapped, so that
    linear interpolation turns in the shorter direction.
    """

    times: Floats
    """Seconds [n]."""
    vectors: Floats
    """Joint vectors [n, k], in the order of `Robot.joints`."""
    whole_video: bool = True
    """True if the video moves nothing but robots."""

    def at(self, time: float) -> Floats:
        """Returns the joint vector [k] at a time in seconds."""
        found: Floats = self.at_all(np.array([time]))[0]
        return found

    def at_all(self, times: Floats) -> Floats:
        """Returns the joint vectors [n, k] at times [n] in seconds."""
        columns = [np.interp(times, self.times, column) for column in self.vectors.T]
        return np.array(columns, np.float64).reshape(-1, len(times)).T
