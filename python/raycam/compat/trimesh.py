"""Replacement for `trimesh.ray.ray_pyembree`: exact rays for trimesh meshes.

`RayMeshIntersector` has the same methods, shapes and orders as trimesh's class for Embree. After `install()`, trimesh
uses `RayMeshIntersector` for every new mesh. Each crossing is found exactly once, also at edges and corners, and inside
tests are consistent between calls; overlapping bodies in one mesh count as their union. A point on a surface belongs to
one side: a box contains `low <= p < high`.
"""

from __future__ import annotations

import hashlib
import importlib
import sys
from typing import Any

import numpy as np
import numpy.typing as npt

from raycam import SettingsError, World

__all__ = ["RayMeshIntersector", "closest_point", "install", "signed_distance", "uninstall"]

Ids = npt.NDArray[np.int64]
Floats = npt.NDArray[np.float64]

MERGE_TOLERANCE = 1e-8
"""Distance up to which trimesh treats a point as on the surface (`trimesh.constants.tol.merge`)."""


def __getattr__(name: str) -> Any:
    """Raises an `AttributeError` that names an alternative.

    Only trimesh's names for rays and nearest points are supported.
    """
    raise AttributeError(
        f"{name} of trimesh is not in raycam.compat.trimesh, which supports only rays and nearest points; "
        "keep meshes in trimesh, or load them with raycam.load(path)"
    )


class RayMeshIntersector:
    """Ray queries for one mesh, which is any object with `vertices` [n, 3] and `faces` [m, 3].

    The mesh may change; the world is rebuilt if the hash of the mesh has changed. `scale_to_box` is accepted and has no
    effect.
    """

    def __init__(self, geometry: Any, scale_to_box: bool = True) -> None:
        self.mesh = geometry
        self._scale_to_box = scale_to_box
        self._built: tuple[object, World] | None = None

    @property
    def world(self) -> World:
        """The world with the current mesh; its only object, 0, has the mesh's faces in order."""
        key = _hash_of(self.mesh)
        if self._built is None or self._built[0] != key:
            self._built = (key, _world_of(self.mesh))
        return self._built[1]

    def intersects_location(
        self, ray_origins: npt.ArrayLike, ray_directions: npt.ArrayLike, multiple_hits: bool = True
    ) -> tuple[Floats, Ids, Ids]:
        """Returns the hits of rays [n, 3]: locations [m, 3], ray int64 [m], and triangle int64 [m].

        `multiple_hits` and the order of the hits are as in `intersects_id`.
        """
        triangle, ray, location = self.intersects_id(
            ray_origins, ray_directions, multiple_hits=multiple_hits, return_locations=True, max_hits=None
        )
        return location, ray, triangle

    def intersects_id(
        self,
        ray_origins: npt.ArrayLike,
        ray_directions: npt.ArrayLike,
        multiple_hits: bool = True,
        max_hits: int | None = 100,
        return_locations: bool = False,
    ) -> Any:
        """Returns the hits of rays [n, 3]: triangle int64 [m] and ray int64 [m].

        With `return_locations`, the locations [m, 3] of the hits are also returned. The first hits of all rays are
        returned in the order of the rays, followed by all second hits, and so on. With `multiple_hits`, hits are
        crossings (`World.intersections`), at most `max_hits` per ray. Without `multiple_hits`, a hit is the first
        triangle including its edges (`World.cast_rays`), also at the border of an open mesh.
        """
        origins, directions = _rays(ray_origins, ray_directions)
        fields = ["triangle", "position"] if return_locations else ["triangle"]
        if multiple_hits:
            found = self.world.intersections(origins, directions, max_hits=max_hits, fields=fields)
            rank = np.arange(len(found["ray"])) - found["offsets"][found["ray"]]
            order = np.argsort(rank, kind="stable")
            ray = found["ray"][order]
        else:
            found = self.world.cast_rays(origins, directions, fields=fields)
            order = ray = np.flatnonzero(found["triangle"] >= 0)
        triangle = found["triangle"][order].astype(np.int64)
        if return_locations:
            return triangle, ray, found["position"][order]
        return triangle, ray

    def intersects_first(self, ray_origins: npt.ArrayLike, ray_directions: npt.ArrayLike) -> Ids:
        """Returns the first triangle that each ray hits, int64 [n]; -1 for a miss."""
        hits = self.world.cast_rays(*_rays(ray_origins, ray_directions), fields=["triangle"])
        return hits["triangle"].astype(np.int64)

    def intersects_any(
        self, ray_origins: npt.ArrayLike, ray_directions: npt.ArrayLike
    ) -> npt.NDArray[np.bool_]:
        """Returns True [n] for rays that hit the mesh."""
        return self.world.occluded(*_rays(ray_origins, ray_directions))

    def contains_points(self, points: npt.ArrayLike) -> npt.NDArray[np.bool_]:
        """Returns True [n] for points [n, 3] inside the mesh, by the rules of `World.inside`."""
        return self.world.inside(_points(points))

    def __getstate__(self) -> dict[str, Any]:
        """The mesh, without acceleration structures."""
        return {"mesh": self.mesh, "_scale_to_box": self._scale_to_box, "_built": None}

    def __copy__(self, *_: object) -> RayMeshIntersector:
        """Returns queries of the same mesh."""
        return type(self)(self.mesh, self._scale_to_box)

    def __deepcopy__(self, *_: object) -> RayMeshIntersector:
        """Returns queries of the same mesh; `Trimesh.copy` creates new queries for the copied mesh."""
        return self.__copy__()


