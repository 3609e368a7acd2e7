"""Textures from photographs: the colours in which cameras show each texel."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Literal

import numpy as np
import numpy.typing as npt

from .. import _core
from ..arguments import Bools, Floats, flag, one_of, thread_count, whole
from ..baking.atlas import Atlas, mesh_with_atlas
from ..baking.gutters import fill_gutters
from ..baking.texels import covered_texels, find_texels, warn_of_overlap
from ..camera import Camera
from ..errors import Notice, WorldError
from ..io import memory_limits
from ..io.oriented_photo import ORIENTATIONS, Orientation
from ..notices import warn_all
from ..world import World
from ..world.chosen import object_number
from ..world.face_geometry import unique_rows
from ..world.object_mesh import ObjectMesh, object_mesh
from ..world.texture import Texture
from .alignment import Alignment, measure_alignment
from .composite import add_detail, compose
from .face_views import FaceTotals
from .images import Photos, PhotoSource
from .photo_set import BlendedTexels, PhotoSet, blend_texels
from .photograph_fit import PhotographFit
from .placement import placement_notices
from .surface_views import TexturedSurface
from .survey import Survey
from .texture_result import PhotoTexture
from .truth import named_photographs
from .visibility import side_of

__all__ = ["texture_from_photos"]

Single = npt.NDArray[np.float32]

TEXEL_BYTES = 64
"""Bytes for each texel of the texture, in addition to `memory`."""
COMPOSED_TEXEL_BYTES = 400
"""Bytes for each texel of methods that choose a photograph for each face."""
SIZE_RANGE = (1, 16384)
"""Smallest and largest side of a texture, in texels."""
MAX_TEXEL_PX = 4.0
"""Pixels of the photographs for each side of a texel above which the texture is too small."""
MISALIGNED_PX = 0.5
"""Shift in pixels relative to the other photographs above which a photograph may be misaligned."""
MISALIGNED_RATIO = 2.5
"""Multiple of the median shift that the shift must also exceed."""


def texture_from_photos(
    world: World,
    cameras: Mapping[str, Camera] | Sequence[Camera],
    photos: Photos,
    *,
    object: int | str = 0,
    size: int = 2048,
    images: Mapping[str, str] | None = None,
    atlas: Atlas | None = None,
    method: Literal["blend", "best", "detail"] = "blend",
    exposure: Literal["auto", "off"] = "auto",
    show_unseen: bool = False,
    orientation: Orientation = "auto",
    memory: int | str = "1 GiB",
    threads: int | None = None,
) -> PhotoTexture:
    """Computes an object's texture of `size` x `size` texels from posed photographs.

    Photographs are looked up through the lens models of their cameras.

    `photos` is the folder with the photographs, or a mapping from their names to paths or arrays. `images` maps
    camera names to names of photographs (default: `cameras.images`, or else the cameras' names). Arrays of uint8 and
    uint16 are sRGB, floats are linear; [h, w] is grey, and a fourth channel masks pixels below one half. The object's
    texture coordinates are kept, unless `atlas` is "xatlas" (requires `pip install raycam[atlas]`) or "cells" (two
    triangles in each cell of a grid), which computes new texture coordinates; all objects of the world occlude.

    With the `method` "blend", a texel's colour is the weighted mean of the up to eight views with the largest weights
    cos²(angle) sqrt(det J) border. J is the derivative of the pixel with respect to the surface, and border rises from
    0 to 1 within 32 pixels of the image's edge and of jumps of depth. Views at angles above 80 degrees are omitted, as
    are views whose luminance differs from the weighted median by more than max(3 MAD, 6 %), where MAD is the median
    absolute deviation. Vignetting is corrected.

    "best" shows each face in one photograph, which is sharp even if poses are wrong: the choice balances the views'
    weights and the number of seams. Seams are levelled by additive adjustments on the mesh, then by Poisson's equation
    within 20 texels. "detail" combines the low spatial frequencies of "blend" with the high frequencies of "best".

    `exposure` "auto" divides each photograph by a gain for each channel, so that overlapping photographs agree. Texels
    that are not visible to any camera get the colour of the nearest texel at the border of the visible regions of the
    texture, or magenta with `show_unseen`. Gutters of 8 texels surround the islands. The result is the same for any
    order of the photographs, any number of threads and any `memory`. `memory` is the number of bytes for views, in
    addition to 64 bytes for each texel (400 for "best" and "detail"). Photographs are read one at a time, and more than
    once if the views of all texels do not fit into `memory`.

    Notices report overlapping islands, an inside-out mesh, photographs with an EXIF orientation, and a texture that is
    too small for the photographs. They also report photographs that are shifted relative to the other photographs, and
    a world that fewer than half of the cameras show.

    With `orientation` "auto", a photograph is turned by its EXIF orientation if only the turned photograph has the
    camera's size. "apply" turns all photographs, as `cv2.imread` does, and "ignore" none.

    Raises `WorldError` for an object that has no texture coordinates or is not visible to any camera, `SettingsError`
    for photographs whose size differs from their camera's, `FormatError` and `OSError` for their files, and
    `MemoryError` if the machine lacks the memory.

    Sources: Callieri, Cignoni, Corsini and Scopigno, Masked photo blending, 2008; Lempitsky and Ivanov, Seamless
    mosaicing of image-based texture maps, 2007; Waechter, Moehrle and Goesele, Let there be color!, 2014; Allène, Pons
    and Keriven, Seamless image-based texture atlases using multi-band blending, 2008.
    """
    named = dict(sorted(named_photographs(cameras, images).items()))
    number = object_number(world._core, object)
    wide, threads = whole("size", size, *SIZE_RANGE), thread_count(threads)
    magenta = flag("show_unseen", show_unseen)
    one_of("method", method, ("blend", "best", "detail"))
    one_of("exposure", exposure, ("auto", "off"))
    limit = memory_limits.parse_size("memory", memory) or 0
    mesh = object_mesh(world, number)
    if atlas is not None:
        mesh = mesh_with_atlas(mesh, atlas, wide)
    elif not mesh.uvs:
        raise WorldError(
            f'object {object!r} has no texture coordinates; unwrap it with atlas="xatlas" (--atlas xatlas)',
            code="missing_texture_coordinates",
        )
    one_of("orientation", orientation, ORIENTATIONS)
    source = PhotoSource(photos, named, orientation)
    check_memory(wide, limit, TEXEL_BYTES if method == "blend" else COMPOSED_TEXEL_BYTES)
    misplaced = placement_notices(world, named)
    warn_all(misplaced)
    surface = TexturedSurface(mesh, find_texels(mesh.uvs[0], (wide, wide)))
    warn_of_overlap(surface.texels, object)
    facing = side_of(world, list(named.values()), threads, is_misplaced=bool(misplaced))
    photo_set = PhotoSet(world, named, source, surface, facing, np.ones((len(named), 3)), threads)
    return _compute(photo_set, number, method, exposure == "auto", magenta, limit)


def _compute(
    photos: PhotoSet, number: int, method: str, equalise: bool, magenta: bool, memory: int
) -> PhotoTexture:
    """Computes the texture of the object `number`; estimates gains if `equalise` is True."""
    surface = photos.surface
    totals = None if method == "blend" else FaceTotals()
    blended = blend_texels(photos, memory, totals, equalise=equalise)
    photos = replace(photos, gains=blended.gains)
    if not blended.views.any():
        raise WorldError(
            f"object {photos.world.objects[number].name!r} is not visible to any camera; "
            "check that the mesh and the cameras use the same coordinates",
            code="nothing_visible",
        )
    colors, view = blended.colors, np.full(len(blended.views), -1, np.int32)
    if totals is not None:
        best = compose(photos, blended, totals)
        colors, view = best.colors, best.view
    if method == "detail":
        texels = surface.texels
        colors = add_detail(colors, blended.colors, blended.views > 0, texels.index, texels.size)
    fits = _fits(photos, blended, surface.texels.size[0])
    return _result(photos, number, blended, colors, view, fits, magenta)


def _fits(photos: PhotoSet, blended: BlendedTexels, size: int) -> tuple[PhotographFit, ...]:
    """The fit of each photograph to the other photographs, with notices about poor fits."""
    sizes = np.array([camera.size for camera in photos.cameras.values()], float)
    alignment = measure_alignment(blended.survey, photos.gains, sizes)
    warn_all([*_size_notices(blended.survey, size), *_alignment_notices(alignment, list(photos.cameras))])
    fits = []
    for i, name in enumerate(photos.cameras):
        red, green, blue = photos.gains[i].tolist()
        measured = float(alignment.shift[i]), float(alignment.disagreement[i])
        fits.append(PhotographFit(name, int(blended.texels[i]), (red, green, blue), *measured))
    return tuple(fits)


def check_memory(size: int, views: int, texel: int = TEXEL_BYTES) -> None:
    """Raises `MemoryError` if the texels of a texture and their views do not fit into memory."""
    needed, available = texel * size * size + views, memory_limits.available_bytes()
    if needed > available:
        error = MemoryError(
            f"a texture of {size} x {size} texels requires {needed / 2**30:.1f} GiB, available: "
            f"{available / 2**30:.1f} GiB; reduce the arguments size or memory"
        )
        vars(error)["code"] = "out_of_memory"
        raise error


def _size_notices(survey: Survey, size: int) -> list[Notice]:
    """Returns a notice with a sufficient size if the texture is too small for the photographs."""
    largest = np.zeros(survey.points, np.float32)
    np.maximum.at(largest, survey.point, survey.footprint)
    largest = largest[largest > 0]
    ratio = float(np.median(largest)) if len(largest) else 0.0
    if ratio <= MAX_TEXEL_PX:
        return []
    fit = int(min(16384, 2 ** np.ceil(np.log2(size * ratio))))
    message = (
        f"a texel is {ratio:.1f} pixels wide in the photographs; size={fit} (--texture-size {fit}) keeps their "
        "detail"
    )
    return [Notice(message, "coarse_texture")]


def _alignment_notices(alignment: Alignment, names: list[str]) -> list[Notice]:
    """Returns a notice if photographs are shifted relative to the other photographs."""
    known = alignment.shift[np.isfinite(alignment.shift)]
    if len(known) < 3:
        return []
    limit = max(MISALIGNED_PX, MISALIGNED_RATIO * float(np.median(known)))
    off = [
        f"{name} ({shift:.1f} pixels)"
        for name, shift in zip(names, alignment.shift, strict=True)
        if shift > limit
    ]
    message = "shifted relative to the other photographs; check the pose and the lens"
    return [Notice(message, "misaligned_photographs", off[:3], len(off))] if off else []


def _result(
    photos: PhotoSet,
    number: int,
    blended: BlendedTexels,
    colors: Single,
    view: npt.NDArray[np.int32],
    fits: tuple[PhotographFit, ...],
    magenta: bool,
) -> PhotoTexture:
    """The texture with filled unseen texels and gutters, on a world with the object."""
    surface = photos.surface
    texels = surface.texels
    seen = blended.views > 0
    if magenta:
        colors[~seen] = [1, 0, 1]
    covered = covered_texels(texels)
    wide, high = texels.size

    def image(values: npt.NDArray[np.generic]) -> npt.NDArray[np.generic]:
        full = np.zeros((wide * high, *values.shape[1:]), values.dtype)
        full[texels.index] = values
        return full.reshape(high, wide, *values.shape[1:])

    if not magenta and not seen.all():
        border = np.flatnonzero(_border(image(seen)).reshape(-1)[texels.index])  # type: ignore[arg-type]
        known, wanted = (surface.part(some).points for some in (border, np.flatnonzero(~seen)))
        colors[~seen] = colors[border[_nearest(known, wanted, photos.threads)]]
    linear = fill_gutters(image(colors), covered)
    texture = _core.srgb_from_linear(np.ascontiguousarray(linear, np.float32), 1.0, 8, "standard")
    made = _textured(photos.world, number, surface.mesh, texture)
    return PhotoTexture(
        made,
        texture,
        image(seen),  # type: ignore[arg-type]
        covered,
        image(blended.views),  # type: ignore[arg-type]
        image(blended.spread),  # type: ignore[arg-type]
        image(view + 1) - 1,  # type: ignore[arg-type]
        fits,
        photos,
        number,
    )


def _border(seen: Bools) -> Bools:
    """Returns True [h, w] for seen texels next to a texel that is not seen, or at the edge of the texture."""
    padded = np.pad(seen, 1)
    inner = padded[:-2, 1:-1] & padded[2:, 1:-1] & padded[1:-1, :-2] & padded[1:-1, 2:]
    found: Bools = seen & ~inner
    return found


def _nearest(known: Floats, wanted: Floats, threads: int | None) -> npt.NDArray[np.int64]:
    """The index of the nearest known point for each requested point."""
    cloud = World()
    each = np.arange(len(known))
    cloud.add_mesh(known, np.stack([each, each, each], axis=1))
    found: npt.NDArray[np.int64] = cloud.closest_points(wanted, threads=threads)["triangle"].astype(np.int64)
    return found


def _textured(world: World, number: int, mesh: ObjectMesh, texture: npt.NDArray[np.uint8]) -> World:
    """Returns a world that contains only the textured object."""
    made = World(world.up)
    rows = np.concatenate([mesh.corners.reshape(-1, 3), mesh.uvs[0].reshape(-1, 2)], axis=1)
    welded, faces = unique_rows(rows)
    made.add_mesh(
        welded[:, :3],
        faces.reshape(-1, 3),
        uvs=welded[:, 3:],
        name=world.objects[number].name,
        material={"type": "unlit", "texture": Texture(texture, wrap="clamp")},
    )
    return made
