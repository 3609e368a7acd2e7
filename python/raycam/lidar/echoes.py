"""Echoes: the local maxima of the waveform of each pulse."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from ..arguments import Floats
from .paths import Contributions

__all__ = ["FWHM_TO_SIGMA", "Echoes", "find_echoes"]

FWHM_TO_SIGMA = 1.0 / (2.0 * math.sqrt(2.0 * math.log(2.0)))
"""The standard deviation of a Gaussian pulse of width 1 at half its maximum."""
APART = 8.0
"""Minimum gap, in standard deviations of the pulse, across which surfaces do not change each other's maxima."""
MERGED = 2.0
"""Surfaces within this many standard deviations have a single maximum."""
BLOCK = 1 << 21
"""Number of values processed at a time."""


@dataclass
class Echoes:
    """The echoes of all pulses, ordered by pulse and distance; [e] each."""

    pulse: npt.NDArray[np.int64]
    length: Floats
    """Position of the maximum: half the optical length, in metres."""
    energy: Floats
    """Sum of the energies of the echo's contributions."""
    main: npt.NDArray[np.int64]
    """The largest contribution of the surface that contributes the most energy."""
    purity: npt.NDArray[np.float32]
    """The share of the echo's energy that comes from the surface of `main`; an object counts as a separate surface
    for each number of bounces."""
    is_single: bool = False
    """True if each pulse has only one surface, so at most one echo."""


def find_echoes(found: Contributions, pulse_length: float) -> Echoes:
    """Returns the echoes: the local maxima of the pulses' waveforms.

    A waveform is the sum of energy * g(r - length), where g is a Gaussian of the pulse's length.
    `pulse_length` is the pulse's full width at half maximum in metres of distance; 0: each surface is an
    echo.
    """
    if len(found.pulse) and (np.diff(found.pulse) > 0).all():
        return _single_echoes(found)
    order = _order_by_length(found.pulse, found.length)
    pulse, length = found.pulse[order], found.length[order]
    weight = np.maximum(found.energy[order], 1e-300)
    sigma = pulse_length * FWHM_TO_SIGMA
    same = pulse[1:] == pulse[:-1]
    gap = np.diff(length)
    limit = APART * sigma
    cluster = np.concatenate([[0], np.cumsum(~(same & (gap <= limit)))]) if len(pulse) else np.zeros(0, int)
    mode = _modes(cluster, length, weight, sigma) if sigma > 0.0 else length
    key = np.round(mode / max(sigma * 1e-3, 1e-9))
    ordered = np.arange(len(key))
    if ((key[1:] < key[:-1]) & (cluster[1:] == cluster[:-1])).any():
        ordered = np.lexsort((key, cluster))
    new = np.ones(len(ordered), bool)
    new[1:] = (cluster[ordered][1:] != cluster[ordered][:-1]) | (
        np.abs(np.diff(mode[ordered])) > 1e-3 * sigma
    )
    number = np.empty(len(ordered), np.int64)
    number[ordered] = np.cumsum(new) - 1
    return _grouped(found, order, number, mode, pulse)


def _single_echoes(found: Contributions) -> Echoes:
    """Returns the echoes of pulses with one surface each, in their order."""
    count = len(found.pulse)
    ones = np.broadcast_to(np.float32(1.0), (count,))
    return Echoes(found.pulse, found.length, found.energy, np.arange(count), ones, is_single=True)


def _grouped(
    found: Contributions,
    order: npt.NDArray[Any],
    number: npt.NDArray[np.int64],
    mode: Floats,
    pulse: npt.NDArray[np.int64],
) -> Echoes:
    """Sums contributions by their echo's number and chooses each echo's main surface."""
    count = int(number.max()) + 1 if len(number) else 0
    energy = found.energy[order]
    total = np.bincount(number, energy, count).astype(float)
    surface = np.stack([found.fields["instance"][order], found.bounces[order]], axis=1)
    by_surface = _order_by_surface(surface, number)
    changed = np.ones(len(by_surface), bool)
    changed[1:] = (np.diff(number[by_surface]) != 0) | (np.diff(surface[by_surface], axis=0) != 0).any(axis=1)
    group = np.cumsum(changed) - 1
    shares = np.bincount(group, energy[by_surface]) if len(group) else np.zeros(0)
    of_row = np.empty(len(by_surface), np.int64)
    of_row[by_surface] = group
    main = _leaders(number, (shares[of_row], energy, -order)) if count else by_surface
    with np.errstate(divide="ignore", invalid="ignore"):
        purity = np.where(total > 0.0, shares[of_row[main]] / total, 1.0) if count else np.zeros(0)
    arrange = np.lexsort((mode[main], pulse[main]))
    main = main[arrange]
    return Echoes(pulse[main], mode[main], total[arrange], order[main], purity[arrange].astype(np.float32))


def _order_by_length(pulse: npt.NDArray[np.int64], length: Floats) -> npt.NDArray[np.int64]:
    """Returns the order by pulse, then length, then row."""
    if (np.diff(pulse) < 0).any():
        return np.lexsort((length, pulse))
    order = np.arange(len(pulse))
    starts = np.flatnonzero(np.diff(pulse, prepend=-1))
    sizes = np.diff(np.append(starts, len(pulse)))
    for size in np.unique(sizes[sizes > 1]):
        rows = starts[sizes == size][:, None] + np.arange(size)
        order[rows] = np.take_along_axis(rows, np.argsort(length[rows], axis=1, kind="stable"), axis=1)
    return order


