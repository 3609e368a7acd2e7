"""Visibility of faces to cameras and lidars, with resolution and angle."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from ..arguments import Floats, one_of, thread_count, whole
from ..camera import Camera
from ..elementary import acos
from ..errors import Notice, WorldError
from ..lidar import Lidar
from ..notices import warn, warn_all
from ..one_line import one_line
from ..world import World
from ..world.chosen import Chosen, object_mask
from ..world.face_geometry import face_areas
from .camera_grid import GRID_SIDE, pixel_grid
from .face_samples import MAX_SAMPLES, MIN_SAMPLES, sample_pattern
from .face_sight import FaceSight, find_face_sight
from .lidar_points import POINTS_PER_SAMPLE, FacePoints, points_on_faces
from .placement import are_cameras_inside, placement_notices
from .sight import Facing, in_morton_order, meets_front
from .truth import named_viewpoints

__all__ = ["FacePairs", "SurfaceVisibility", "surface_visibility"]

CHUNK_FACES = 1 << 17
"""Number of faces processed at a time; their samples take at most 32 MB."""
INSIDE_OUT_SHARE = 0.9
"""Both sides of faces are used if at least this fraction of the rays hits back sides first."""


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
        """Returns True [n] for the faces of the object with the id `instance`."""
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

    `facing="front"` ignores cameras behind a face, and lidar points on its back; "both" includes them.
    "auto" means "both", with a notice, if at least 90 % of the rays that hit the world hit back sides first;
    otherwise "front". If a notice reports that the mesh is misplaced and the cameras are inside it, "auto"
    means "front". `pairs=True` also returns the visible faces of each camera. A notice is issued if fewer
    than half of the cameras show the world, and if a lidar measures no points. Memory does not grow with the
    number of cameras, except with `pairs`; each point of a lidar takes 13 bytes.

    `images` maps camera names to names of photographs, which the result then contains instead of the cameras' names
    (default: `cameras.images`). `threads` is the number of threads (default: all). Raises `SettingsError` for invalid
    arguments and `WorldError` for unknown objects and worlds without faces.
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
    misplaced = placement_notices(world, lenses)
    warn_all(misplaced)
    points = {
        name: points_on_faces(world, lidar, ids, threads)
        for name, lidar in named.items()
        if isinstance(lidar, Lidar)
    }
    if facing == "auto":
        sides = side_of(world, list(lenses.values()), threads, points.values(), is_misplaced=bool(misplaced))
    else:
        sides = facing
    each = [points[name].of(sides) if name in points else lenses[name] for name in named]
    order = in_morton_order(corners.mean(axis=1))
    found = _Totals(len(ids), each, pairs)
    for start in range(0, len(order), CHUNK_FACES):
        faces = order[start : start + CHUNK_FACES]
        found.add(world, faces, corners[faces], count, sides, threads)
    return found.result(ids, tuple(named), sides)


def side_of(
    world: World,
    cameras: Sequence[Camera],
    threads: int | None = None,
    lidars: Iterable[FacePoints] = (),
    *,
    is_misplaced: bool = False,
) -> Literal["front", "both"]:
    """Returns "both" if nearly all rays that hit the world hit back sides first, else "front".

    The limit is 90 %; a notice reports the result "both". If a notice has already reported that the mesh is
    misplaced and the cameras are inside it (`is_misplaced`), the result is "front". Each lidar contributes
    about as many points as a camera has rays, or all of its points if it has fewer.
    """
    hits = [meets_front(world, camera, pixel_grid(camera), threads) for camera in cameras]
    hits += [one.front[:: max(1, len(one.front) // GRID_SIDE**2)] for one in lidars]
    fronts = np.concatenate(hits) if hits else np.zeros(0, bool)
    if len(fronts) == 0 or fronts.mean() > 1 - INSIDE_OUT_SHARE:
        return "front"
    if is_misplaced and are_cameras_inside(world, cameras):
        return "front"
    message = (
        f"{100 * (1 - fronts.mean()):.0f} % of the rays hit the backs of faces, so the mesh seems to be inside out or "
        'mirrored; both sides are treated as visible (facing="both"); flip the faces to correct the mesh'
    )
    warn(Notice(message, "inside_out_mesh"))
    return "both"


class _Totals:
    """Values of all faces, filled chunk by chunk."""

    def __init__(self, faces: int, viewpoints: Sequence[Camera | FacePoints], pairs: bool) -> None:
        self.cameras = {i: one for i, one in enumerate(viewpoints) if isinstance(one, Camera)}
        self.lidars = {i: one for i, one in enumerate(viewpoints) if isinstance(one, FacePoints)}
        self.views = np.zeros(faces, np.int32)
        self.fraction = np.zeros(faces, np.float32)
        self.best_view = np.full(faces, -1, np.int32)
        self.best_resolution = np.zeros(faces, np.float32)
        self.angle = np.full(faces, np.nan, np.float32)
        self.faces_seen = np.zeros(len(viewpoints), np.int32)
        self.entries: list[tuple[npt.NDArray[np.int64], npt.NDArray[np.int32], npt.NDArray[np.float32]]] = []
        self.pairs = pairs

    def add(
        self,
        world: World,
        faces: npt.NDArray[np.int64],
        corners: Floats,
        count: int | None,
        facing: Facing,
        threads: int | None,
    ) -> None:
        """Adds the faces [k] with their corners [k, 3, 3].

        A face has `count` samples; if `count` is None, its number of samples depends on its size.
        """
        numbers = np.full(len(faces), MIN_SAMPLES if count is None else count)
        if count is None:
            for points in self.lidars.values():
                numbers = np.maximum(numbers, -(-points.counts(faces) // POINTS_PER_SAMPLE))
        pattern = sample_pattern(MAX_SAMPLES) if count is None else sample_pattern(count, corners=False)
        sight = find_face_sight(
            world,
            list(self.cameras.values()),
            corners,
            np.minimum(numbers, len(pattern)).astype(np.uint16),
            pattern,
            facing=facing,
            pairs=self.pairs,
            threads=threads,
        )
        seen, first = sight.is_shown, np.cumsum(sight.samples) - sight.samples
        self._add_cameras(faces, sight)
        for number, points in self.lidars.items():
            seen[self._add_points(number, points, faces, corners, (first, sight.samples, pattern))] = True
        self.fraction[faces] = np.add.reduceat(seen, first, dtype=np.int64) / sight.samples

    def _add_cameras(self, faces: npt.NDArray[np.int64], sight: FaceSight) -> None:
        """Adds faces [k] that cameras show."""
        cameras = np.fromiter(self.cameras, np.int32)
        self.views[faces] = sight.views
        self.faces_seen[cameras] += sight.faces_shown
        some = np.flatnonzero(sight.views)
        self.best_view[faces[some]] = cameras[sight.best_view[some]]
        self.best_resolution[faces] = sight.best_resolution
        self.angle[faces] = degrees_of(sight.best_cosine)
        if self.pairs:
            face, camera, number = sight.pairs.T
            self._add_pairs(faces[face], cameras[camera], number / sight.samples[face])

    def _add_points(
        self,
        number: int,
        points: FacePoints,
        faces: npt.NDArray[np.int64],
        corners: Floats,
        samples: tuple[npt.NDArray[np.int64], npt.NDArray[np.int32], Floats],
    ) -> npt.NDArray[np.int64]:
        """Adds the faces [k] on which a lidar has points.

        Returns the samples [m] nearest to these points. `samples` are the index of each face's first sample [k], the
        number of its samples [k], and the pattern.
        """
        first, total, pattern = samples
        counts = points.counts(faces)
        met = np.flatnonzero(counts)
        nearest = points.nearest_samples(faces[met], corners[met], pattern, first[met], total[met])
        owner = np.searchsorted(first, nearest, side="right") - 1
        hits = np.bincount(owner, minlength=len(faces))
        resolution = np.sqrt(counts[met] / np.maximum(face_areas(corners[met]), 1e-300)).astype(np.float32)
        self.views[faces[met]] += 1
        self.faces_seen[number] += len(met)
        met_faces, cosine = faces[met], points.first_cosine(faces[met])
        best, view = self.best_resolution[met_faces], self.best_view[met_faces]
        better = (resolution > best) | ((resolution == best) & (number < view))
        chosen = met_faces[better]
        self.best_resolution[chosen], self.best_view[chosen] = resolution[better], number
        self.angle[chosen] = degrees_of(cosine[better])
        if self.pairs:
            self._add_pairs(met_faces, np.full(len(met), number, np.int32), hits[met] / total[met])
        return nearest

    def _add_pairs(
        self, faces: npt.NDArray[np.int64], viewpoints: npt.NDArray[np.int32], share: Floats
    ) -> None:
        self.entries.append((faces, viewpoints, share.astype(np.float32)))

    def result(
        self, ids: npt.NDArray[np.int32], names: tuple[str, ...], facing: Literal["front", "both"]
    ) -> SurfaceVisibility:
        """Returns the values as a `SurfaceVisibility`."""
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


def degrees_of(cosine: Floats) -> npt.NDArray[np.float32]:
    """Returns angles [n] in degrees, float32, from their cosines."""
    found: npt.NDArray[np.float32] = np.degrees(acos(np.clip(cosine, 0, 1))).astype(np.float32)
    return found
