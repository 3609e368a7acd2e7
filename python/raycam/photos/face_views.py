"""Choice of one photograph for each face, by quality and by the number of seams."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..arguments import Floats, product
from ..srgb import LUMINANCE
from .blending import luminance_outliers

__all__ = ["FaceCandidates", "FaceTotals", "choose_views", "neighbor_faces"]

Ints = npt.NDArray[np.int64]
Ids = npt.NDArray[np.int32]
Single = npt.NDArray[np.float32]

MAX_FACE_VIEWS = 6
"""Number of candidate photographs per face; the photographs with the largest weights are candidates."""
QUALITY_SCALE = 4.0
"""Cost of a photograph of weight 0, relative to the cost of a seam; half of the best weight costs half as much."""
ROUNDS = 40
"""Number of message-passing rounds."""
ABSENT = 1e6
"""Cost of an empty entry in the table of photographs."""


class FaceTotals:
    """Sums of weights and colours for each pair of a face and a photograph."""

    def __init__(self) -> None:
        self.rows: list[tuple[Ids, Ids, Single, Single]] = []

    def add(self, number: int, face: Ids, weight: Single, colors: Single) -> None:
        """Adds texels of a photograph with their faces [k]."""
        if not len(face):
            return
        faces, place = np.unique(face, return_inverse=True)
        sums = np.bincount(place, weights=weight)
        tinted = [np.bincount(place, weights=weight * colors[:, i]) for i in range(3)]
        self.rows.append(
            (
                faces.astype(np.int32),
                np.full(len(faces), number, np.int32),
                sums.astype(np.float32),
                np.stack(tinted, axis=1).astype(np.float32),
            )
        )

    def candidates(self, gains: Floats) -> FaceCandidates:
        """The photographs that may show each face.

        Photographs that differ too much in luminance from the other photographs are dropped, after their colours are
        divided by `gains` [cameras, 3].
        """
        empty = (np.zeros(0, np.int32), np.zeros(0, np.int32), np.zeros(0), np.zeros((0, 3)))
        face, camera, weight, color = (np.concatenate(part) for part in zip(empty, *self.rows, strict=True))
        order = np.lexsort((camera, face))
        face, camera, weight, color = face[order], camera[order], weight[order], color[order]
        first = np.flatnonzero(np.diff(face, prepend=-1) | np.diff(camera, prepend=-1))
        face, camera = face[first], camera[first]
        if len(first):
            weight, color = np.add.reduceat(weight, first), np.add.reduceat(color, first, axis=0)
            color = color / gains[camera]
        order = np.lexsort((camera, -weight, face))
        faces, start, count = np.unique(face, return_index=True, return_counts=True)
        rank = np.arange(len(order)) - np.repeat(start, count)
        row = np.repeat(np.arange(len(faces)), count)
        kept = rank < MAX_FACE_VIEWS
        order, rank, row = order[kept], rank[kept], row[kept]
        views = np.full((len(faces), MAX_FACE_VIEWS), -1, np.int32)
        weights = np.zeros((len(faces), MAX_FACE_VIEWS))
        light = np.zeros((len(faces), MAX_FACE_VIEWS))
        views[row, rank], weights[row, rank] = camera[order], weight[order]
        light[row, rank] = product(color[order], LUMINANCE) / weight[order]
        weights[luminance_outliers(light, weights)] = 0
        views[weights == 0] = -1
        return FaceCandidates(faces.astype(np.int64), views, weights)


@dataclass(frozen=True, eq=False)
class FaceCandidates:
    """Faces [n] that have texels, and the photographs [n, k] that may show each of them."""

    faces: Ints
    """The indices of the faces, ascending."""
    views: Ids
    """Numbers of each face's candidate photographs; -1 for unused entries."""
    weights: Floats
    """For each candidate, the sum of its weights over the face's texels; 0 for unused entries."""


