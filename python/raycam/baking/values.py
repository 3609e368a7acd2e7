"""Values of maps at points of an object."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from ..arguments import Bools, Floats, inverse_3x3, product
from ..world import World
from ..world.face_geometry import face_normals
from ..world.object_mesh import ObjectMesh
from .curvature import corner_curvatures
from .hemisphere import Hemispheres
from .light import LIGHT_MAPS, light_values
from .settings import BakeSettings
from .surface_points import MATERIAL_MAPS, SurfacePoints, material_numbers, transfer
from .tangents import corner_tangents, tangent_space_normals

__all__ = ["BakedObject", "FacePoints", "unit_vectors"]

RELATIVE_ROUNDING = 8 * float(np.finfo(np.float64).eps)
"""Rounding error of a surface point relative to its largest coordinate; rays start at this distance."""
BLOCK_RAYS = 1 << 16
"""Number of rays that are traced at a time, about 10 MB."""


@dataclass(frozen=True, eq=False)
class FacePoints:
    """Points [n] on the faces of a mesh."""

    face: npt.NDArray[np.int32]
    """Index of the face of each point [n]."""
    weights: Floats
    """Weights of the faces' corners [n, 3]."""
    key: npt.NDArray[np.int64]
    """For each point, a number that selects its random numbers for occlusion rays [n]."""
    pixel: npt.NDArray[np.int32]
    """For each point, a (column, row) that selects its random numbers for light paths [n, 2]."""


class BakedObject:
    """An object whose maps are baked, its world, and the detailed source (None if not used)."""

    def __init__(
        self,
        world: World,
        mesh: ObjectMesh,
        uvs: npt.NDArray[np.float32] | None,
        source: World | None,
        settings: BakeSettings,
    ) -> None:
        self.world, self.mesh, self.source, self.settings = world, mesh, source, settings
        self.tangents: Floats | None = None
        self._curvatures: dict[int, Floats] = {}
        if "tangent_normal" in settings.maps:
            assert uvs is not None
            matrix = world.objects[settings.number].matrix
            local = product(mesh.corners - matrix[:3, 3], inverse_3x3(matrix[:3, :3]).T)
            normals = _corner_normals(mesh, matrix[:3, :3])
            self.tangents = corner_tangents(local, normals, uvs.astype(np.float64))

    def values(self, at: FacePoints) -> tuple[dict[str, npt.NDArray[Any]], Bools]:
        """Returns the points' values by map, and True [n] for points that missed the source.

        For each map of light, NAME_error contains the standard error of the luminance.
        """
        settings = self.settings
        own = self._own_points(at)
        points = own
        if self.source is not None:
            materials = [name for name in settings.maps if name in MATERIAL_MAPS]
            points = transfer(own, self.source, settings.cage, materials, settings.threads)
        values: dict[str, npt.NDArray[Any]] = {
            "position": points.position,
            "normal": points.normal,
            "shading_normal": points.shading_normal,
            "triangle": at.face,
            "instance": np.full(len(at.face), settings.number),
            **points.materials,
        }
        if "material" in settings.maps:
            values["material"] = material_numbers(own, settings.threads)
        if "curvature" in settings.maps:
            values["curvature"] = self._curvature(points)
        if self.tangents is not None:
            values["tangent_normal"] = self._tangent_normals(at, own, points)
        for name in LIGHT_MAPS:
            if name in settings.maps:
                light, error = light_values(
                    name, points, at.pixel, settings.samples, settings.max_depth, settings.threads
                )
                values |= {name: light, f"{name}_error": error}
        values |= _occlusion(points, at.key, settings)
        return values, points.missed

    def _own_points(self, at: FacePoints) -> SurfacePoints:
        """Returns the points `at` as points of the object's own surface."""
        mesh, number = self.mesh, self.settings.number
        corners = mesh.corners[at.face]
        normal = face_normals(corners)
        shading = normal
        if mesh.normals is not None:
            linear = inverse_3x3(self.world.objects[number].matrix[:3, :3]).T
            interpolated = np.einsum("nk,nkj->nj", at.weights, mesh.normals[at.face].astype(np.float64))
            shading = unit_vectors(product(interpolated, linear.T), normal)
        position = np.einsum("nk,nkj->nj", at.weights, corners)
        instance = np.full(len(at.face), number, np.int32)
        missed = np.zeros(len(at.face), bool)
        return SurfacePoints(
            self.world, position, normal, shading, instance, at.face.astype(np.int32), at.weights, missed
        )

    def _tangent_normals(self, at: FacePoints, own: SurfacePoints, points: SurfacePoints) -> Floats:
        """Shading normals in the object's tangent space [n, 3]."""
        assert self.tangents is not None
        # glTF's tangents belong to the mesh's frame; the transpose of `linear` transforms normals to this frame.
        linear = self.world.objects[self.settings.number].matrix[:3, :3]
        normals = np.einsum("nk,nkj->nj", at.weights, _corner_normals(self.mesh, linear)[at.face])
        shading = unit_vectors(normals, product(own.normal, linear))
        tangents = self.tangents[at.face]
        along = np.einsum("nk,nkj->nj", at.weights, tangents[..., :3])
        detailed = unit_vectors(product(points.shading_normal, linear), shading)
        found = tangent_space_normals(detailed, shading, along, tangents[:, 0, 3])
        if self.settings.green_down:
            found = found * [1, -1, 1]
        return found

    def _curvature(self, points: SurfacePoints) -> Floats:
        """Returns the mean curvatures [n]; 0 for points without a surface.

        The curvatures are interpolated between the vertices.
        """
        found = np.zeros(len(points.instance))
        for number in np.unique(points.instance[points.instance >= 0]).tolist():
            if number not in self._curvatures:
                self._curvatures[number] = corner_curvatures(points.world.triangles(number))
            some = points.instance == number
            at_corners = self._curvatures[number][points.triangle[some]]
            found[some] = (at_corners * points.barycentric[some]).sum(axis=1)
        return found