def closest_point(mesh: Any, points: npt.ArrayLike) -> tuple[Floats, Floats, Ids]:
    """Returns the closest points of a mesh to `points` [n, 3].

    The arrays are positions [n, 3], distances [n], and triangles int64 [n]. If several triangles are at the
    same distance, the triangle that faces the point most directly is returned, as in
    `trimesh.proximity.closest_point`.
    """
    queries = _points(points)
    found = _world_for(mesh).closest_points(queries)
    position, distance = np.array(found["position"]), np.array(found["distance"])
    triangle = found["triangle"].astype(np.int64)
    corners = np.asarray(mesh.triangles, np.float64)
    if len(corners) and len(triangle):
        _choose_facing(corners, queries, position, distance, triangle)
    return position, distance, triangle


def _choose_facing(
    corners: Floats, queries: Floats, position: Floats, distance: Floats, triangle: Ids
) -> None:
    """Among triangles at equal distance, selects the triangle that faces the query point most.

    Considers the triangles that share a vertex with the closest triangle. Distances are equal for the same closest
    point, or if their squares differ by less than trimesh's tolerance. Writes into the last three arrays.
    """
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    normals = normals / np.where(lengths > 0, lengths, 1)
    away = queries - position
    # A triangle that faces its query point exactly (cosine 1) is the best, so it is not compared with other triangles.
    facing = np.einsum("ni,ni->n", normals[triangle], away)
    doubtful = np.flatnonzero(facing < distance * (1 - 1e-12))
    query, candidate = _triangles_around(corners, triangle[doubtful])
    query = doubtful[query]
    # A triangle cannot be closer than its plane, so triangles with a distant plane are skipped.
    plane = np.abs(np.einsum("ni,ni->n", normals[candidate], queries[query] - corners[candidate, 0]))
    near = plane <= distance[query] + np.sqrt(MERGE_TOLERANCE)
    query, candidate = query[near], candidate[near]
    closest_point_of = importlib.import_module("trimesh.triangles").closest_point
    place = closest_point_of(corners[candidate], queries[query]) if len(query) else np.zeros((0, 3))
    towards = queries[query] - place
    squared = np.einsum("ni,ni->n", towards, towards)
    least = distance[query] ** 2
    same = np.linalg.norm(place - position[query], axis=1) <= 1e-9 * np.ptp(corners)
    close = (np.abs(squared - least) < MERGE_TOLERANCE) & (np.minimum(squared, least) > MERGE_TOLERANCE)
    is_tied = same | close
    query, candidate, place, same = query[is_tied], candidate[is_tied], place[is_tied], same[is_tied]
    towards, squared = towards[is_tied], squared[is_tied]
    lengths = np.sqrt(np.where(squared > 0, squared, 1))
    facing = np.einsum("ni,ni->n", normals[candidate], towards) / lengths
    # The triangle with the largest cosine comes first; of equal cosines, the triangle that was found first.
    is_found = candidate == triangle[query]
    order = np.lexsort((candidate, ~is_found, -np.round(facing, 12), query))
    first = order[np.unique(query[order], return_index=True)[1]]
    triangle[query[first]] = candidate[first]
    moved = first[~same[first]]
    position[query[moved]], distance[query[moved]] = place[moved], np.sqrt(squared[moved])


