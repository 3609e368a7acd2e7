"""Gains of photographs: exposure and white balance.

Gains are estimated from the photographs' overlaps.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ..arguments import Floats
from ..elementary import exp, log
from .linear_systems import solve_positive_definite
from .survey import Survey

__all__ = ["estimate_gains"]

Ids = npt.NDArray[np.int32]

DARKEST, BRIGHTEST = 0.003, 0.95
"""Linear values between which pixels are neither noise nor clipped."""
ROUNDS = 6
"""Number of reweighting rounds."""
MAX_POINT_VIEWS = 16
"""Number of views that are compared per point; the views with the largest weights are used."""
RIDGE = 1e-10
"""Weight of the prior gain 1 relative to the views' weights; the prior determines gains of photographs without overlap.
"""
OUTLIER_SCALE = 0.05
"""Differences of log colour above which views count less, such as highlights and wrong poses."""


def estimate_gains(survey: Survey) -> Floats:
    """The factors [cameras, 3] of each photograph's linear red, green and blue.

    The logarithms are the least squares solution of log color = log reflected + log gain over points that are visible
    in two photographs. Reweighting reduces the effect of outliers. The mean of the logarithms is 0 for each group of
    photographs that overlap. Photographs without overlap have the gain 1. Source: Brown and Lowe, Automatic panoramic
    image stitching using invariant features, 2007.
    """
    gains = np.ones((survey.cameras, 3))
    usable = np.all((survey.color > DARKEST) & (survey.color < BRIGHTEST), axis=1)
    # Views are in the order of points; for each point, the views with the largest weights come first.
    order = np.lexsort((survey.camera, -survey.weight, survey.point))
    order = order[usable[order]]
    count = np.bincount(survey.point[order], minlength=survey.points)
    rank = np.arange(len(order)) - np.repeat(np.cumsum(count) - count, count)
    order = order[(rank < MAX_POINT_VIEWS) & (count[survey.point[order]] > 1)]
    point, camera = survey.point[order], survey.camera[order]
    if not len(point):
        return gains
    logs = log(survey.color[order])
    base = survey.weight[order].astype(np.float64)
    base /= np.bincount(point, weights=base, minlength=survey.points)[point]
    weight = base
    for _ in range(ROUNDS):
        found, off = _solve(point, camera, weight, logs, survey.points, survey.cameras)
        weight = base / (1 + (off**2).mean(axis=1) / OUTLIER_SCALE**2)
    return exp(found)


def _solve(
    point: Ids, camera: Ids, weight: Floats, values: Floats, points: int, cameras: int
) -> tuple[Floats, Floats]:
    """Returns the weighted least squares solution [cameras, 3], and the residuals [m, 3].

    The solution does not contain the points' unknowns.
    """

    def sums(number: Ids, array: Floats, count: int) -> Floats:
        return np.stack([np.bincount(number, weights=column, minlength=count) for column in array.T], axis=1)

    total = np.maximum(np.bincount(point, weights=weight, minlength=points), 1e-300)[:, None]
    middle = sums(point, weight[:, None] * values, points) / total
    right = sums(camera, weight[:, None] * (values - middle[point]), cameras)
    # Pairs of views of the same point, grouped by the views' distance in the order of points.
    places, products = [], []
    for step in range(1, min(MAX_POINT_VIEWS, len(point))):
        late, early = slice(step, None), slice(0, len(point) - step)
        same = point[late] == point[early]
        products.append((weight[early] * weight[late] / total[point[late], 0])[same])
        places.append(camera[early][same].astype(np.int64) * cameras + camera[late][same])
    pair = np.bincount(
        np.concatenate(places), weights=np.concatenate(products), minlength=cameras**2
    ).reshape(cameras, cameras)
    own = np.bincount(camera, weights=weight - weight**2 / total[point, 0], minlength=cameras)
    ridge = RIDGE * max(float(own.max()), 1e-300)
    matrix = (np.diag(own + ridge) - pair - pair.T).astype(np.float64)
    found = solve_positive_definite(matrix, right)
    reflected = sums(point, weight[:, None] * (values - found[camera]), points) / total
    return found, values - found[camera] - reflected[point]
