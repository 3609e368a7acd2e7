"""Textures from photographs: the robust mean of the colours in which cameras see each texel."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from .. import _core
from ..arguments import Bools, Floats, flag, one_of, thread_count, whole
from ..baking.gutters import fill_gutters
from ..baking.texels import Texels, covered_texels, find_texels, warn_of_overlap
from ..camera import Camera
from ..errors import WorldError
from ..io.oriented_photo import ORIENTATIONS, Orientation
from ..notices import warn_all
from ..world import World
from ..world.chosen import object_number
from ..world.face_geometry import face_areas, face_normals
from ..world.object_mesh import ObjectMesh, object_mesh
from ..world.texture import Texture
from .images import Photos, Pyramid, read_photo
from .placement import placement_notices
from .sight import Facing, find_sight, footprints
from .truth import named_photographs
from .visibility import side_of

__all__ = ["PhotoTexture", "texture_from_photos"]

MAX_BLENDED_VIEWS = 8
"""Views of a texel that are blended: those with the largest weights."""
MIN_COSINE = float(np.cos(np.radians(80)))
"""Cosine of the largest angle of incidence."""
BORDER_WIDTH_PX = 32.0
"""Pixels from the image's edge over which the weight rises to 1."""
CHUNK_TEXELS = 1 << 19
"""Texels in work at the same time, about 150 MB; each photograph is read once for each chunk."""
LUMINANCE_TOLERANCE = 0.06
"""Relative difference of luminance within which views agree."""
LUMINANCE = np.array([0.2126, 0.7152, 0.0722], np.float32)


@dataclass(frozen=True, eq=False)
class PhotoTexture:
    """The result of `texture_from_photos`; maps are [h, w]."""

    world: World
    """The textured object, with unlit colours, under its name."""
    texture: npt.NDArray[np.uint8]
    """The texture, sRGB uint8 [h, w, 3], with gutters."""
    seen: Bools
    """True for texels that a camera sees; other texels of faces have the colour of the nearest such texel."""
    covered: Bools
    """True for texels whose centre is in a face."""
    views: npt.NDArray[np.int32]
    """The number of cameras that see the texel."""
    disagreement: npt.NDArray[np.float32]
    """The weighted standard deviation of luminance between views over its mean; high where poses are wrong."""


