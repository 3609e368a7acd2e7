"""The shift of each photograph relative to the other photographs, which reveals wrong poses."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arguments import Floats
from ..srgb import LUMINANCE
from .survey import Survey

__all__ = ["Alignment", "measure_alignment"]

CELLS = 3
"""Number of parts along each side of a photograph; each part has its own shift."""
MAX_SHIFT_PX = 2.0
"""Prior standard deviation of the shifts, in pixels."""
MIN_VIEWS = 30
"""Minimum number of views for which a part of a photograph is measured."""
ROUNDS = 5
"""Number of reweighting rounds."""


@dataclass(frozen=True, eq=False)
class Alignment:
    """The fit of each photograph to the other photographs.

    Arrays are [cameras]; values are NaN for photographs without overlap.
    """

    shift: Floats
    """Shift in pixels relative to the other photographs: the root mean square over the photograph's parts."""
    disagreement: Floats
    """Median absolute difference of a photograph's luminance from the other photographs, relative to their
    luminance."""


def measure_alignment(survey: Survey, gains: Floats, sizes: Floats) -> Alignment:
    """Measures the fit of each photograph to the other photographs.

    Photographs have the sizes `sizes` [cameras, 2]; their colours are divided by `gains` [cameras, 3].

    The shift d of a part of a photograph solves I(u) - others = gradient(I) d in the least squares sense, where
    `others` is the mean of the other photographs at the same points. Source: Lucas and Kanade, An iterative image
    registration technique with an application to stereo vision, 1981.
    """
    factors = gains[survey.camera]
    light = (survey.color / factors) @ LUMINANCE.astype(np.float64)
    slope = survey.slope / (factors @ LUMINANCE)[:, None]
    weight = survey.weight.astype(np.float64)
    total = np.bincount(survey.point, weights=weight, minlength=survey.points)[survey.point] - weight
    sums = np.bincount(survey.point, weights=weight * light, minlength=survey.points)[survey.point]
    count = np.bincount(survey.point, minlength=survey.points)[survey.point]
    usable = (count > 1) & (total > 1e-3 * weight)
    others = np.divide(sums - weight * light, total, out=np.zeros_like(total), where=usable)
    difference = light - others
    shift, disagreement = np.full(survey.cameras, np.nan), np.full(survey.cameras, np.nan)
    for number in range(survey.cameras):
        own = np.flatnonzero(usable & (survey.camera == number))
        if len(own) < MIN_VIEWS:
            continue
        relative = np.abs(difference[own]) / np.maximum(others[own], 1e-6)
        disagreement[number] = np.median(relative)
        cell = np.minimum((survey.place[own] / sizes[number] * CELLS).astype(int), CELLS - 1)
        cell = cell[:, 1] * CELLS + cell[:, 0]
        squares, views = 0.0, 0
        for part in np.unique(cell):
            some = own[cell == part]
            if len(some) >= MIN_VIEWS:
                moved = _shift(slope[some], difference[some])
                squares, views = squares + len(some) * float(moved @ moved), views + len(some)
        if views:
            shift[number] = np.sqrt(squares / views)
    return Alignment(shift, disagreement)


def _shift(slope: Floats, difference: Floats) -> Floats:
    """Returns the shift [2] that explains differences [n] by slopes [n, 2].

    The shift is damped if the slopes are small.
    """
    moved: Floats = np.zeros(2)
    weight: Floats = np.ones(len(slope))
    for _ in range(ROUNDS):
        off = difference - slope @ moved
        # A constant difference is caused by a wrong gain, not by a shift.
        off = off - np.average(off, weights=weight)
        spread = max(1.4826 * float(np.median(np.abs(off))), 1e-6)
        weight = 1 / (1 + (off / (3 * spread)) ** 2)
        middle = np.average(slope, axis=0, weights=weight)
        centred = slope - middle
        target = difference - np.average(difference, weights=weight)
        matrix = centred.T @ (weight[:, None] * centred) / spread**2 + np.eye(2) / MAX_SHIFT_PX**2
        moved = np.linalg.solve(matrix, centred.T @ (weight * target) / spread**2).astype(np.float64)
    return moved
