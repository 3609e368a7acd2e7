"""Random points on surfaces, or on the parts visible to cameras or lidars."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from ..arguments import Bools, Floats, one_of, thread_count, whole
from ..camera import Camera
from ..errors import WorldError
from ..lidar import Lidar
from ..notices import warn_all
from ..one_line import one_line
from ..world import World
from ..world.chosen import Chosen, object_mask
from ..world.face_geometry import face_areas, face_normals, interpolate
from .lidar_points import FacePoints, points_on_faces
from .placement import placement_notices
from .sight import find_sight
from .truth import named_viewpoints
from .visibility import side_of

__all__ = ["SurfaceSamples", "sample_surface"]

MIN_BATCH = 1 << 12
"""Minimum number of points drawn at a time."""
MAX_BATCH = 1 << 17
"""Maximum number of points drawn at a time."""
MAX_DRAWS = 1 << 22
"""Maximum number of points drawn; an error is raised if fewer visible points than requested were found."""


@one_line
@dataclass(frozen=True, eq=False)
class SurfaceSamples:
    """The result of `sample_surface`: points [n] in random order."""

    points: Floats
    """Positions in the world, float64 [n, 3], metres."""
    normals: Floats
    """Unit normals of the faces, float64 [n, 3]."""
    ids: npt.NDArray[np.int32]
    """(instance, triangle) of the faces, int32 [n, 2]."""


def sample_surface(
    world: World,
    count: int,
    *,
    visible_to: Mapping[str, Camera | Lidar] | Sequence[Camera | Lidar] | None = None,
    objects: Chosen | None = None,
    facing: Literal["auto", "front", "both"] = "auto",
    seed: int = 0,
    threads: int | None = None,
) -> SurfaceSamples:
    """Draws `count` random points on the surface, uniform by area.

    With `visible_to`, posed cameras and lidars as in `surface_visibility`, points are drawn only on the part of the
    surface that is visible to at least one of them. A reconstruction is then compared only with surfaces that the
    photographs show. To be visible to a camera, points must project through the lens into the image, face the camera,
    and have no triangle of the world between them and the camera. A point is visible to a lidar if the face's sample
    nearest to it is visible in `surface_visibility` for this lidar. Such a sample has a point of the lidar's first
    frame near it. `objects` are the ids or names of the objects that have points; all objects occlude. `facing` is as
    in `surface_visibility`. `seed` selects the random points.

    The same arguments give the same points on any number of threads. A notice is issued if fewer than half of the
    cameras show the world, and for a lidar without points. Raises `SettingsError` for invalid arguments, and
    `WorldError` for unknown objects, for a world without area, and if fewer than `count` of 4 million points are
    visible.
    """
    wanted, threads = whole("count", count, 1, MAX_DRAWS), thread_count(threads)
    random = np.random.default_rng(whole("seed", seed, 0, (1 << 63) - 1))
    one_of("facing", facing, ("auto", "front", "both"))
    viewpoints = None if visible_to is None else named_viewpoints(visible_to)
    mask = object_mask(world._core, objects)
    ids, corners = world.triangle_ids(), world.triangles()
    if mask is not None:
        kept = np.flatnonzero(mask[ids[:, 0]])
        ids, corners = ids[kept], corners[kept]
    areas = np.cumsum(face_areas(corners))
    if not len(areas) or not areas[-1] > 0:
        raise WorldError(
            "the world has no surface to sample; sample_surface requires a mesh", code="nothing_visible"
        )
    sights = [] if viewpoints is None else _sights(world, viewpoints, ids, facing, threads)
    found: list[tuple[Floats, npt.NDArray[np.int64]]] = []
    drawn = total = 0
    while total < wanted:
        if drawn >= MAX_DRAWS:
            raise WorldError(
                f"only {total} of {drawn} points on the surface are visible to the cameras and lidars, requested: "
                f"{wanted}; check the poses of the cameras and lidars, or request fewer points",
                code="nothing_visible",
            )
        batch = int(np.clip(2 * (wanted - total), MIN_BATCH, MAX_BATCH))
        face = np.searchsorted(areas, random.random(batch) * areas[-1], side="right")
        weights = _weights(random.random((batch, 2)))
        points = interpolate(weights, corners[face])
        drawn += batch
        if viewpoints is not None:
            seen = np.zeros(batch, bool)
            for sight in sights:
                rest = np.flatnonzero(~seen)
                seen[rest] = sight(face[rest], corners[face[rest]], weights[rest], points[rest])
            points, face = points[seen], face[seen]
        found.append((points, face))
        total += len(face)
    points, face = (np.concatenate(part)[:wanted] for part in zip(*found, strict=True))
    return SurfaceSamples(points, face_normals(corners[face]), ids[face])


def _sights(
    world: World,
    viewpoints: Mapping[str, Camera | Lidar],
    ids: npt.NDArray[np.int32],
    facing: Literal["auto", "front", "both"],
    threads: int | None,
) -> list[Callable[[npt.NDArray[np.int64], Floats, Floats, Floats], Bools]]:
    """Returns for each camera and lidar the function that finds the visible points [n].

    The function's arguments are the points' faces [n], the faces' corners [n, 3, 3], the weights of the corners [n, 3]
    and the positions [n, 3].
    """
    cameras = {name: one for name, one in viewpoints.items() if isinstance(one, Camera)}
    lidars = [
        points_on_faces(world, one, ids, threads) for one in viewpoints.values() if isinstance(one, Lidar)
    ]
    misplaced = placement_notices(world, cameras)
    warn_all(misplaced)
    if facing == "auto":
        side = side_of(world, list(cameras.values()), threads, lidars, is_misplaced=bool(misplaced))
    else:
        side = facing

    def seen_by(camera: Camera) -> Callable[[npt.NDArray[np.int64], Floats, Floats, Floats], Bools]:
        def find(face: npt.NDArray[np.int64], corners: Floats, weights: Floats, points: Floats) -> Bools:
            found = np.zeros(len(face), bool)
            sight = find_sight(world, camera, points, face_normals(corners), facing=side, threads=threads)
            found[sight.index] = True
            return found

        return find

    def measured_by(lidar: FacePoints) -> Callable[[npt.NDArray[np.int64], Floats, Floats, Floats], Bools]:
        own = lidar.of(side)
        return lambda face, corners, weights, points: own.cover(face, corners, weights)

    return [seen_by(camera) for camera in cameras.values()] + [measured_by(lidar) for lidar in lidars]


def _weights(numbers: Floats) -> Floats:
    """Returns barycentric weights [n, 3] for uniform numbers [n, 2].

    Source: Osada et al., Shape distributions, 2002.
    """
    root = np.sqrt(numbers[:, 0])
    return np.stack([1 - root, root * (1 - numbers[:, 1]), root * numbers[:, 1]], axis=1)