def texture_from_photos(
    world: World,
    cameras: Mapping[str, Camera] | Sequence[Camera],
    photos: Photos,
    *,
    object: int | str = 0,
    size: int = 2048,
    images: Mapping[str, str] | None = None,
    show_unseen: bool = False,
    orientation: Orientation = "auto",
    threads: int | None = None,
) -> PhotoTexture:
    """Computes an object's texture of `size` x `size` texels from posed photographs, through their own lenses.

    `photos` is the folder with the photographs, or a mapping from their names to paths or arrays (uint8 sRGB, or linear
    floats). The object's texture coordinates are kept; all objects of the world occlude. A texel's colour is a mean of
    the up to eight views with the largest weight cos²(angle) sqrt(det J) border, where J is the derivative of the pixel
    by the surface, border rises over 32 pixels from the image's edge, and angles above 80 degrees and transparent
    pixels do not count. Views whose luminance is off the weighted median by more than max(3 MAD, 6 %) are left out.

    Texels that no camera sees get the colour of the nearest seen texel, or magenta with `show_unseen`. Gutters of 8
    texels surround the islands. The result is the same for any order of the photographs and any number of threads.
    Notices report overlapping islands, an inside-out mesh, photographs with an EXIF orientation, and that fewer than
    half of the cameras look at the world.

    With `orientation` "auto", a photograph is turned by its EXIF orientation if only the turned photograph has the
    camera's size. "apply" turns all photographs, as `cv2.imread` does, and "ignore" none.

    Raises `WorldError` for an object without texture coordinates or one that no camera sees, `SettingsError` for
    photographs of another size than their camera, `FormatError` and `OSError` for their files.

    Source: Callieri, Cignoni, Corsini and Scopigno, Masked photo blending, 2008.
    """
    one_of("orientation", orientation, ORIENTATIONS)
    named = dict(sorted(named_photographs(cameras, images).items()))
    number = object_number(world._core, object)
    wide, threads = whole("size", size, 1, 16384), thread_count(threads)
    magenta = flag("show_unseen", show_unseen)
    mesh = object_mesh(world, number)
    if not mesh.uvs:
        raise WorldError(
            f"object {object!r} has no texture coordinates; unwrap it first, for example in Blender"
        )
    warn_all(placement_notices(world, named))
    texels = find_texels(mesh.uvs[0], (wide, wide))
    warn_of_overlap(texels, object)
    facing = side_of(world, list(named.values()), threads)
    count = len(texels.index)
    colors, views = np.zeros((count, 3), np.float32), np.zeros(count, np.int32)
    spread = np.zeros(count, np.float32)
    for first in range(0, count, CHUNK_TEXELS):
        part = slice(first, first + CHUNK_TEXELS)
        colors[part], views[part], spread[part] = _blend(
            world, named, (photos, orientation), mesh, texels, part, facing, threads
        )
    if not views.any():
        raise WorldError(
            f"object {object!r} is not visible to any camera; "
            "check that the mesh and the cameras use the same coordinates"
        )
    corners = mesh.corners[texels.face]
    points = np.einsum("nk,nkj->nj", texels.weights, corners)
    seen = views > 0
    colors[~seen] = [1, 0, 1] if magenta else colors[seen][_nearest(points[seen], points[~seen], threads)]
    covered = covered_texels(texels)

    def image(values: npt.NDArray[np.generic]) -> npt.NDArray[np.generic]:
        full = np.zeros((wide * wide, *values.shape[1:]), values.dtype)
        full[texels.index] = values
        return full.reshape(wide, wide, *values.shape[1:])

    linear = fill_gutters(image(colors), covered)
    texture = _core.srgb_from_linear(np.ascontiguousarray(linear, np.float32), 1.0, 8, "standard")
    made = _textured(world, number, mesh, texture)
    return PhotoTexture(made, texture, image(seen), covered, image(views), image(spread))  # type: ignore[arg-type]


def _blend(
    world: World,
    cameras: Mapping[str, Camera],
    photos: tuple[Photos, Orientation],
    mesh: ObjectMesh,
    texels: Texels,
    part: slice,
    facing: Facing,
    threads: int | None,
) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.int32], npt.NDArray[np.float32]]:
    """Colours [n, 3], numbers of views [n] and disagreement [n] of some texels."""
    face = texels.face[part]
    corners = mesh.corners[face]
    points = np.einsum("nk,nkj->nj", texels.weights[part], corners)
    normals = face_normals(corners)
    spacing = np.sqrt(face_areas(corners) / np.maximum(_uv_areas(mesh, face, texels.size), 1e-30))
    weights = np.zeros((len(face), MAX_BLENDED_VIEWS), np.float32)
    colors = np.zeros((len(face), MAX_BLENDED_VIEWS, 3), np.float32)
    views = np.zeros(len(face), np.int32)
    for name, camera in cameras.items():
        sight = find_sight(
            world, camera, points, normals, facing=facing, min_cosine=MIN_COSINE, threads=threads
        )
        index = sight.index
        if not len(index):
            continue
        distance = np.sqrt(((sight.origins - points[index]) ** 2).sum(axis=1))
        jacobian = footprints(camera, points[index], normals[index], distance)
        area = np.nan_to_num(np.abs(np.linalg.det(jacobian)))
        places = sight.pixels - camera.corner
        edge = np.minimum(places, np.array(camera.size) - places).min(axis=1)
        pixels = Pyramid(read_photo(photos[0], name, camera, photos[1])).at(
            places, np.sqrt(area) * spacing[index]
        )
        weight = (
            sight.cosine**2
            * np.sqrt(area)
            * np.clip(edge / BORDER_WIDTH_PX, 1e-6, 1.0)
            * (pixels[:, 3] > 0.5)
        )
        views[index] += weight > 0
        slot = weights[index].argmin(axis=1)
        better = weight > weights[index, slot]
        weights[index[better], slot[better]] = weight[better]
        colors[index[better], slot[better]] = pixels[better, :3]
    mean, spread = robust_mean(weights, colors)
    return mean, views, spread


