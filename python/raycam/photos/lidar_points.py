"""The points that lidars measure on faces, for `surface_visibility`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from ..arguments import Bools, Floats
from ..lidar import Lidar, measured_faces
from ..world import World
from .face_keys import face_keys
from .face_samples import MAX_SAMPLES, MIN_SAMPLES, sample_pattern

__all__ = ["FacePoints", "points_on_faces"]

POINTS_PER_SAMPLE = 16
"""Number of lidar points on a face for each of the face's samples.

The rows of most lidars are ten times as far apart as their points, so that fewer points per sample would leave samples
of measured surfaces without a point.
"""
PAIRS_AT_ONCE = 1 << 18
"""Number of pairs of a point and a sample whose distances are computed at a time."""


@dataclass(frozen=True, eq=False)
class FacePoints:
    """The points of a lidar, ordered by face and pulse."""

    offsets: npt.NDArray[np.int64]
    """Points of face i are `offsets[i]:offsets[i + 1]`, int64 [faces + 1]."""
    barycentric: npt.NDArray[np.float32]
    """The points' weights of the first two corners, float32 [n, 2]."""
    cosine: npt.NDArray[np.float32]
    """The cosines of the points' angles of incidence, float32 [n]."""
    front: Bools
    """True for points on the faces' fronts, [n]."""

    def of(self, facing: str) -> FacePoints:
        """Returns the points on the fronts of faces; if `facing` is "both", returns all points."""
        if facing == "both" or self.front.all():
            return self
        before = np.concatenate([[0], np.cumsum(self.front)])
        kept = self.front
        return FacePoints(before[self.offsets], self.barycentric[kept], self.cosine[kept], self.front[kept])

    def counts(self, faces: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
        """Returns the number of points on each face [k]."""
        found: npt.NDArray[np.int64] = self.offsets[faces + 1] - self.offsets[faces]
        return found

    def first_cosine(self, faces: npt.NDArray[np.int64]) -> Floats:
        """Returns the cosine of the first point of each face [k], which must have points."""
        return self.cosine[self.offsets[faces]].astype(float)

    def nearest_samples(
        self,
        faces: npt.NDArray[np.int64],
        corners: Floats,
        pattern: Floats,
        first: npt.NDArray[np.int64],
        numbers: npt.NDArray[Any],
    ) -> npt.NDArray[np.int64]:
        """Returns the samples, ascending, that are nearest to a point among the samples of its face.

        `corners` [k, 3, 3] are the corners of `faces` [k]. Face i has `numbers[i]` samples, counted from `first[i]` on;
        their weights of the corners are the first rows of `pattern` [m, 3].
        """
        counts = self.counts(faces)
        point, face = _ranges(self.offsets[faces], counts), np.repeat(np.arange(len(faces)), counts)
        return np.unique(_nearest(self.barycentric[point], face, corners, pattern, first, numbers))

    def cover(self, faces: npt.NDArray[np.int64], corners: Floats, places: Floats) -> Bools:
        """Returns True [n] for places on `faces` [n] that are covered by lidar points.

        A place is covered if the sample nearest to it is also the sample nearest to a lidar point on the face.
        `corners` [n, 3, 3] are the corners of `faces` [n]; `places` [n, 3] are weights of the corners. A face has the
        samples that `surface_visibility` uses for this lidar alone.
        """
        found = np.zeros(len(faces), bool)
        some = np.flatnonzero(self.counts(faces))
        if not len(some):
            return found
        met, at, face = np.unique(faces[some], return_index=True, return_inverse=True)
        numbers = np.clip(-(-self.counts(met) // POINTS_PER_SAMPLE), MIN_SAMPLES, MAX_SAMPLES)
        first = np.cumsum(numbers) - numbers
        pattern = sample_pattern(MAX_SAMPLES)
        is_measured = np.zeros(numbers.sum(), bool)
        own = corners[some[at]]
        is_measured[self.nearest_samples(met, own, pattern, first, numbers)] = True
        found[some] = is_measured[_nearest(places[some, :2], face, own, pattern, first, numbers)]
        return found


def _nearest(
    places: npt.NDArray[Any],
    face: npt.NDArray[np.int64],
    corners: Floats,
    pattern: Floats,
    first: npt.NDArray[np.int64],
    numbers: npt.NDArray[Any],
) -> npt.NDArray[np.int64]:
    """Returns the sample [n] nearest to each place on a face.

    A place is given as weights of the first two corners [n, 2] of a face [n]. Faces, corners and samples are
    the same as for `FacePoints.nearest_samples`.
    """
    found = np.zeros(len(places), np.int64)
    for number in np.unique(numbers[face]):
        group = np.flatnonzero(numbers[face] == number)
        step = max(1, PAIRS_AT_ONCE // int(number))
        for start in range(0, len(group), step):
            some = group[start : start + step]
            own = face[some]
            apart = pattern[:number, :2] - places[some, None]
            edges = (corners[own, :2] - corners[own, 2:])[:, None]
            offset = apart[..., :1] * edges[:, :, 0] + apart[..., 1:] * edges[:, :, 1]
            found[some] = first[own] + (offset**2).sum(axis=2).argmin(axis=1)
    return found


def _ranges(first: npt.NDArray[np.int64], counts: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
    """Returns, concatenated for each i, the `counts[i]` consecutive numbers from `first[i]` on."""
    ends = np.cumsum(counts)
    found: npt.NDArray[np.int64] = np.arange(ends[-1] if len(ends) else 0) + np.repeat(
        first - ends + counts, counts
    )
    return found


def points_on_faces(
    world: World, lidar: Lidar, ids: npt.NDArray[np.int32], threads: int | None
) -> FacePoints:
    """Returns the points of a lidar's frame on the faces `ids` [n, 2].

    The ids must be in ascending order.
    """
    found = measured_faces(world, lidar, threads=threads)
    key, wanted = face_keys(ids), face_keys(found.ids)
    face = np.searchsorted(key, wanted)
    known = (face < len(key)) & (key[np.minimum(face, len(key) - 1)] == wanted)
    row = np.flatnonzero(known)
    row = row[np.argsort(face[row], kind="stable")]
    counts = np.bincount(face[row], minlength=len(ids))
    return FacePoints(
        np.concatenate([[0], np.cumsum(counts)]).astype(np.int64),
        found.barycentric[row, :2].astype(np.float32),
        found.cosine[row].astype(np.float32),
        found.front[row],
    )
