"""Surface points of texels, on the baked object or on a detailed source around it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from ..arguments import Bools, Floats
from ..world import World

__all__ = ["MATERIAL_MAPS", "SurfacePoints", "material_numbers", "transfer"]

MATERIAL_MAPS = ("albedo", "roughness", "metallic", "emission")
"""Maps of material properties, which equal fields of ray hits."""
MAX_ROUNDING = 64 * float(np.finfo(np.float64).eps)
"""Upper bound on a point's rounding error, relative to the point's largest coordinate."""
OVERLAP = 1e-4
"""Offset of the search rays' starts from the texel's point, relative to the cage. The inward ray starts a little
outside of the point and the outward ray a little inside, so that a source surface exactly at the point is found."""


@dataclass(frozen=True, eq=False)
class SurfacePoints:
    """Points [n] of a world's surface."""

    world: World
    """The world that contains the points; its objects occlude them."""
    position: Floats
    """Positions in the world [n, 3], metres."""
    normal: Floats
    """Unit normals of the faces [n, 3], outwards."""
    shading_normal: Floats
    """Interpolated unit normals [n, 3], outwards."""
    instance: npt.NDArray[np.int32]
    """Ids of the objects [n]."""
    triangle: npt.NDArray[np.int32]
    """Indices of the faces in their objects [n]."""
    barycentric: Floats
    """Weights of the faces' corners [n, 3]."""
    missed: Bools
    """True [n] for points without a counterpart on the source; these points have the baked object's values."""
    materials: dict[str, npt.NDArray[np.float32]] = field(default_factory=dict)
    """Material properties [n, ...] by the names in `MATERIAL_MAPS`."""


def transfer(
    points: SurfacePoints, source: World, cage: float, materials: list[str], threads: int | None
) -> SurfacePoints:
    """Returns the nearest points of `source` along the shading normals.

    These points are at most `cage` metres outwards or inwards. Surfaces that face inwards, such as the other side of a
    thin wall, are ignored. `materials` are the names of material maps to look up.
    """
    normal, skip = points.shading_normal, OVERLAP * cage
    fields = (
        *("t", "instance", "triangle", "barycentric", "position", "normal", "shading_normal"),
        *materials,
    )
    hits: list[dict[str, npt.NDArray[Any]]] = []
    sides: tuple[tuple[float, Literal["front", "back"]], ...] = ((1.0, "back"), (-1.0, "front"))
    for sign, side in sides:
        start = points.position - sign * skip * normal
        hits.append(
            source.cast_rays(
                start, sign * normal, t_max=cage + skip, fields=fields, facing=side, threads=threads
            )
        )
    distance = np.abs(np.stack([hit["t"] for hit in hits]) - skip)
    outer = distance[0] < distance[1]
    missed: Bools = np.asarray(~np.isfinite(distance).any(axis=0), np.bool_)

    def chosen(name: str, own: npt.NDArray[Any], sign: float = 1.0) -> npt.NDArray[Any]:
        wide = (slice(None), None) if own.ndim == 2 else (slice(None),)
        value = np.where(outer[wide], sign * hits[0][name], hits[1][name])
        return np.where(missed[wide], own, value).astype(own.dtype)

    return SurfacePoints(
        source,
        chosen("position", points.position),
        chosen("normal", points.normal, -1.0),  # the outward ray hits faces from behind
        chosen("shading_normal", points.shading_normal, -1.0),
        chosen("instance", np.full_like(points.instance, -1)),
        chosen("triangle", np.full_like(points.triangle, -1)),
        chosen("barycentric", points.barycentric),
        missed,
        {name: chosen(name, np.zeros(hits[0][name].shape, np.float32)) for name in materials},
    )


def material_numbers(points: SurfacePoints, threads: int | None) -> npt.NDArray[np.int32]:
    """Returns the material numbers [n] at points of an object, as in the channel `material`.

    Short rays against the normals hit the triangles on which the points are. The rays start just outside the surface
    and end just inside, at a distance of the points' rounding error.
    """
    if not len(points.position):
        return np.zeros(0, np.int32)
    reach = MAX_ROUNDING * np.maximum(np.abs(points.position).max(axis=1), 1e-30)
    found: npt.NDArray[np.int32] = points.world.cast_rays(
        points.position + points.normal * reach[:, None],
        -points.normal,
        t_max=2 * reach,
        fields=("material",),
        objects=[int(points.instance[0])],
        threads=threads,
    )["material"]
    return found
