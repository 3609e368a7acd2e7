"""Optical flow, scene flow and disparity: what one camera sees, followed to another time and another camera."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import numpy.typing as npt

from .. import _core
from ..camera import Camera
from ..errors import CameraError

if TYPE_CHECKING:
    from ..rig import Rig
    from ..world import World

__all__ = ["disparity", "flow"]

Maps = dict[str, npt.NDArray[Any]]


def flow(
    world: World,
    camera: Camera,
    world2: World | None = None,
    camera2: Camera | None = None,
    *,
    threads: int | None = None,
) -> Maps:
    """Where what `camera` sees of `world` is in `world2`, and where `camera2` sees it there.

    The second world is the first at another time (`world.at(0.5)`), or any with the same objects and triangles; not
    given, it is the first, as is the camera. The surface point at each pixel's exact centre ray keeps its object,
    its triangle and its place on it: rigid and deforming meshes are followed alike, by arithmetic in float64.
    Returns arrays of the size of `camera`:

    ========== ================= ========================================================================== ==========
    flow       float32 [h, w, 2] pixels right and down, from the pixel's centre to the point's new image    NaN
    scene_flow float32 [h, w, 3] how far the point moves in the world, metres                               NaN
    depth      float32 [h, w]     its z along the principal axis of `camera2`, metres                        NaN
    occluded   bool [h, w]        it is inside of the second picture, but something hides it there           False
    outside    bool [h, w]        it is not inside of the second picture                                     False
    ========== ================= ========================================================================== ==========

    The last column is the background's. `flow` is NaN too where `camera2` has no image of the point: behind it, or
    beyond its lens. A point counts as hidden where the second camera's own ray to it meets something nearer by more
    than a millionth of the distance; a point on the far side of its object is hidden by the object.

    Of a world that moves while a camera reads line after line, points are where the lines see them: in the first
    picture, and in the second, where everything moves straight on from one line to the next.

    Raises `WorldError` where the worlds differ in objects or triangles, and where the second camera reads its lines
    while so much moves that the worlds of all lines take more than 2 GiB: about 1 KiB an object, and 128 bytes for each
    vertex and triangle of meshes that bend, for each line.
    """
    second = (world if world2 is None else world2, camera if camera2 is None else camera2)
    return _core.flow((world._core, camera._core), (second[0]._core, second[1]._core), threads)


def disparity(
    world: World,
    left: Camera | Rig,
    right: Camera | None = None,
    *,
    of: Literal["left", "right"] = "left",
    threads: int | None = None,
) -> Maps:
    """The disparity of a rectified pair, x_left - x_right of the same point in pixels, as one of the two sees it.

    The pair are two cameras, or a rig: its first two cameras, left and right. `of` says which of them sees it. Returns
    `disparity` float32 [h, w] (NaN for the background), and `occluded` and `outside` bool [h, w] as `flow` does: what
    the other camera does not see. With focal length f and baseline B it is f B / depth + (cx_left - cx_right).

    Raises `CameraError` where the cameras are no rectified pair: the same rotation, focal lengths, skew and
    row of the principal point, no lens, and the right camera's centre to the right along the x axis of the left one;
    `Rig.rectified` makes one of any two.
    """
    if not isinstance(left, Camera):
        if right is not None:
            raise CameraError("a rig has both cameras of the pair: give the rig alone, or two cameras")
        rig, names = left, left.pair()
        left, right = rig[names[0]], rig[names[1]]
    if right is None:
        raise CameraError("the right camera of the pair is missing")
    if of not in ("left", "right"):
        raise CameraError(f'of is {of!r}; expected "left" or "right", the camera that sees it')
    check_rectified(left, right)
    first, second = (left, right) if of == "left" else (right, left)
    found = flow(world, first, world, second, threads=threads)
    moved = found["flow"][..., 0]
    return {
        "disparity": -moved if of == "left" else moved,
        "occluded": found["occluded"],
        "outside": found["outside"],
    }


def check_rectified(left: Camera, right: Camera) -> None:
    """Raises `CameraError` where two cameras are no rectified pair."""
    for camera in (left, right):
        if camera.is_parallel:
            raise CameraError(
                "not a rectified pair, because of parallel rays; raycam.flow follows any two cameras"
            )
        if camera.shutter is not None:
            raise CameraError(
                "not a rectified pair, because of a shutter: rows of one picture are no rows of the other; "
                "raycam.flow follows any two cameras, and camera.still() stands"
            )
    same = np.ones((3, 3), dtype=bool)
    same[0, 2] = False
    baseline = left.R @ (right.C - left.C)
    reasons = {
        "a lens": left.model != "pinhole" or right.model != "pinhole",
        "different rotations": not np.allclose(left.R, right.R, rtol=0, atol=1e-9),
        "different intrinsics": not np.allclose(left.K[same], right.K[same], rtol=1e-9, atol=1e-9),
        "different conventions of pixel centres": left.pixel_center != right.pixel_center,
        f"the baseline {baseline} in the left camera's axes": not (
            baseline[0] > 0 and np.abs(baseline[1:]).max() <= 1e-9 * baseline[0]
        ),
    }
    found = [reason for reason, there in reasons.items() if there]
    if found:
        raise CameraError(
            f"not a rectified pair, because of {', '.join(found)}; raycam.flow follows any two cameras"
        )
