"""Scanners with a pair of rotating wedge prisms (Risley prisms).

Source: Brazeal et al. (2021), "A rigorous observation model for the Risley prism-based Livox Mid-40 lidar sensor",
Sensors 21(14), 4722.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..arguments import Floats
from ..elementary import cos, sin
from .pattern import Pattern, check_count, free_pattern

__all__ = ["Prism", "risley_pattern"]


@dataclass(frozen=True)
class Prism:
    """A wedge prism that rotates about the x axis and has one face perpendicular to this axis."""

    wedge: float
    """The angle between the prism's faces, in degrees."""
    frequency: float
    """Turns per second; negative for the opposite direction."""
    index: float
    """The index of refraction."""
    flat_first: bool = True
    """True if the perpendicular face is towards the laser."""


def risley_pattern(prisms: Sequence[Prism], pulse_rate: float, rate: float, frame: int) -> Pattern:
    """Returns the pulses of frame number `frame`.

    The pattern continues from frame to frame without repeating.
    """
    count = round(pulse_rate / rate)
    check_count(count)
    pulses = np.arange(count) + frame * count
    beam = np.zeros((count, 3))
    beam[:, 0] = 1.0
    for prism in prisms:
        turns = np.fmod(pulses * (prism.frequency / pulse_rate), 1.0)
        angles = 2.0 * math.pi * turns
        tilt = math.radians(prism.wedge)
        side = 1.0 if prism.flat_first else -1.0
        slanted = np.stack(
            [
                np.full(count, cos(tilt)),
                side * sin(tilt) * cos(angles),
                side * sin(tilt) * sin(angles),
            ],
            axis=1,
        )
        flat = np.array([1.0, 0.0, 0.0])
        beam = refract(beam, flat if prism.flat_first else slanted, 1.0 / prism.index)
        beam = refract(beam, slanted if prism.flat_first else flat, prism.index)
    return free_pattern(beam, np.arange(count) / pulse_rate)


def refract(beam: Floats, normal: Floats, ratio: float) -> Floats:
    """Returns the directions [n, 3] after an interface, by Snell's law.

    `normal` points along the beam; `ratio` is the index in front of the interface divided by the index behind it.
    """
    normals = np.broadcast_to(normal, beam.shape)
    cos_in = (beam[:, 0] * normals[:, 0] + beam[:, 1] * normals[:, 1] + beam[:, 2] * normals[:, 2])[:, None]
    cos_out = np.sqrt(1.0 - ratio * ratio * (1.0 - cos_in * cos_in))
    refracted: Floats = ratio * beam + (cos_out - ratio * cos_in) * normals
    return refracted