def _triangles_around(corners: Floats, triangles: Ids) -> tuple[Ids, Ids]:
    """Returns all pairs of an index into `triangles` and a nearby triangle.

    The nearby triangle equals the indexed triangle, or shares a vertex with that triangle.
    """
    _, vertex = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    vertex = vertex.reshape(-1, 3)
    by_vertex = np.argsort(vertex.ravel(), kind="stable")
    counts = np.bincount(vertex.ravel())
    starts = np.cumsum(counts) - counts
    chosen = vertex[triangles].ravel()
    count = counts[chosen]
    within = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
    place = np.repeat(np.repeat(np.arange(len(triangles)), 3), count)
    neighbour = by_vertex[np.repeat(starts[chosen], count) + within] // 3
    pairs = np.unique(place * len(corners) + neighbour)
    return pairs // len(corners), pairs % len(corners)


def signed_distance(mesh: Any, points: npt.ArrayLike) -> Floats:
    """Returns distances [n] of `points` [n, 3] from a mesh, **positive inside**.

    The sign is the same as in `trimesh.proximity.signed_distance`.
    """
    distance = _world_for(mesh).signed_distance(_points(points))
    return np.where(np.abs(distance) <= MERGE_TOLERANCE, np.abs(distance), -distance)


_originals: dict[str, Any] = {}


def install(nearest: bool = False) -> None:
    """Makes trimesh use raycam for the rays of every mesh created from now on.

    These meshes include copies and submeshes. `trimesh.ray.ray_pyembree` is replaced by this module. Meshes
    created with `use_embree=False` keep trimesh's NumPy engine. With `nearest`,
    `trimesh.proximity.closest_point` and `signed_distance`, which `mesh.nearest` calls, are also replaced.
    """
    ray = importlib.import_module("trimesh.ray")
    if not _originals:
        _originals.update(
            ray_pyembree=ray.ray_pyembree,
            has_embree=ray.has_embree,
            module=sys.modules.get("trimesh.ray.ray_pyembree"),
        )
    this = sys.modules[__name__]
    vars(ray).update(ray_pyembree=this, has_embree=True)
    sys.modules["trimesh.ray.ray_pyembree"] = this
    if nearest:
        proximity = importlib.import_module("trimesh.proximity")
        if "closest_point" not in _originals:
            _originals.update(
                closest_point=proximity.closest_point, signed_distance=proximity.signed_distance
            )
        vars(proximity).update(closest_point=closest_point, signed_distance=signed_distance)


def uninstall() -> None:
    """Undoes `install`; meshes created in the meantime keep their `mesh.ray`."""
    if not _originals:
        return
    ray = importlib.import_module("trimesh.ray")
    vars(ray).update(ray_pyembree=_originals["ray_pyembree"], has_embree=_originals["has_embree"])
    if _originals["module"] is None:
        del sys.modules["trimesh.ray.ray_pyembree"]
    else:
        sys.modules["trimesh.ray.ray_pyembree"] = _originals["module"]
    if "closest_point" in _originals:
        proximity = importlib.import_module("trimesh.proximity")
        names = ("closest_point", "signed_distance")
        vars(proximity).update({name: _originals[name] for name in names})
    _originals.clear()


def _world_for(mesh: Any) -> World:
    """Returns the world of `mesh.ray` if raycam created `mesh.ray`, otherwise a new world."""
    ray = getattr(mesh, "ray", None)
    return (ray if isinstance(ray, RayMeshIntersector) else RayMeshIntersector(mesh)).world


def _world_of(mesh: Any) -> World:
    world = World()
    faces = np.asarray(mesh.faces)
    if len(faces):
        world.add_mesh(np.asarray(mesh.vertices, dtype=np.float64), faces)
    return world


def _hash_of(mesh: Any) -> object:
    """The mesh's own hash of its data (trimesh), or a hash of its arrays."""
    own = type(mesh).__hash__
    if own is not None and own is not object.__hash__:  # type: ignore[comparison-overlap]
        return hash(mesh)
    digest = hashlib.blake2b(np.ascontiguousarray(mesh.vertices, dtype=np.float64).tobytes())
    digest.update(np.ascontiguousarray(mesh.faces, dtype=np.int64).tobytes())
    return digest.digest()


def _rays(origins: npt.ArrayLike, directions: npt.ArrayLike) -> tuple[Floats, Floats]:
    pair = [np.array(values, dtype=np.float64) for values in (origins, directions)]
    if pair[0].shape != pair[1].shape or pair[0].ndim != 2 or pair[0].shape[1] != 3:
        raise SettingsError(
            f"ray_origins {list(pair[0].shape)} and ray_directions {list(pair[1].shape)} must both be [n, 3]",
            code="wrong_shape",
        )
    return pair[0], pair[1]


def _points(points: npt.ArrayLike) -> Floats:
    array = np.asarray(points, dtype=np.float64)
    if array.ndim != 2 or array.shape[1] != 3:
        raise SettingsError(f"points must be [n, 3], not {list(array.shape)}", code="wrong_shape")
    return array
