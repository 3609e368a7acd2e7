"""The shift of each photograph relative to the other photographs, which reveals wrong poses."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..arguments import Floats, product
from ..srgb import LUMINANCE
from .linear_systems import remove_projection, solve_positive_definite
from .survey import Survey

__all__ = ["Alignment", "measure_alignment"]

CELLS = 3
"""Number of parts along each side of a photograph; each part has its own shift."""
MAX_SHIFT_PX = 2.0
"""Prior standard deviation of the shifts, in pixels."""
MIN_VIEWS = 30
"""Minimum number of views for which a part of a photograph is measured."""
MIN_NOISE = 0.005
"""Minimum noise of photographs relative to their luminance, approximately that of 8 bits."""
MIN_TRUST = 0.1
"""Minimum weight of a view, relative to the median weight in its photograph. Views at a surface's edge have less."""
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

    The shift d of a part of a photograph solves I(u) - others = gradient(I) d + appearance in the least squares sense,
    where `others` is the mean of the other photographs at the same points. The appearance is a linear combination of
    the others' colours, their squared luminance, and the place in the part up to degree 2: it describes another
    exposure, white balance, tone curve, or dark corners. Views with less than their photograph's median weight count
    less, because pixels near an edge mix the surface with its background, which resembles a shift. Sources: Lucas and
    Kanade, An iterative image registration technique with an application to stereo vision, 1981; Baker, Gross and
    Matthews, Lucas-Kanade 20 years on, part 3, 2003 (changes of appearance).
    """
    factors = gains[survey.camera]
    color = survey.color / factors
    light = product(color, LUMINANCE)
    slope = survey.slope / product(factors, LUMINANCE)[:, None]
    weight = survey.weight.astype(np.float64)
    count = np.bincount(survey.point, minlength=survey.points)[survey.point]
    total = np.bincount(survey.point, weights=weight, minlength=survey.points)[survey.point] - weight
    usable = (count > 1) & (total > 1e-3 * weight)
    trust = weight / _medians(weight, survey.camera, survey.cameras)
    usable &= trust > MIN_TRUST
    trust = np.minimum(trust, 1.0)
    other_color = np.zeros_like(color)
    for channel in range(3):
        weighted = weight * color[:, channel]
        sums = np.bincount(survey.point, weights=weighted, minlength=survey.points)[survey.point] - weighted
        np.divide(sums, total, out=other_color[:, channel], where=usable)
    others = product(other_color, LUMINANCE)
    tones = np.column_stack([other_color, others**2])
    difference = light - others
    shift, disagreement = np.full(survey.cameras, np.nan), np.full(survey.cameras, np.nan)
    for number in range(survey.cameras):
        own = np.flatnonzero(usable & (survey.camera == number))
        if len(own) < MIN_VIEWS:
            continue
        relative = np.abs(difference[own]) / np.maximum(others[own], 1e-6)
        disagreement[number] = np.median(relative)
        place = survey.place[own] / sizes[number] * CELLS
        cell = np.minimum(place.astype(int), CELLS - 1)
        cell_index = cell[:, 1] * CELLS + cell[:, 0]
        trends = _quadratics(place - cell)
        squares, views = 0.0, 0
        for part in np.unique(cell_index):
            inside = cell_index == part
            some = own[inside]
            if len(some) >= MIN_VIEWS:
                appearance = np.column_stack([tones[some], trends[inside]])
                noise = MIN_NOISE * float(np.median(others[some]))
                moved = _shift(slope[some], appearance, difference[some], trust[some], noise)
                squares, views = squares + len(some) * float((moved**2).sum()), views + len(some)
        if views:
            shift[number] = np.sqrt(squares / views)
    return Alignment(shift, disagreement)


def _medians(values: Floats, group: npt.NDArray[np.int32], groups: int) -> Floats:
    """Returns the median of the group of each value [n]; groups are numbers in ascending order."""
    medians = np.ones(groups)
    starts = np.searchsorted(group, np.arange(groups + 1))
    for number in range(groups):
        if starts[number] < starts[number + 1]:
            medians[number] = np.median(values[starts[number] : starts[number + 1]])
    found: Floats = medians[group]
    return found


def _quadratics(place: Floats) -> Floats:
    """Returns the monomials [n, 6] of degree 0 to 2 of places [n, 2]."""
    x, y = place.T
    return np.column_stack([np.ones_like(x), x, y, x * x, x * y, y * y])


def _shift(slope: Floats, appearance: Floats, difference: Floats, trust: Floats, noise: float) -> Floats:
    """Returns the shift [2] that explains differences [n] by slopes [n, 2]; views have the weights `trust` [n].

    A linear combination of `appearance` [n, k] explains another part of the differences.

    The shift is damped if `appearance` explains the slopes, or if the slopes are small compared with `noise` (in units
    of the differences).
    """
    moved, weight = np.zeros(2), trust
    for _ in range(ROUNDS):
        root = np.sqrt(weight)
        x, y, off = remove_projection(root * appearance.T, root * np.stack([*slope.T, difference]))
        spread = 1.4826 * float(np.median(np.abs((off - moved[0] * x - moved[1] * y) / root)))
        variance = max(spread, noise) ** 2
        xx, xy, yy, xd, yd = (
            (a * b).sum() / variance for a, b in ((x, x), (x, y), (y, y), (x, off), (y, off))
        )
        prior = 1 / MAX_SHIFT_PX**2
        matrix = np.array([[xx + prior, xy], [xy, yy + prior]])
        moved = solve_positive_definite(matrix, np.array([[xd], [yd]]))[:, 0]
        remaining = (off - moved[0] * x - moved[1] * y) / root
        weight = trust / (1 + (remaining / (3 * max(spread, 1e-6))) ** 2)
    return moved
