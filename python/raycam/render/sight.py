"""Notices about images without visible content: no object, no light, or only white."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from .. import _core

if TYPE_CHECKING:
    from ..camera import Camera
    from ..world import World
from ..errors import Notice

__all__ = ["LIT_INTEGRATORS", "blank_notices"]

MIN_WHITE_SHARE = 0.98
"""A notice is given if at least this fraction of the objects' pixels is brighter than white."""
WHITE_LEVEL = 254
"""With a view that compresses bright values, a pixel counts as white if all three 8-bit values are at least this."""
MIN_PIXELS = 16
"""Minimum number of the objects' pixels for the notice about one or two displayed colours."""
MIN_CONTRAST = 1.25
"""Shading should be visible if the brightest lit pixel is at least this many times as bright as the darkest."""
PIXEL_STEP = 16
"""One of this many pixels is tested first."""
PROBES_PER_SIDE = 24
"""Number of rays along each side that probe an image without ground truth."""
LIT_INTEGRATORS = ("direct", "path")
"""The integrators whose images show light."""
MEDIA_INTEGRATORS = ("flat", *LIT_INTEGRATORS)
"""The integrators whose images show media."""

Planes = Mapping[str, npt.NDArray[Any]]
Bools = npt.NDArray[np.bool_]
Truth = Callable[[], npt.NDArray[np.int32]]


def blank_notices(
    world: World, camera: Camera, planes: Planes, integrator: str, exposure: float, view: str, truth: Truth
) -> Iterator[Notice]:
    """Yields the notices about an image that shows no objects, no light, or no shading.

    Objects show no shading if 98 % of their pixels are displayed as white, or all of them in one or two colours.

    `truth()` renders the channel `instance`; `truth` is called if the image lacks this channel and rays that
    probe the image hit nothing.
    """
    seen = _seen(world, camera, planes, truth)
    if not seen.any():
        if integrator in MEDIA_INTEGRATORS and _shows_media(world, camera):
            return
        message = (
            f"nothing is visible: no object covers the centre of a pixel. The camera is at {_place(camera)}, its "
            f"viewing direction is {_numbers(camera.R[2])}, and the world's bounds are {_bounds(world)}; check the "
            "camera's pose"
        )
        yield Notice(message, "nothing_visible")
        return
    color = planes.get("color")
    if color is None or integrator not in LIT_INTEGRATORS:
        return
    color = color[seen]
    if not color.any():
        instances = planes["instance"] if "instance" in planes else truth()
        enclosing = _enclosing_object(world, camera, instances)
        if enclosing is not None:
            message = (
                f"the image is black, because the camera is inside object {enclosing!r}, which is opaque and "
                "does not emit light inside; move the camera out of it, or use set_object(..., visible=False)"
            )
            yield Notice(message, "nothing_lit")
            return
        message = (
            "all visible objects are black, because no light reaches them or their materials reflect no light; check "
            "the lights' positions and directions, and colours of 0"
        )
        yield Notice(message, "nothing_lit")
        return
    if not _shows_shading(color, exposure, view):
        yield from _flat_notices(color, exposure, view)


def _shows_shading(color: npt.NDArray[Any], exposure: float, view: str) -> bool:
    """Returns True if a few of the pixels prove that `_flat_notices` yields nothing."""
    some = color[::PIXEL_STEP]
    brightness, shown = _displayed(some, exposure, view)
    dark = len(some) - np.count_nonzero(_is_white(brightness, shown, view))
    return bool(dark > (1 - MIN_WHITE_SHARE) * len(color)) and _count_up_to_three(shown) == 3


def _displayed(
    color: npt.NDArray[Any], exposure: float, view: str
) -> tuple[npt.NDArray[Any], npt.NDArray[np.uint8]]:
    """The brightness [n] and the displayed colours [n, 3] of linear colours [n, 3]."""
    linear = np.ascontiguousarray(color[np.newaxis], dtype=np.float32)
    shown = np.asarray(_core.srgb_from_linear(linear, 2.0**exposure, 8, view))[0]
    return color.max(axis=1) * 2.0**exposure, shown


def _is_white(brightness: npt.NDArray[Any], shown: npt.NDArray[np.uint8], view: str) -> Bools:
    """Returns True [n] for colours that are displayed as white."""
    return np.asarray(brightness > 1 if view == "standard" else (shown >= WHITE_LEVEL).all(axis=1))


