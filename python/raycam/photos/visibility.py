"""Visibility of faces to cameras and lidars, with resolution and angle."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from ..arguments import Bools, Floats, one_of, thread_count, whole
from ..camera import Camera
from ..errors import Notice, WorldError
from ..lidar import Lidar
from ..notices import warn, warn_all
from ..one_line import one_line
from ..world import World
from ..world.chosen import Chosen, object_mask
from ..world.face_geometry import face_areas, face_normals
from .face_samples import MAX_SAMPLES, MIN_SAMPLES, sample_pattern
from .lidar_points import POINTS_PER_SAMPLE, FacePoints, points_on_faces
from .placement import GRID_SIDE, pixel_grid, placement_notices
from .sight import Facing, Sight, find_sight, in_morton_order, meets_front
from .truth import named_viewpoints

__all__ = ["FacePairs", "SurfaceVisibility", "surface_visibility"]

LARGE_FACE_PX = 4.0
"""Area in pixels of a face, in any camera, above which it gets as many samples as pixels."""
CHUNK_SAMPLES = 1 << 17
"""Number of samples processed at a time, about 100 MB."""
INSIDE_OUT_SHARE = 0.9
"""Fraction of rays that hit back sides first from which both sides of faces count."""


@dataclass(frozen=True, eq=False)
class FacePairs:
    """A sparse matrix face x camera (or lidar), in compressed rows (CSR)."""

    offsets: npt.NDArray[np.int64]
    """Entries of face i are `offsets[i]:offsets[i + 1]`, int64 [faces + 1]."""
    camera: npt.NDArray[np.int32]
    """The number of each entry's camera or lidar, int32 [m], ascending within a face."""
    fraction: npt.NDArray[np.float32]
    """The fraction of the face's samples that is visible from this camera or lidar, float32 [m], more than 0."""


@one_line
@dataclass(frozen=True, eq=False)
class SurfaceVisibility:
    """The result of `surface_visibility`.

    Arrays [n] have one value for each face, in the order of `ids`.
    """

    ids: npt.NDArray[np.int32]
    """(instance, triangle) of the faces, int32 [n, 2], in the order of `World.triangle_ids`."""
    names: tuple[str, ...]
    """The names of the photographs, or else of the cameras and lidars."""
    views: npt.NDArray[np.int32]
    """The number of cameras and lidars from which a part of the face is visible, int32."""
    fraction: npt.NDArray[np.float32]
    """The fraction of the face's samples that is visible from any camera or lidar, float32."""
    best_view: npt.NDArray[np.int32]
    """The camera or lidar with the best resolution, int32; -1 for a face that is not visible."""
    best_resolution: npt.NDArray[np.float32]
    """Resolution of `best_view`, float32: pixels per metre in the surface direction with fewer pixels; for a lidar, the
    square root of its points per square metre of the face. 0 if not visible.
    """
    angle: npt.NDArray[np.float32]
    """Angle of incidence of `best_view` in degrees, float32; NaN if not visible."""
    faces_seen: npt.NDArray[np.int32]
    """The number of faces that are visible from each camera or lidar, int32 [cameras]."""
    facing: Facing
    """"front", or "both" if back sides counted too."""
    pairs: FacePairs | None = None
    """The visible faces of each camera or lidar; None unless `pairs=True`."""

    def of(self, instance: int) -> npt.NDArray[np.bool_]:
        """Returns True [n] for the faces of an object, by its id."""
        found: npt.NDArray[np.bool_] = self.ids[:, 0] == instance
        return found


