"""Images by the lecture's procedure."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from .procedure import (
    Progress,
    camera_center,
    dot,
    length,
    lines,
    pointed_forward,
    points_on_lines,
    third_row_of_r,
    trace,
)
from .units import Floats, Units

if TYPE_CHECKING:
    from ..camera import Camera
    from ..world import World


def pixel_centers(size: tuple[int, int], pixel_center: str = "integer") -> Floats:
    """The centres (u, v) of all pixels, [height * width, 2], row by row.

    `size` is (width, height). The first pixel's centre is (0, 0) for `pixel_center` "integer", (0.5, 0.5) for "half".
    """
    if pixel_center not in ("integer", "half"):
        raise ValueError(f'pixel_center must be "integer" or "half", not {pixel_center!r}')
    width, height = size
    v, u = np.mgrid[0:height, 0:width]
    return np.column_stack([u.ravel(), v.ravel()]) + (0.5 if pixel_center == "half" else 0.0)


def render_triangles(
    triangles: npt.ArrayLike,
    P: npt.ArrayLike,
    size: tuple[int, int],
    *,
    pixel_center: str = "integer",
    colors: npt.ArrayLike | None = None,
    ids: npt.ArrayLike | None = None,
    background: npt.ArrayLike = (0.0, 0.0, 0.0),
    progress: Progress | None = None,
) -> dict[str, npt.NDArray[Any]]:
    """Renders triangles by the lecture's procedure, with one ray through each pixel centre.

    The rays pass exactly through the centres. `triangles` are corners [n, 3, 3] in the world, `P` is the camera matrix
    [3, 4], finite, of rank 3, of any scale and sign. `size` is (width, height). `colors` [n, 3] are linear RGB per
    triangle (default white), `ids` [n, 2] are (instance, triangle) (default: instance 0 and the index in `triangles`).
    `progress(done, total)` is called with the number of finished pixels; an exception that it raises stops rendering.

    Returns arrays [height, width, ...]:

    ============ ======= ========================================================================== ==========
    color        float32 [..., 3], linear RGB of the closest triangle                               background
    depth        float64 z of the hit point along the principal axis, in units of the world          +inf
    distance     float64 from the camera centre to the hit point, in units of the world              +inf
    position     float64 [..., 3], the hit point in the world                                        NaN
    instance     int32   first column of `ids`                                                       -1
    triangle     int32   second column of `ids`                                                      -1
    t            float64 the lecture's t, in lengths of r (which differ from pixel to pixel)         +inf
    next_t       float64 the t of the second closest triangle                                        +inf
    ============ ======= ========================================================================== ==========

    Raises ValueError if an array has the wrong shape or is not finite, or if P has no camera centre.
    """
    corners = _floats("triangles", triangles, (-1, 3, 3))
    matrix = _floats("P", P, (3, 4))
    rgb = np.ones((len(corners), 3)) if colors is None else _floats("colors", colors, (len(corners), 3))
    if ids is None:
        ids = np.column_stack([np.zeros(len(corners)), np.arange(len(corners))])
    names = np.asarray(ids, dtype=np.int32).reshape(len(corners), 2)

    units = Units.for_world(corners.reshape(-1, 3), camera_center(matrix))
    matrix = units.camera(matrix)
    C = camera_center(matrix)
    forward = third_row_of_r(matrix)
    X = points_on_lines(matrix, pixel_centers(size, pixel_center))
    r = pointed_forward(lines(X, C), forward)
    seen = trace(units.points(corners), C, r, progress)

    hit = seen.index >= 0
    t = np.where(hit, seen.t, 0.0)
    f = C + t[:, None] * r
    row = np.where(hit, seen.index, 0)
    last = np.zeros((1, 3))  # a placeholder, so that worlds without triangles can be indexed
    color = np.where(hit[:, None], np.vstack([rgb, last])[row], _floats("background", background, (3,)))
    name = np.where(hit[:, None], np.vstack([names, last.astype(np.int32)[:, :2]])[row], -1)

    def image(values: npt.NDArray[Any], dtype: npt.DTypeLike) -> npt.NDArray[Any]:
        return values.reshape(size[1], size[0], *values.shape[1:]).astype(dtype)

    def where_hit(values: Floats, miss: float) -> Floats:
        return np.where(hit.reshape(-1, *[1] * (values.ndim - 1)), values, miss)

    return {
        "color": image(color, np.float32),
        "depth": image(where_hit((t * dot(r, forward)) * units.scale, np.inf), np.float64),
        "distance": image(where_hit(t * length(r) * units.scale, np.inf), np.float64),
        "position": image(where_hit(units.origin + f * units.scale, np.nan), np.float64),
        "instance": image(name[:, 0], np.int32),
        "triangle": image(name[:, 1], np.int32),
        "t": image(seen.t, np.float64),
        "next_t": image(seen.next_t, np.float64),
    }


def render(world: World, camera: Camera, progress: Progress | None = None) -> dict[str, npt.NDArray[Any]]:
    """Renders a :class:`raycam.World` with a :class:`raycam.Camera` by `render_triangles`.

    A triangle has one colour: its object's, its face's, or the mean of its vertex colours. `progress` is as in
    `render_triangles`. Raises :class:`raycam.CameraError` for a camera with lens distortion, which P cannot express.
    """
    camera._require_pinhole("the reference")
    return render_triangles(
        world.triangles(),
        camera.P,
        camera.size,
        pixel_center=camera.pixel_center,
        colors=world.triangle_colors(),
        ids=world.triangle_ids(),
        background=background(world),
        progress=progress,
    )


def background(world: World) -> Floats:
    """Linear RGB [3] of a pixel without a hit: the sum of the uniform skies.

    Other skies count as black.
    """
    skies = [light["radiance"] for light in world.lights if light["type"] == "sky" and "radiance" in light]
    return np.asarray(np.sum(np.asarray(skies, dtype=np.float64).reshape(-1, 3), axis=0))


def _floats(name: str, values: npt.ArrayLike, shape: tuple[int, ...]) -> Floats:
    array = np.asarray(values, dtype=np.float64)
    fits = array.ndim == len(shape) and all(w in (-1, n) for w, n in zip(shape, array.shape, strict=True))
    if not fits:
        wanted = ", ".join("n" if side == -1 else str(side) for side in shape)
        raise ValueError(f"{name} must be [{wanted}], not {list(array.shape)}")
    if not np.isfinite(array).all():
        raise ValueError(
            f"{name} must be finite, but contains NaN or infinite values "
            f"({np.count_nonzero(~np.isfinite(array))} of {array.size})"
        )
    return array