def robust_mean(
    weights: npt.NDArray[np.float32], colors: npt.NDArray[np.float32]
) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.float32]]:
    """The weighted mean [n, 3] of colours [n, k, 3] without outliers, and the relative spread [n] of luminance.

    Outliers differ from the weighted median of luminance by more than max(3 MAD, 6 %).
    """
    order = np.argsort(-weights, axis=1, kind="stable")
    heavy = np.take_along_axis(weights.astype(np.float64), order, axis=1)
    colors = np.take_along_axis(colors, order[..., None], axis=1)
    light = (colors * LUMINANCE).sum(axis=2).astype(np.float64)
    median = weighted_median(light, heavy)[:, None]
    off = np.abs(light - median)
    mad = weighted_median(off, heavy)[:, None]
    kept = heavy * (off <= np.maximum(3 * mad, LUMINANCE_TOLERANCE * median))
    total = np.maximum(kept.sum(axis=1), 1e-300)
    mean = (kept[..., None] * colors).sum(axis=1) / total[:, None]
    every = np.maximum(heavy.sum(axis=1), 1e-300)
    middle = (heavy * light).sum(axis=1) / every
    variance = (heavy * (light - middle[:, None]) ** 2).sum(axis=1) / every
    spread = np.sqrt(variance) / np.maximum(middle, 1e-6)
    return mean.astype(np.float32), spread.astype(np.float32)


def weighted_median(values: Floats, weights: Floats) -> Floats:
    """The lower weighted medians [n] of values [n, k]."""
    order = np.argsort(values, axis=1, kind="stable")
    sums = np.cumsum(np.take_along_axis(weights, order, axis=1), axis=1)
    place = (sums < sums[:, -1:] / 2).sum(axis=1)
    place = np.minimum(place, values.shape[1] - 1)
    found: Floats = np.take_along_axis(np.take_along_axis(values, order, axis=1), place[:, None], axis=1)[
        :, 0
    ]
    return found


def _uv_areas(mesh: ObjectMesh, face: npt.NDArray[np.int64], size: tuple[int, int]) -> Floats:
    """The areas of faces in texels."""
    uv = mesh.uvs[0][face].astype(np.float64) * size
    a, b = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    found: Floats = np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / 2
    return found


def _nearest(known: Floats, wanted: Floats, threads: int | None) -> npt.NDArray[np.int64]:
    """The number of the nearest known point for each wanted one."""
    cloud = World()
    each = np.arange(len(known))
    cloud.add_mesh(known, np.stack([each, each, each], axis=1))
    found: npt.NDArray[np.int64] = cloud.closest_points(wanted, threads=threads)["triangle"].astype(np.int64)
    return found


def _textured(world: World, number: int, mesh: ObjectMesh, texture: npt.NDArray[np.uint8]) -> World:
    """A world with the object in the colours of its texture."""
    made = World(world.up)
    rows = np.concatenate([mesh.corners.reshape(-1, 3), mesh.uvs[0].reshape(-1, 2)], axis=1)
    welded, faces = np.unique(rows, axis=0, return_inverse=True)
    made.add_mesh(
        welded[:, :3],
        faces.reshape(-1, 3),
        uvs=welded[:, 3:],
        name=world.objects[number].name,
        material={"type": "unlit", "texture": Texture(texture, wrap="clamp")},
    )
    return made