def surface_visibility(
    world: World,
    cameras: Mapping[str, Camera | Lidar] | Sequence[Camera | Lidar],
    *,
    objects: Chosen | None = None,
    samples: int | Literal["faces"] = "faces",
    facing: Literal["auto", "front", "both"] = "auto",
    pairs: bool = False,
    images: Mapping[str, str] | None = None,
    threads: int | None = None,
) -> SurfaceVisibility:
    """Finds the faces that are visible from cameras and lidars, with exact rays.

    `cameras` are posed cameras, for example from `load_cameras`; `objects` are the ids or names of the objects whose
    faces are returned. All objects occlude. A sample on a face is visible if it projects through the lens into the
    image, faces the camera, and no triangle is between it and the camera's centre (with a rolling shutter, the centre
    at the time of the pixel's line). `samples` is the number of samples per face. "faces" uses the centroid and the
    corners, moved inwards by 1 %; faces larger than 4 pixels in any camera have as many samples as pixels, up to 256.

    `cameras` may also contain lidars (`Rig.sensors`, `World.sensors`). A face is visible to a lidar if a pulse of its
    first frame measures a point on it. These are exactly the faces of the points of `scan(world,
    lidar.replace(noise=False))` with `bounces` 0. The scan uses the world and the lidar's pose at each pulse's time,
    the beam's samples, `returns` and range limits. A sample is visible to a lidar if it is the face's sample nearest to
    a point; "faces" uses one sample for 16 points on a face, from 4 to 256.

    `facing="front"` ignores cameras behind a face and points on its back; "both" includes them. "auto" means "front",
    or "both" with a notice if at least 90 % of the rays that hit the world hit back sides first. `pairs=True` also
    returns the visible faces of each camera. A notice is issued if fewer than half of the cameras show the world, and
    for a lidar without points. Memory does not grow with the number of cameras, except with `pairs`; each point of a
    lidar takes 13 bytes.

    Raises `SettingsError` for invalid arguments and `WorldError` for unknown objects and worlds without faces.
    """
    named = named_viewpoints(cameras, images)
    lenses = {name: camera for name, camera in named.items() if isinstance(camera, Camera)}
    count = None if samples == "faces" else whole("samples", samples, 1, MAX_SAMPLES)
    threads = thread_count(threads)
    one_of("facing", facing, ("auto", "front", "both"))
    mask = object_mask(world._core, objects)
    ids, corners = world.triangle_ids(), world.triangles()
    if mask is not None:
        kept = np.flatnonzero(mask[ids[:, 0]])
        ids, corners = ids[kept], corners[kept]
    if not len(ids):
        raise WorldError(
            "the world has no visible faces; surface_visibility requires a mesh", code="nothing_visible"
        )
    warn_all(placement_notices(world, lenses))
    points = {
        name: points_on_faces(world, lidar, ids, threads)
        for name, lidar in named.items()
        if isinstance(lidar, Lidar)
    }
    sides = side_of(world, list(lenses.values()), threads, points.values()) if facing == "auto" else facing
    each = [points[name].of(sides) if name in points else lenses[name] for name in named]
    order = in_morton_order(corners.mean(axis=1))
    found = _Totals(len(ids), len(each), pairs)
    for some in _chunks(order, corners, each, count):
        found.add(world, each, some, corners[some[0]], sides, threads)
    return found.result(ids, tuple(named), sides)


