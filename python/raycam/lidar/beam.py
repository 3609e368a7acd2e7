"""The beam: an elliptical Gaussian, sampled by rays on a hexagonal set."""

from __future__ import annotations

import math

import numpy as np

from .. import _core
from ..arguments import Floats
from ..elementary import log, tan

__all__ = ["beam_rays", "hexagonal_set"]


def hexagonal_set(samples: int) -> tuple[Floats, Floats]:
    """Returns points [k, 2] that sample the beam's cross section, and their weights [k].

    The first point is the centre. The unit is the beam's radius at 1/e². All weights are 1 / k. The points have the
    angles of a hexagonal lattice. The points at one radius represent an annulus, which contains their share of the
    energy of the Gaussian exp(-2 r²). The radius is chosen so that the mean of r² over all points equals the
    Gaussian's mean, 1/2.
    """
    rings = {1: 0, 7: 1, 19: 2, 37: 3}[samples]
    points = [
        (a + b / 2.0, b * math.sqrt(3.0) / 2.0)
        for a in range(-rings, rings + 1)
        for b in range(-rings, rings + 1)
        if abs(a + b) <= rings
    ]
    points.sort(key=lambda point: (round(math.hypot(*point), 9), math.atan2(point[1], point[0])))
    shells: dict[float, list[tuple[float, float]]] = {}
    for point in points[1:]:
        shells.setdefault(round(math.hypot(*point), 9), []).append(point)
    places, inside = [(0.0, 0.0)], 1
    for radius, shell in shells.items():
        share, end = inside / samples, (inside + len(shell)) / samples
        mean = (_moment(end) - _moment(share)) / (end - share) / 2.0
        # The centre point at r = 0 represents a disc whose mean r² is not 0; the first shell compensates for this.
        if inside == 1:
            mean += _moment(share) / 2.0 / (end - share)
        places += [(x / radius * math.sqrt(mean), y / radius * math.sqrt(mean)) for x, y in shell]
        inside += len(shell)
    return np.array(places), np.full(samples, 1.0 / samples)


def _moment(share: float) -> float:
    """Returns the integral of -ln(1 - u) from 0 to `share`."""
    rest = 1.0 - share
    return share + (rest * float(log(rest)) if rest > 1e-12 else 0.0)


def beam_rays(
    origins: Floats,
    directions: Floats,
    rotations: Floats,
    width: tuple[float, float],
    divergence: tuple[float, float],
    samples: int,
    turns: Floats,
    threads: int | None = None,
) -> tuple[Floats, Floats, Floats]:
    """Returns the starts and directions [n, k, 3] of the rays of beams, and their weights [k].

    Starts are relative to the sensor's position; `origins` [n, 3] are the starts of the beams' axes in sensor axes.
    `width`, `divergence` and `samples` are `Lidar.beam_width`, `Lidar.beam_divergence` and `Lidar.beam_samples`. The
    beams are along `directions` [n, 3] in sensor axes; `rotations` [n, 3, 3] or [1, 3, 3] convert them to the axes of
    the result. `turns` [n] rotate the set of rays about each beam's axis by a fraction of a full turn, which prevents
    moiré. The beam's horizontal axis is perpendicular to the sensor's z axis.
    """
    places, weights = hexagonal_set(samples)
    beams = {
        "origins": np.ascontiguousarray(origins),
        "directions": np.ascontiguousarray(directions),
        "turns": np.ascontiguousarray(turns),
        "rotations": np.ascontiguousarray(rotations),
        "samples": places,
        "width": tuple(width),
        "half_tangents": [float(tan(angle / 2.0)) for angle in divergence],
        "threads": threads,
    }
    starts, ways = _core.lidar_beam_rays(beams)
    return starts, ways, weights