def _flat_notices(color: npt.NDArray[Any], exposure: float, view: str) -> Iterator[Notice]:
    """Yields the notice about objects without visible shading.

    Such objects are clipped to white, or displayed in one or two colours. `color` is the linear colour [n, 3]
    of the objects' pixels.
    """
    brightness, shown = _displayed(color, exposure, view)
    lit = brightness[brightness > 0]
    share = float(_is_white(brightness, shown, view).mean())
    levels = _count_up_to_three(shown)
    if share >= MIN_WHITE_SHARE:
        stops = exposure - math.ceil(math.log2(max(2 * float(np.median(brightness)), 2.0)))
        text = f"{100 * share:.0f} % of the objects' pixels are above 1 and clipped to white; use exposure={stops:g}"
        yield Notice(text, "overexposed")
    elif len(color) >= MIN_PIXELS and levels <= 2 and lit.max() > MIN_CONTRAST * lit.min():
        stops = exposure - round(math.log2(2 * float(np.median(lit))))
        colors = "one colour" if levels == 1 else "two colours"
        text = (
            f"all of the objects' pixels are displayed in {colors}, with no shading; use exposure={stops:g}"
        )
        yield Notice(text, "no_shading")


def _count_up_to_three(colors: npt.NDArray[np.uint8]) -> int:
    """Returns the number of distinct colours of pixels [n, 3], at most 3.

    The function does not sort the colours of large images.
    """
    codes = colors.astype(np.uint32) @ np.array([1 << 16, 1 << 8, 1], dtype=np.uint32)
    others = codes[codes != codes[0]]
    return 1 if not others.size else 2 if (others == others[0]).all() else 3


def _seen(world: World, camera: Camera, planes: Planes, truth: Truth) -> Bools:
    """Returns True [h, w] for pixels whose ray through the centre hits an object.

    Only probed pixels are tested if these pixels suffice.
    """
    for name in ("instance", "triangle"):
        if name in planes:
            return planes[name] >= 0
    for name in ("depth", "distance"):
        if name in planes:
            return np.isfinite(planes[name])
    width, height = camera.size
    columns = np.unique(np.linspace(0, width - 1, PROBES_PER_SIDE).round().astype(int))
    rows = np.unique(np.linspace(0, height - 1, PROBES_PER_SIDE).round().astype(int))
    v, u = (axis.ravel() for axis in np.meshgrid(rows, columns, indexing="ij"))
    origins, directions = camera.rays(np.column_stack([u, v]) + camera.corner + 0.5)
    valid = np.isfinite(directions).all(axis=-1) & np.isfinite(origins).all(axis=-1)
    found = np.zeros((height, width), dtype=bool)
    if valid.any():
        hits = world.cast_rays(origins[valid], directions[valid])
        found[v[valid], u[valid]] = hits["instance"] >= 0
    # An object between the probes may be visible in only a few pixels, and a probe may be in shadow.
    color = planes.get("color")
    return found if found.any() and (color is None or color[found].any()) else truth() >= 0


def _shows_media(world: World, camera: Camera) -> bool:
    """Returns True if the centre of a pixel shows the border of a medium.

    Such borders are not in the ground truth.
    """
    copy = world.copy()
    for number in range(copy._core.object_count):
        material = json.loads(copy._core.material(number, 0)) or {}
        if material.get("model") == "Boundary" and material.get("medium"):
            copy.set_object(number, type="matte")
        else:
            copy.set_object(number, visible=False)
    width, height = camera.size
    v, u = (axis.ravel() for axis in np.mgrid[0:height, 0:width])
    origins, directions = camera.rays(np.column_stack([u, v]) + camera.corner + 0.5)
    valid = np.isfinite(directions).all(axis=-1) & np.isfinite(origins).all(axis=-1)
    return bool((copy.cast_rays(origins[valid], directions[valid])["instance"] >= 0).any())


def _enclosing_object(world: World, camera: Camera, instances: npt.NDArray[Any]) -> str | None:
    """The name of the image's only object if this object contains the camera; otherwise None."""
    shown = np.unique(instances[instances >= 0])
    if len(shown) != 1 or camera.is_parallel:
        return None
    number = int(shown[0])
    inside = world.inside(np.asarray(camera.location, dtype=np.float64), objects=[number])
    return world.objects[number].name if bool(inside) else None


def _place(camera: Camera) -> str:
    return "infinity" if camera.is_parallel else _numbers(camera.location)


def _bounds(world: World) -> str:
    bounds = world.bounds
    return "empty" if bounds is None else f"{_numbers(bounds[0])} to {_numbers(bounds[1])}"


def _numbers(point: npt.NDArray[Any]) -> str:
    return "(" + ", ".join(f"{value:.3g}" for value in point) + ")"
