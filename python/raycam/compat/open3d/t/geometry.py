"""`RaycastingScene` and its tensor mesh."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from raycam import World, WorldError

from ..absent import Hints, raise_missing
from ..arguments import RaycastingError, last, looking, matrix, pixel_count, rows, thread_count
from ..core import Device, Tensor
from .mesh import TriangleMesh

__all__ = ["RaycastingError", "RaycastingScene", "TriangleMesh"]

Array = npt.NDArray[Any]
INVALID_ID = 4294967295
HIT_FIELDS = ("t", "instance", "triangle", "barycentric", "normal", "front")
"""The fields of `World.cast_rays` from which the results of Open3D's method are computed."""


class RaycastingScene(Hints):
    """Ray casting and distance queries of triangle meshes, with the methods of Open3D's class.

    Accepts NumPy arrays and tensors of any float and integer dtype; returns float32 and uint32. For a miss, t_hit is
    inf and ids are `INVALID_ID`. `device` must be the CPU. `nthreads` of the methods is the number of threads (0: as
    in the constructor, where 0 means all).
    """

    INVALID_ID: ClassVar[int] = INVALID_ID
    _ALTERNATIVE = "use raycam.World, which has cast_rays, closest_points and inside"

    def __init__(self, nthreads: int = 0, device: Any = None) -> None:
        if device is not None:
            Device(str(device))
        self._threads = thread_count(nthreads)
        self._world = World()
        self._geometries = 0
        # Ids of the objects; the last entry is for misses.
        self._geometry_ids = np.array([INVALID_ID], dtype=np.uint32)

    @staticmethod
    def _tensor(array: Array) -> Any:
        return array.view(Tensor)

    def add_triangles(self, *arguments: Any, **keys: Any) -> int:
        """Adds `(vertex_positions, triangle_indices)` or `(mesh)`; returns the geometry's id.

        Ids start at 0. Positions [n, 3] may have any numeric dtype, indices [m, 3] any integer dtype. Raises
        `RaycastingError` for other types.
        """
        names = ("mesh",) if len(arguments) == 1 else ("vertex_positions", "triangle_indices")
        given = dict(zip(names, arguments, strict=False)) | keys
        if len(arguments) > 2 or given.keys() not in ({"mesh"}, {"vertex_positions", "triangle_indices"}):
            raise TypeError("add_triangles expects vertex_positions and triangle_indices, or a tensor mesh")
        mesh = given.get("mesh")
        if mesh is not None and not hasattr(mesh, "vertex"):
            raise TypeError("add_triangles expects a tensor mesh; use TriangleMesh.from_legacy(mesh)")
        if mesh is not None and not ("positions" in mesh.vertex and "indices" in mesh.triangle):
            raise RaycastingError('the mesh has no vertex["positions"] or no triangle["indices"]')
        positions = mesh.vertex["positions"] if mesh is not None else given["vertex_positions"]
        indices = mesh.triangle["indices"] if mesh is not None else given["triangle_indices"]
        places = rows("vertex_positions", positions, "fiu").astype(np.float64)
        faces = rows("triangle_indices", indices, "iu").astype(np.int64)
        if len(faces):
            try:
                self._world.add_mesh(places, faces)
            except WorldError as fault:
                raise RaycastingError(f"add_triangles: {fault}") from None
            self._geometry_ids = np.insert(self._geometry_ids, -1, self._geometries)
        self._geometries += 1
        return self._geometries - 1

    def cast_rays(self, rays: Any, nthreads: int = 0) -> dict[str, Any]:
        """Returns the first hits of rays [..., 6] as a dict of arrays.

        The keys are t_hit, geometry_ids, primitive_ids, primitive_uvs and primitive_normals. `primitive_uvs` are the
        weights of the second and third corner; `primitive_normals` are unit vectors on the side from which the corners
        are counter-clockwise.
        """
        hits = self._world.cast_rays(*_rays(rays), fields=HIT_FIELDS, threads=self._some(nthreads))
        found = self._ids(hits)
        found["t_hit"] = self._single(hits["t"])
        normals = hits["normal"]
        if not np.logical_and.reduce(hits["front"], axis=None):
            normals = normals * np.where(hits["front"], 1.0, -1.0)[..., None]
        found["primitive_normals"] = self._single(normals + 0.0)
        return found

    def test_occlusions(self, rays: Any, tnear: float = 0.0, tfar: float = np.inf, nthreads: int = 0) -> Any:
        """Returns True for rays [..., 6] with any hit at tnear <= t <= tfar."""
        found = self._world.occluded(*_rays(rays), tfar, t_min=tnear, threads=self._some(nthreads))
        return self._tensor(np.asarray(found))

    def count_intersections(self, rays: Any, nthreads: int = 0) -> Any:
        """Returns the number of crossings of rays [..., 6], int32."""
        counts = self._world.count_intersections(*_rays(rays), threads=self._some(nthreads))
        return self._tensor(np.asarray(counts))

    def list_intersections(self, rays: Any, nthreads: int = 0) -> dict[str, Any]:
        """Returns all crossings of rays [..., 6] as a dict of arrays, sorted by ray and t.

        `ray_ids`, `t_hit`, `geometry_ids`, `primitive_ids` and `primitive_uvs` have one row for each crossing. The
        crossings of ray i are the rows `ray_splits[i]:ray_splits[i + 1]`; `ray_splits` is uint32 [rays + 1].
        """
        fields = ["t", "instance", "triangle", "barycentric"]
        hits = self._world.intersections(*_rays(rays), fields=fields, threads=self._some(nthreads))
        return self._ids(hits) | {
            "t_hit": self._single(hits["t"]),
            "ray_splits": self._tensor(hits["offsets"].astype(np.uint32)),
            "ray_ids": self._tensor(hits["ray"].astype(np.uint32)),
        }

    def compute_closest_points(self, query_points: Any, nthreads: int = 0) -> dict[str, Any]:
        """Returns the surface points closest to the query points [..., 3], as a dict of arrays.

        The keys are points, geometry_ids, primitive_ids, primitive_uvs and primitive_normals.
        """
        found = self._world.closest_points(
            last("query_points", query_points, 3), threads=self._some(nthreads)
        )
        return self._ids(found) | {
            "points": self._single(found["position"]),
            "primitive_normals": self._single(found["normal"]),
        }

    def compute_distance(self, query_points: Any, nthreads: int = 0) -> Any:
        """Returns distances of points [..., 3], float32."""
        points = last("query_points", query_points, 3)
        return self._single(self._world.distance(points, threads=self._some(nthreads)))

    def compute_signed_distance(self, query_points: Any, nthreads: int = 0, nsamples: int = 1) -> Any:
        """Returns distances of points [..., 3], float32, negative inside.

        `nsamples` must be odd and has no other effect.
        """
        _odd(nsamples)
        points = last("query_points", query_points, 3)
        return self._single(self._world.signed_distance(points, threads=self._some(nthreads)))

    def compute_occupancy(self, query_points: Any, nthreads: int = 0, nsamples: int = 1) -> Any:
        """Returns 1. for points [..., 3] inside and 0. for points outside, float32.

        `nsamples` must be odd and has no other effect.
        """
        _odd(nsamples)
        points = last("query_points", query_points, 3)
        return self._single(self._world.inside(points, threads=self._some(nthreads)))

    @classmethod
    def create_rays_pinhole(cls, *arguments: Any, **keys: Any) -> Any:
        """Returns the rays of a pinhole camera, float32 [height, width, 6].

        Rays pass through the pixel centres at +0.5. Their directions have z = 1 in camera coordinates.

        `(intrinsic_matrix, extrinsic_matrix, width_px, height_px)`: the extrinsic matrix is world-to-camera, x right,
        y down, z forward. `(fov_deg, center, eye, up, width_px, height_px)`: the angle is horizontal, and image rows
        increase **along** `up`, as in Open3D; pass `up=[0, -1, 0]` for upright images of a y-up world.
        """
        names: tuple[str, ...] = ("intrinsic_matrix", "extrinsic_matrix", "width_px", "height_px")
        if len(arguments) == 6 or "fov_deg" in keys:
            names = ("fov_deg", "center", "eye", "up", "width_px", "height_px")
        given = dict(zip(names, arguments, strict=False)) | keys
        if given.keys() != set(names):
            raise TypeError(f"create_rays_pinhole expects {', '.join(names)}")
        width, height = (pixel_count(name, given[name]) for name in ("width_px", "height_px"))
        if "fov_deg" in given:
            intrinsic, rotation, eye = looking(given, width, height)
        else:
            intrinsic = matrix("intrinsic_matrix", given["intrinsic_matrix"], 3)
            extrinsic = matrix("extrinsic_matrix", given["extrinsic_matrix"], 4)
            rotation = extrinsic[:3, :3]
            eye = -np.linalg.solve(rotation, extrinsic[:3, 3])
        u, v = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
        pixels = np.stack([u, v, np.ones_like(u)], axis=-1)
        directions = pixels @ np.linalg.inv(rotation).dot(np.linalg.inv(intrinsic)).T
        rays = np.concatenate([np.broadcast_to(eye, directions.shape), directions], axis=-1)
        return cls._tensor(rays.astype(np.float32))

    def _some(self, nthreads: int) -> int | None:
        """Returns the number of threads for Open3D's `nthreads`; None for all threads."""
        return thread_count(nthreads) or self._threads or None

    def _single(self, values: Array) -> Any:
        return self._tensor(values.astype(np.float32))

    def _ids(self, hits: dict[str, Array]) -> dict[str, Any]:
        """Returns the ids and barycentric weights of hits, by Open3D's names."""
        return {
            "geometry_ids": self._tensor(self._geometry_ids.take(hits["instance"], mode="wrap")),
            "primitive_ids": self._tensor(hits["triangle"].astype(np.uint32)),
            "primitive_uvs": self._single(hits["barycentric"][..., 1:]),
        }


def _rays(rays: Any) -> tuple[Array, Array]:
    array = last("rays", rays, 6)
    return array[..., :3], array[..., 3:]


def _odd(nsamples: int) -> None:
    if int(nsamples) < 1 or int(nsamples) % 2 == 0:
        raise RaycastingError(f"nsamples is {nsamples}, expected an odd number of at least 1")


def __getattr__(name: str) -> Any:
    """Raises an `AttributeError` that names an alternative."""
    return raise_missing("open3d.t.geometry", name, "install Open3D, or use trimesh")