def neighbor_faces(vertices: Ints) -> Ints:
    """Pairs [m, 2] of faces that share an edge, for faces of vertex numbers [f, 3]."""
    edges = np.sort(np.stack([vertices, np.roll(vertices, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
    face = np.repeat(np.arange(len(vertices)), 3)
    order = np.lexsort((face, edges[:, 1], edges[:, 0]))
    same = (edges[order[1:]] == edges[order[:-1]]).all(axis=1)
    pairs = np.stack([face[order[:-1]][same], face[order[1:]][same]], axis=1)
    found: Ints = pairs[pairs[:, 0] != pairs[:, 1]]
    return found


def choose_views(candidates: FaceCandidates, pairs: Ints) -> Ids:
    """Chooses the photograph of each face, with few seams between neighbours.

    `pairs` [m, 2] are the neighbours, as indices of `candidates`. Loopy belief propagation minimises the sum of lost
    quality and seams approximately: min-sum messages between neighbours under the Potts model; the best of all rounds
    is returned. Sources: Lempitsky and Ivanov, Seamless mosaicing of image-based texture maps, 2007; Felzenszwalb and
    Huttenlocher, Efficient belief propagation for early vision, 2006.
    """
    views = candidates.views
    best = candidates.weights.max(axis=1, keepdims=True, initial=0)
    cost = QUALITY_SCALE * (1 - candidates.weights / np.maximum(best, 1e-300))
    cost[views < 0] = ABSENT
    rows = np.arange(len(views))
    chosen = cost.argmin(axis=1)
    if not len(pairs):
        return np.asarray(views[rows, chosen], np.int32)
    source, target = np.concatenate([pairs, pairs[:, ::-1]]).T
    order = np.argsort(target, kind="stable")
    source, target = source[order], target[order]
    place = np.empty(len(order), np.int64)
    place[order] = np.arange(len(order))
    reverse = place[(order + len(pairs)) % len(order)]
    # For each photograph of the target, the corresponding photograph of the source.
    equal = (views[source][:, :, None] == views[target][:, None, :]) & (views[target] >= 0)[:, None, :]
    same, known = equal.argmax(axis=1).T, equal.any(axis=1).T
    flat = same * len(source) + np.arange(len(source))
    starts = np.flatnonzero(np.diff(target, prepend=-1))
    # The array has one row for each choice, because operations on long rows are fast.
    rows_of_cost = np.ascontiguousarray(cost.T)
    message = np.zeros((views.shape[1], len(order)))
    least = energy(cost, views, chosen, pairs)
    for _ in range(ROUNDS):
        belief = rows_of_cost.copy()
        belief[:, target[starts]] += np.add.reduceat(message, starts, axis=1)
        now = smallest_place(belief)
        found = energy(cost, views, now, pairs)
        if found < least:
            least, chosen = found, now
        without = belief[:, source] - message[:, reverse]
        low = without.min(axis=0)
        sent = np.minimum(np.where(known, without.ravel()[flat] - low, np.inf), 1.0)
        change = np.abs(sent - message).max()
        message = (message + sent) / 2
        if change < 1e-3:
            break
    return np.asarray(views[rows, chosen], np.int32)


def smallest_place(table: Floats) -> Ints:
    """The row [n] of the smallest value in each column of a table [k, n].

    Among equal values, the first row is returned.
    """
    place, low = np.zeros(table.shape[1], np.int64), table[0]
    for row, values in enumerate(table[1:], start=1):
        place[values < low] = row
        low = np.minimum(low, values)
    return place


def energy(cost: Floats, views: Ids, chosen: Ints, pairs: Ints) -> float:
    """The sum of the chosen costs, and 1 for each pair of neighbours with different photographs."""
    rows = np.arange(len(views))
    label = views[rows, chosen]
    return float(cost[rows, chosen].sum() + np.count_nonzero(label[pairs[:, 0]] != label[pairs[:, 1]]))