def _order_by_surface(surface: npt.NDArray[Any], number: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
    """Returns the order by echo number, then surface [n, 2], then row."""
    if (np.diff(number) < 0).any():
        return np.lexsort((surface[:, 1], surface[:, 0], number))
    order = np.arange(len(number))
    changed = (np.diff(surface, axis=0) != 0).any(axis=1) & (np.diff(number) == 0)
    mixed = np.zeros(int(number.max(initial=-1)) + 1, bool)
    mixed[number[1:][changed]] = True
    rows = np.flatnonzero(mixed[number])
    order[rows] = rows[np.lexsort((surface[rows, 1], surface[rows, 0], number[rows]))]
    return order


def _leaders(number: npt.NDArray[np.int64], ranks: Sequence[npt.NDArray[Any]]) -> npt.NDArray[np.int64]:
    """Returns the row of each echo number with the largest rank.

    The next rank decides between equal ranks.
    """
    rows = np.arange(len(number))
    if (np.diff(number) < 0).any():
        rows = np.argsort(number, kind="stable")
    for rank in ranks:
        own = number[rows]
        largest = np.maximum.reduceat(rank[rows], np.flatnonzero(np.diff(own, prepend=-1)))
        rows = rows[rank[rows] == largest[own]]
    return rows


def _modes(cluster: npt.NDArray[np.int64], length: Floats, weight: Floats, sigma: float) -> Floats:
    """Returns the waveform's maximum for each contribution.

    The maximum is reached by climbing the waveform of the contribution's cluster, starting at the
    contribution.
    """
    starts = (
        np.flatnonzero(np.concatenate([[True], np.diff(cluster) != 0])) if len(cluster) else np.zeros(0, int)
    )
    sizes = np.diff(np.concatenate([starts, [len(cluster)]]))
    ends = starts + sizes - 1
    mode = length.copy()
    for size in np.unique(sizes[sizes > 1]):
        chosen = np.flatnonzero(sizes == size)
        for block in np.array_split(chosen, max(1, len(chosen) * int(size) ** 2 // BLOCK)):
            rows = starts[block][:, None] + np.arange(size)
            near = length[ends[block]] - length[starts[block]] <= MERGED * sigma
            places, shares = length[rows], weight[rows]
            shares = shares / shares.max(axis=1, keepdims=True)
            single = np.flatnonzero(near)
            if len(single):
                mean = (places[single] * shares[single]).sum(axis=1) / shares[single].sum(axis=1)
                top = _single_maximum(mean, places[single], shares[single], sigma)
                mode[rows[single]] = top[:, None]
            several = np.flatnonzero(~near)
            if len(several):
                begin = places[several].reshape(-1)
                repeated = np.repeat(np.arange(len(several)), size)
                top = _climb(begin, places[several][repeated], shares[several][repeated], sigma)
                mode[rows[several].reshape(-1)] = top
    return mode


def _single_maximum(at: Floats, places: Floats, shares: Floats, sigma: float) -> Floats:
    """Returns the maxima of sums of Gaussians that have a single maximum.

    The Gaussians are at `places` [n, m], and the maxima are near the starts `at` [n].

    The method is Newton's method for the zero of the mean shift, with steps of at most half a standard
    deviation.
    """
    at = at.copy()
    active = np.arange(len(at))
    for _ in range(100):
        step, spread = _shift(at[active], places[active], shares[active], sigma)
        step = np.clip(step / np.maximum(1.0 - spread / sigma**2, 0.05), -0.5 * sigma, 0.5 * sigma)
        at[active] += step
        active = active[np.abs(step) > 1e-8 * sigma]
        if not len(active):
            break
    return at


def _climb(at: Floats, places: Floats, shares: Floats, sigma: float) -> Floats:
    """Returns the maxima reached by climbing sums of Gaussians from the starts `at` [n].

    The Gaussians are at `places` [n, m], with the weights `shares` [n, m].

    The method is mean shift, which never descends, until a step is below sigma / 1000 and the sum curves downwards;
    then Newton's method. On a slope without a maximum, steps become small, but the sum curves upwards around them.
    """
    at = at.copy()
    active = np.arange(len(at))
    for _ in range(5000):
        step, spread = _shift(at[active], places[active], shares[active], sigma)
        at[active] += step
        size, flat = np.abs(step), spread > 0.95 * sigma**2
        active = active[(size > 1e-3 * sigma) | (flat & (size > 1e-7 * sigma))]
        if not len(active):
            break
    for _ in range(8):
        step, spread = _shift(at, places, shares, sigma)
        slope = 1.0 - spread / sigma**2
        at += np.where(slope > 0.05, np.divide(step, slope, out=step.copy(), where=slope > 0.05), step)
    return at


def _shift(at: Floats, places: Floats, shares: Floats, sigma: float) -> tuple[Floats, Floats]:
    """Returns the mean of `places` [n, m] near `at` [n] relative to `at`, and their variance.

    A place's weight is its value in `shares` times a Gaussian of the distance from `at`.
    """
    apart = places - at[:, None]
    seen = shares * np.exp(-0.5 * (apart / sigma) ** 2)
    total = np.maximum(seen.sum(axis=1), 1e-300)
    mean = (seen * apart).sum(axis=1) / total
    variance = (seen * (apart - mean[:, None]) ** 2).sum(axis=1) / total
    return mean, variance
