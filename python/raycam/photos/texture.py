"""Textures from photographs: the colours in which cameras see each texel."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from .. import _core
from ..arguments import Floats, flag, one_of, thread_count, whole
from ..baking.gutters import fill_gutters
from ..baking.texels import covered_texels, find_texels, warn_of_overlap
from ..camera import Camera
from ..errors import Notice, WorldError
from ..io import memory_limits
from ..notices import warn_all
from ..world import World
from ..world.chosen import object_number
from ..world.object_mesh import ObjectMesh, object_mesh
from ..world.texture import Texture
from .alignment import Alignment, measure_alignment
from .blending import TexelViews
from .gains import estimate_gains
from .images import Photos, PhotoSource
from .placement import placement_notices
from .sight import Facing
from .surface_views import TexturedSurface, view_part
from .survey import Survey, ViewedPhotograph, take_survey
from .texture_result import PhotographFit, PhotoTexture
from .truth import named_photographs
from .visibility import side_of

__all__ = ["texture_from_photos"]

Single = npt.NDArray[np.float32]

TEXEL_BYTES = 64
"""Bytes for each texel of the texture, in addition to `memory`."""
PART_TEXELS = 1 << 16
"""Texels that are looked up in a photograph at the same time."""
MAX_TEXEL_PX = 4.0
"""Pixels of the photographs for each side of a texel above which the texture is too small."""
MISALIGNED_PX = 0.5
"""Shift of a photograph against the others above which it may be misaligned ..."""
MISALIGNED_RATIO = 3.0
"""... if it is also this many times the median shift."""


def texture_from_photos(
    world: World,
    cameras: Mapping[str, Camera] | Sequence[Camera],
    photos: Photos,
    *,
    object: int | str = 0,
    size: int = 2048,
    images: Mapping[str, str] | None = None,
    exposure: Literal["auto", "off"] = "auto",
    show_unseen: bool = False,
    memory: int | str = "1 GiB",
    threads: int | None = None,
) -> PhotoTexture:
    """Computes an object's texture of `size` x `size` texels from posed photographs, through their own lenses.

    `photos` is the folder with the photographs, or a mapping from their names to paths or arrays: uint8 and uint16 are
    sRGB, floats are linear; [h, w] is grey, and a fourth channel masks pixels below one half. The object's texture
    coordinates are kept; all objects of the world occlude. A texel's colour is a mean of the up to eight views with the
    largest weight cos²(angle) sqrt(det J) border, where J is the derivative of the pixel by the surface, and border
    rises over 32 pixels from the image's edge and from jumps of depth. Angles above 80 degrees do not count. Views
    whose luminance is off the weighted median by more than max(3 MAD, 6 %) are left out. Vignetting is undone.

    `exposure` "auto" divides each photograph by a gain for each channel, so that overlapping photographs agree.
    Texels that no camera sees get the colour of the nearest seen texel, or magenta with `show_unseen`. Gutters of 8
    texels surround the islands. The result is the same for any order of the photographs, any number of threads and any
    `memory`, the bytes for views in addition to 64 bytes for each texel; photographs are read one at a time, more than
    once if `memory` cannot contain the views of all texels.

    Notices report overlapping islands, an inside-out mesh, photographs with an EXIF orientation (which is ignored), a
    texture that is too small for the photographs, photographs that are shifted against the others, and that fewer than
    half of the cameras look at the world.

    Raises `WorldError` for an object without texture coordinates or one that no camera sees, `SettingsError` for
    photographs of another size than their camera, `FormatError` and `OSError` for their files, and `MemoryError` if
    the machine lacks the memory.

    Source: Callieri, Cignoni, Corsini and Scopigno, Masked photo blending, 2008.
    """
    named = dict(sorted(named_photographs(cameras, images).items()))
    number = object_number(world._core, object)
    wide, threads = whole("size", size, 1, 16384), thread_count(threads)
    magenta = flag("show_unseen", show_unseen)
    one_of("exposure", exposure, ("auto", "off"))
    limit = memory_limits.parse_size("memory", memory) or 0
    mesh = object_mesh(world, number)
    if not mesh.uvs:
        raise WorldError(
            f"object {object!r} has no texture coordinates; unwrap it first, for example in Blender",
            code="missing_texture_coordinates",
        )
    source = PhotoSource(photos, named)
    check_memory(wide, limit)
    warn_all(placement_notices(world, named))
    surface = TexturedSurface(mesh, find_texels(mesh.uvs[0], (wide, wide)))
    warn_of_overlap(surface.texels, object)
    facing = side_of(world, list(named.values()), threads)
    survey = take_survey(world, named, source, surface, facing, threads)
    gains = estimate_gains(survey) if exposure == "auto" else np.ones((len(named), 3))
    alignment = measure_alignment(survey, gains, np.array([camera.size for camera in named.values()], float))
    blender = _Blender(world, named, source, surface, facing, gains, threads)
    blended = blender.blend(limit)
    if not blended.views.any():
        raise WorldError(
            f"object {object!r} is not visible to any camera; "
            "check that the mesh and the cameras use the same coordinates",
            code="nothing_visible",
        )
    warn_all([*_size_notices(survey, wide), *_alignment_notices(alignment, list(named))])
    fits = tuple(
        PhotographFit(name, int(blended.texels[i]), tuple(map(float, gains[i])), *map(float, both))  # type: ignore[arg-type]
        for i, (name, *both) in enumerate(zip(named, alignment.shift, alignment.disagreement, strict=True))
    )
    return _result(world, number, surface, blended, fits, magenta, threads)


def check_memory(size: int, views: int) -> None:
    """Raises `MemoryError` if the texels of a texture and their views do not fit into memory."""
    needed, available = TEXEL_BYTES * size * size + views, memory_limits.available_bytes()
    if needed > available:
        error = MemoryError(
            f"a texture of {size} x {size} texels requires {needed / 2**30:.1f} GiB, available: "
            f"{available / 2**30:.1f} GiB; use a smaller size or memory"
        )
        vars(error)["code"] = "out_of_memory"
        raise error


@dataclass(eq=False)
class _Blended:
    """Colours of the texels of faces [n]."""

    colors: Single
    views: npt.NDArray[np.int32]
    spread: Single
    texels: npt.NDArray[np.int64]
    """The number of texels that each photograph shows."""


@dataclass(eq=False)
class _Blender:
    """Photographs and the surface that they show."""

    world: World
    cameras: Mapping[str, Camera]
    source: PhotoSource
    surface: TexturedSurface
    facing: Facing
    gains: Floats
    threads: int | None

    def blend(self, memory: int) -> _Blended:
        """The robust means of all texels, with at most `memory` bytes for views at a time."""
        count = len(self.surface.texels.index)
        found = _Blended(
            np.zeros((count, 3), np.float32),
            np.zeros(count, np.int32),
            np.zeros(count, np.float32),
            np.zeros(len(self.cameras), np.int64),
        )
        step = max(PART_TEXELS, memory // TexelViews.BYTES)
        for first in range(0, count, step):
            tile = range(first, min(first + step, count))
            views = TexelViews(len(tile))
            for number, (name, camera) in enumerate(self.cameras.items()):
                photo = ViewedPhotograph(self.world, camera, self.source, name, self.threads)
                found.texels[number] += self._add(views, tile, number, photo)
            part = slice(tile.start, tile.stop)
            found.views[part] = views.views
            views.write_mean(found.colors[part], found.spread[part])
        return found

    def _add(self, views: TexelViews, tile: range, number: int, photo: ViewedPhotograph) -> int:
        """Adds a photograph to the views of a tile; the number of texels that it shows."""
        shown = 0
        for start in range(tile.start, tile.stop, PART_TEXELS):
            some = slice(start, min(start + PART_TEXELS, tile.stop))
            view = view_part(
                self.world,
                photo.camera,
                photo.pyramid,
                self.surface.part(some),
                facing=self.facing,
                edges=photo.edges,
                threads=self.threads,
            )
            colors = view.colors / self.gains[number].astype(np.float32)
            views.add(view.index + (start - tile.start), view.weight, colors)
            shown += len(view.index)
        return shown


def _size_notices(survey: Survey, size: int) -> list[Notice]:
    """The notice that the photographs resolve more than the texture, with the size that would do."""
    largest = np.zeros(survey.points, np.float32)
    np.maximum.at(largest, survey.point, survey.footprint)
    ratio = float(np.median(largest[largest > 0]))
    if ratio <= MAX_TEXEL_PX:
        return []
    fit = int(min(16384, 2 ** np.ceil(np.log2(size * ratio))))
    message = (
        f"a texel is {ratio:.1f} pixels wide in the photographs; size={fit} (--texture-size {fit}) keeps their "
        "detail"
    )
    return [Notice(message, "coarse_texture")]


def _alignment_notices(alignment: Alignment, names: list[str]) -> list[Notice]:
    """The notice that photographs are shifted against the others."""
    known = alignment.shift[np.isfinite(alignment.shift)]
    if len(known) < 3:
        return []
    limit = max(MISALIGNED_PX, MISALIGNED_RATIO * float(np.median(known)))
    off = [
        f"{name} ({shift:.1f} pixels)"
        for name, shift in zip(names, alignment.shift, strict=True)
        if shift > limit
    ]
    message = "shifted against the other photographs; check the pose and the lens"
    return [Notice(message, "misaligned_photographs", off[:3], len(off))] if off else []


def _result(
    world: World,
    number: int,
    surface: TexturedSurface,
    blended: _Blended,
    fits: tuple[PhotographFit, ...],
    magenta: bool,
    threads: int | None,
) -> PhotoTexture:
    """The texture with unseen texels and gutters filled, on a world with the object."""
    texels, colors = surface.texels, blended.colors
    seen = blended.views > 0
    if magenta:
        colors[~seen] = [1, 0, 1]
    elif not seen.all():
        known, wanted = (surface.part(np.flatnonzero(some)).points for some in (seen, ~seen))
        colors[~seen] = colors[seen][_nearest(known, wanted, threads)]
    covered = covered_texels(texels)
    wide, high = texels.size

    def image(values: npt.NDArray[np.generic]) -> npt.NDArray[np.generic]:
        full = np.zeros((wide * high, *values.shape[1:]), values.dtype)
        full[texels.index] = values
        return full.reshape(high, wide, *values.shape[1:])

    linear = fill_gutters(image(colors), covered)
    texture = _core.srgb_from_linear(np.ascontiguousarray(linear, np.float32), 1.0, 8, "standard")
    made = _textured(world, number, surface.mesh, texture)
    return PhotoTexture(
        made,
        texture,
        image(seen),  # type: ignore[arg-type]
        covered,
        image(blended.views),  # type: ignore[arg-type]
        image(blended.spread),  # type: ignore[arg-type]
        fits,
    )


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
