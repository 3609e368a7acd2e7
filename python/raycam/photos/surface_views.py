"""Colours and weights of points of a textured surface in a photograph."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from .._core import PhotoPyramid
from ..arguments import Floats, product
from ..baking.texels import Texels
from ..camera import Camera
from ..world import World
from ..world.face_geometry import face_areas, face_normals, interpolate
from ..world.object_mesh import ObjectMesh
from .depth_edges import DepthEdges
from .sight import Facing, find_sight

__all__ = ["BORDER_WIDTH_PX", "MIN_COSINE", "PartView", "SurfacePart", "TexturedSurface", "view_part"]

Ints = npt.NDArray[np.int64]
Single = npt.NDArray[np.float32]

MIN_COSINE = float(np.cos(np.radians(80)))
"""Cosine of the largest angle of incidence."""
BORDER_WIDTH_PX = 32.0
"""Distance in pixels from the image's edge, and from jumps of depth, over which the weight rises to 1."""
MIN_BORDER = 1e-6
"""Weight of a pixel at the image's edge, so that a texel that is visible only there still gets a colour."""


@dataclass(frozen=True, eq=False)
class SurfacePart:
    """A subset of a surface's points."""

    BYTES = 28
    """The memory that each point needs, in bytes."""

    face: npt.NDArray[np.int32]
    """The index of the face of each point [n]."""
    points: Floats
    """The positions of the points in the world [n, 3], metres."""
    face_normals: Floats
    """The unit normals of all faces [f, 3]."""
    face_spacing: Floats
    """The distance between neighbouring texels of each face [f], metres."""

    @property
    def normals(self) -> Floats:
        """The faces' unit normals at the points [n, 3]."""
        return self.face_normals[self.face]

    @property
    def spacing(self) -> Floats:
        """The distance between neighbouring texels at the points [n], metres."""
        return self.face_spacing[self.face]


class TexturedSurface:
    """The texels of a mesh as points of its surface."""

    def __init__(self, mesh: ObjectMesh, texels: Texels) -> None:
        self.mesh, self.texels = mesh, texels
        self.normals = face_normals(mesh.corners)
        a, b = (texels.corners[:, i] - texels.corners[:, 0] for i in (1, 2))
        in_texels = np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / 2
        self.spacing = np.sqrt(face_areas(mesh.corners) / np.maximum(in_texels, 1e-30))

    def part(self, some: slice | Ints) -> SurfacePart:
        """The surface points of a subset of the texels."""
        face = self.texels.face[some]
        points = interpolate(self.texels.weights(some), self.mesh.corners[face])
        return SurfacePart(face, points, self.normals, self.spacing)


@dataclass(frozen=True, eq=False)
class PartView:
    """The points of a part that a photograph shows [k]."""

    index: Ints
    """The points' indices in the part, ascending."""
    places: Floats
    """The pixel coordinates [k, 2], measured from the image's top left corner."""
    colors: Single
    """Linear colours [k, 3]."""
    weight: Single
    """Weights [k], more than 0."""
    footprint: Single
    """Pixels of the photograph for each side of a texel [k]."""


def view_part(
    world: World,
    camera: Camera,
    photograph: Callable[[], PhotoPyramid],
    part: SurfacePart,
    *,
    facing: Facing,
    edges: Callable[[], DepthEdges] | None,
    threads: int | None,
) -> PartView:
    """Returns the points that are visible to the camera, with their colours and weights.

    The weight is cos² sqrt(det J) border, where cos is the cosine of incidence, and J is the derivative of the pixel
    with respect to the surface. `border` rises from 0 at the image's edge and, if `edges` are given, at jumps of depth.
    Transparent pixels have no colour.
    """
    sight = find_sight(
        world,
        camera,
        part.points,
        part.normals,
        facing=facing,
        min_cosine=MIN_COSINE,
        footprints=True,
        threads=threads,
    )
    index = sight.index
    if not len(index):
        none = np.zeros(0, np.float32)
        return PartView(index, np.zeros((0, 2)), np.zeros((0, 3), np.float32), none, none)
    jacobian = sight.footprints
    area = np.nan_to_num(
        np.abs(jacobian[:, 0, 0] * jacobian[:, 1, 1] - jacobian[:, 0, 1] * jacobian[:, 1, 0])
    )
    places = sight.pixels - camera.corner
    inside = np.minimum(places, np.array(camera.size) - places)
    border = np.minimum(inside[:, 0], inside[:, 1])
    if edges is not None:
        border = np.minimum(border, edges().at(places))
    border = border / BORDER_WIDTH_PX
    spacing = part.face_spacing[part.face[index]]
    pixels = photograph().mean_colors(places, jacobian * spacing[:, None, None], threads)
    dimming = vignetting_at(camera, sight.pixels)
    weight = sight.cosine**2 * np.sqrt(area) * np.clip(border, MIN_BORDER, 1.0)
    weight *= (pixels[:, 3] > 0.5) & (dimming > 0)
    shown = weight > 0
    colors = pixels[shown, :3] / dimming[shown, None]
    footprint = (np.sqrt(area) * spacing)[shown].astype(np.float32)
    return PartView(
        index[shown],
        places[shown],
        colors.astype(np.float32),
        weight[shown].astype(np.float32),
        footprint,
    )


def vignetting_at(camera: Camera, pixels: Floats) -> Floats:
    """The factors [n] by which vignetting darkens pixels [n, 2]; 1 without vignetting."""
    known = camera.vignetting
    factor = np.ones(len(pixels))
    if known is None:
        return factor
    (f_x, skew, c_x), (_, f_y, c_y), _ = camera.K
    y = (pixels[:, 1] - c_y) / f_y
    x = (pixels[:, 0] - c_x - skew * y) / f_x
    squared = x**2 + y**2
    for power, term in enumerate(known["polynomial"], start=1):
        factor = factor + term * squared**power
    if known["cos4"]:
        _, directions = camera.rays(pixels)
        factor = factor * np.nan_to_num(product(directions, camera.R[2]) ** 4)
    return factor