def side_of(
    world: World,
    cameras: Sequence[Camera],
    threads: int | None = None,
    lidars: Iterable[FacePoints] = (),
) -> Literal["front", "both"]:
    """Returns "both" if nearly all rays that hit the world hit back sides first, else "front".

    The limit is 90 %; "both" is reported by a notice. Each lidar contributes about as many points as a camera has rays,
    or all of its points if it has fewer.
    """
    hits = [meets_front(world, camera, pixel_grid(camera), threads) for camera in cameras]
    hits += [one.front[:: max(1, len(one.front) // GRID_SIDE**2)] for one in lidars]
    fronts = np.concatenate(hits) if hits else np.zeros(0, bool)
    if len(fronts) == 0 or fronts.mean() > 1 - INSIDE_OUT_SHARE:
        return "front"
    message = (
        f"{100 * (1 - fronts.mean()):.0f} % of the rays hit the backs of faces, so the mesh seems to be inside out or "
        'mirrored; both sides are treated as visible (facing="both"); flip the faces to correct the mesh'
    )
    warn(Notice(message, "inside_out_mesh"))
    return "both"


Chunk = tuple[npt.NDArray[np.int64], npt.NDArray[np.int64], Floats]
"""Faces [k], and for each sample the index into these faces [m] and its barycentric weights [m, 3]."""


def _chunks(
    order: npt.NDArray[np.int64],
    corners: Floats,
    viewpoints: Sequence[Camera | FacePoints],
    count: int | None,
) -> Iterator[Chunk]:
    """Iterates over faces with their samples, at most `CHUNK_SAMPLES` samples at once."""
    cameras = [one for one in viewpoints if isinstance(one, Camera)]
    lidars = [one for one in viewpoints if isinstance(one, FacePoints)]
    limit = CHUNK_SAMPLES // MAX_SAMPLES
    pattern = (
        {number: sample_pattern(number) for number in range(1, MAX_SAMPLES + 1)} if count is None else {}
    )
    start = 0
    while start < len(order):
        faces = order[start : start + max(limit, CHUNK_SAMPLES // 8)]
        numbers = np.full(len(faces), count or 0)
        if count is None:
            wanted = largest_areas(corners[faces], cameras)
            for points in lidars:
                wanted = np.maximum(wanted, points.counts(faces) / POINTS_PER_SAMPLE)
            numbers = np.clip(np.ceil(wanted), MIN_SAMPLES, MAX_SAMPLES).astype(int)
        fit = max(1, int(np.searchsorted(np.cumsum(numbers), CHUNK_SAMPLES, side="right")))
        faces, numbers = faces[:fit], numbers[:fit]
        owner = np.repeat(np.arange(len(faces)), numbers)
        weights = np.concatenate(
            [pattern[n] if count is None else sample_pattern(count, corners=False) for n in numbers]
        )
        yield faces, owner, weights
        start += len(faces)


def largest_areas(corners: Floats, cameras: Sequence[Camera]) -> Floats:
    """Returns the largest area in pixels [n] of triangles [n, 3, 3] among all cameras.

    Areas below `LARGE_FACE_PX` are 0.
    """
    largest = np.zeros(len(corners))
    for camera in cameras:
        pixels, in_front = camera.project(corners.reshape(-1, 3))
        p, ok = pixels.reshape(-1, 3, 2), in_front.reshape(-1, 3).all(axis=1)
        a, b = p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]
        low, high = p.min(axis=1), p.max(axis=1)
        with np.errstate(invalid="ignore", over="ignore"):
            area = np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / 2
            inside = ok & (high >= camera.corner).all(axis=1)
            inside &= (low <= np.array(camera.size) + camera.corner).all(axis=1)
        largest = np.maximum(largest, np.where(inside & np.isfinite(area), area, 0.0))
    return np.where(largest > LARGE_FACE_PX, largest, 0.0)


class _Totals:
    """Values of all faces, filled chunk by chunk."""

    def __init__(self, faces: int, cameras: int, pairs: bool) -> None:
        self.views = np.zeros(faces, np.int32)
        self.fraction = np.zeros(faces, np.float32)
        self.best_view = np.full(faces, -1, np.int32)
        self.best_resolution = np.zeros(faces, np.float32)
        self.angle = np.full(faces, np.nan, np.float32)
        self.faces_seen = np.zeros(cameras, np.int32)
        self.entries: list[tuple[npt.NDArray[np.int64], npt.NDArray[np.int32], npt.NDArray[np.float32]]] = []
        self.pairs = pairs

    def add(
        self,
        world: World,
        viewpoints: Sequence[Camera | FacePoints],
        chunk: Chunk,
        corners: Floats,
        facing: Facing,
        threads: int | None,
    ) -> None:
        """Adds the faces of a chunk, with their corners [k, 3, 3], for cameras and points of lidars."""
        faces, owner, weights = chunk
        points = np.einsum("nk,nkj->nj", weights, corners[owner])
        normals = face_normals(corners)
        total = np.bincount(owner, minlength=len(faces))
        seen = np.zeros(len(owner), bool)
        for number, viewpoint in enumerate(viewpoints):
            if isinstance(viewpoint, FacePoints):
                seen[self._add_points(number, viewpoint, chunk, corners, total)] = True
                continue

            def sight_of(samples: npt.NDArray[np.int64], camera: Camera = viewpoint) -> Sight:
                return find_sight(
                    world,
                    camera,
                    points[samples],
                    normals[owner[samples]],
                    facing=facing,
                    footprints=True,
                    threads=threads,
                )

            self._add_camera(number, sight_of, chunk, total, seen)
        self.fraction[faces] = np.bincount(owner, weights=seen, minlength=len(faces)) / total

    def _add_camera(
        self,
        number: int,
        sight_of: Callable[[npt.NDArray[np.int64]], Sight],
        chunk: Chunk,
        total: npt.NDArray[np.int64],
        seen: Bools,
    ) -> None:
        """Adds a chunk's faces that are visible to a camera; marks visible samples in `seen`.

        The first sample of each face is tested first. After that, only samples that can change the result are
        tested: the samples of faces that are not visible so far, and samples that no earlier camera shows. With
        `pairs`, all samples are tested.
        """
        faces, owner, _ = chunk
        first = np.cumsum(total) - total
        hits = np.zeros(len(faces), np.int64)
        self._add_samples(number, sight_of, (faces, owner, first), hits, seen)
        can_change = self.pairs | (hits[owner] == 0) | ~seen
        can_change[first] = False
        self._add_samples(number, sight_of, (faces, owner, np.flatnonzero(can_change)), hits, seen)
        self._count(number, faces, hits, total)

    def _add_samples(
        self,
        number: int,
        sight_of: Callable[[npt.NDArray[np.int64]], Sight],
        chosen: tuple[npt.NDArray[np.int64], npt.NDArray[np.int64], npt.NDArray[np.int64]],
        hits: npt.NDArray[np.int64],
        seen: Bools,
    ) -> None:
        """Tests samples of a chunk in a camera; adds visible ones to `hits` [k] and `seen` [m].

        `chosen` are the chunk's faces [k], the index of each sample's face [m], and the indices of the samples to
        test. The first visible sample of a face represents the face.
        """
        faces, owner, samples = chosen
        sight = sight_of(samples)
        visible = samples[sight.index]
        seen[visible] = True
        represented, at = np.unique(owner[visible], return_index=True)
        is_new = hits[represented] == 0
        represented, at = represented[is_new], at[is_new]
        resolution = smaller_singular_value(sight.footprints[at])
        self._keep_best(number, faces[represented], resolution, sight.cosine[at])
        hits += np.bincount(owner[visible], minlength=len(faces))

    def _add_points(
        self,
        number: int,
        points: FacePoints,
        chunk: Chunk,
        corners: Floats,
        total: npt.NDArray[np.int64],
    ) -> npt.NDArray[np.int64]:
        """Adds the faces of a chunk on which a lidar has points.

        Returns the samples [m] nearest to the lidar's points.
        """
        faces, owner, weights = chunk
        counts = points.counts(faces)
        met = np.flatnonzero(counts)
        first = np.cumsum(total) - total
        samples = points.nearest_samples(faces[met], corners[met], weights, first[met], total[met])
        some = self._count(number, faces, np.bincount(owner[samples], minlength=len(faces)), total)
        resolution = np.sqrt(counts[some] / np.maximum(face_areas(corners[some]), 1e-300))
        self._keep_best(number, faces[some], resolution, points.first_cosine(faces[some]))
        return samples

    def _count(
        self,
        number: int,
        faces: npt.NDArray[np.int64],
        hits: npt.NDArray[np.int64],
        total: npt.NDArray[np.int64],
    ) -> npt.NDArray[np.int64]:
        """Adds faces [k] with visible samples; returns the indices of visible faces.

        `hits` [k] of the faces' `total` [k] samples are visible.
        """
        some = np.flatnonzero(hits)
        self.views[faces[some]] += 1
        self.faces_seen[number] += len(some)
        if self.pairs:
            share = (hits[some] / total[some]).astype(np.float32)
            self.entries.append((faces[some], np.full(len(some), number, np.int32), share))
        return some

    def _keep_best(
        self, number: int, faces: npt.NDArray[np.int64], resolution: Floats, cosine: Floats
    ) -> None:
        """Stores the camera or lidar as the best view of faces [k].

        Faces change only if the view's resolution is the largest so far.
        """
        single = resolution.astype(np.float32)
        better = single > self.best_resolution[faces]
        faces = faces[better]
        self.best_resolution[faces], self.best_view[faces] = single[better], number
        self.angle[faces] = np.degrees(np.arccos(np.clip(cosine[better], 0, 1)))

    def result(
        self, ids: npt.NDArray[np.int32], names: tuple[str, ...], facing: Literal["front", "both"]
    ) -> SurfaceVisibility:
        """The values as a result."""
        sparse = None
        if self.pairs:
            empty = (np.zeros(0, np.int64), np.zeros(0, np.int32), np.zeros(0, np.float32))
            face, camera, share = (np.concatenate(part) for part in zip(empty, *self.entries, strict=True))
            order = np.lexsort((camera, face))
            offsets = np.concatenate([[0], np.cumsum(np.bincount(face, minlength=len(ids)))]).astype(np.int64)
            sparse = FacePairs(offsets, camera[order], share[order])
        return SurfaceVisibility(
            ids,
            names,
            self.views,
            self.fraction,
            self.best_view,
            self.best_resolution,
            self.angle,
            self.faces_seen,
            facing,
            sparse,
        )


def smaller_singular_value(jacobian: Floats) -> Floats:
    """Returns the smaller singular values [n] of matrices [n, 2, 2].

    The value is 0 for matrices that are not finite.
    """
    a, b, c, d = (jacobian[:, i, j] for i in (0, 1) for j in (0, 1))
    with np.errstate(invalid="ignore"):
        s = np.hypot(a + d, c - b) / 2
        t = np.hypot(a - d, c + b) / 2
    found: Floats = np.nan_to_num(np.abs(s - t))
    return found