def _corner_normals(mesh: ObjectMesh, linear: Floats) -> Floats:
    """Returns the shading normals [f, 3, 3] of the corners in the mesh's frame.

    `linear` [3, 3] is the mesh's transform.
    """
    if mesh.normals is not None:
        return mesh.normals.astype(np.float64)
    normals = face_normals(mesh.corners)
    return np.repeat(unit_vectors(product(normals, linear), normals)[:, None], 3, axis=1)


def unit_vectors(vectors: Floats, default: Floats) -> Floats:
    """Returns vectors [n, 3] of length 1; vectors of length 0 become `default`."""
    length = np.sqrt((vectors**2).sum(axis=1, keepdims=True))
    found: Floats = np.where(length > 0, vectors / np.where(length > 0, length, 1), default)
    return found


def _occlusion(
    points: SurfacePoints, keys: npt.NDArray[np.int64], settings: BakeSettings
) -> dict[str, npt.NDArray[Any]]:
    """The maps that need rays: occlusion, bent normals and thickness.

    All rays of a point follow each other, because rays with a common origin are traced together.
    """
    names, samples, reach = settings.maps, settings.samples, settings.reach
    position, normal, count = points.position, points.normal, len(points.position)
    # Rays start at a small distance, because the neighbouring face of a texel on an edge is not an occluder.
    start = RELATIVE_ROUNDING * float(np.abs(position).max(initial=0.0))
    values: dict[str, npt.NDArray[Any]] = {}
    step = max(1, BLOCK_RAYS // samples)
    parts = [slice(first, first + step) for first in range(0, count, step)]

    def rays(part: slice) -> dict[str, Any]:
        """The other arguments of queries for the rays of a part."""
        skip = (points.instance[part, None], points.triangle[part, None])
        return {"t_min": start, "t_max": reach, "skip": skip, "threads": settings.threads}

    if "ao" in names or "bent_normal" in names:
        free, bent = np.zeros(count), np.zeros((count, 3))
        hemispheres = Hemispheres(normal, keys, samples)
        for part in parts:
            directions = hemispheres.directions(part)
            clear = ~points.world.occluded(position[part, None], directions, **rays(part))
            free[part] = np.count_nonzero(clear, axis=1)
            if "bent_normal" in names:
                bent[part] = np.where(clear[..., None], directions, 0.0).sum(axis=1)
        if "ao" in names:
            values["ao"] = free / samples
        if "bent_normal" in names:
            values["bent_normal"] = unit_vectors(bent, normal)
    if "thickness" in names:
        total, hits = np.zeros(count), np.zeros(count)
        hemispheres = Hemispheres(-normal, keys, samples, settings.cone)
        for part in parts:
            directions = hemispheres.directions(part)
            t = points.world.cast_rays(position[part, None], directions, fields=("t",), **rays(part))["t"]
            hit = np.isfinite(t)
            total[part] = np.where(hit, t, reach if np.isfinite(reach) else 0.0).sum(axis=1)
            hits[part] = np.count_nonzero(hit | np.isfinite(reach), axis=1)
        values["thickness"] = total / np.maximum(hits, 1)
    return values
