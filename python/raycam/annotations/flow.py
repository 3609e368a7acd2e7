"""Optical flow, scene flow and disparity between two images.

These maps specify the positions of one image's surface points in another image.
"""

from __future__ import annotations

import os
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from .. import _core
from ..arguments import product, thread_count
from ..camera import Camera
from ..errors import CameraError
from ..render.arguments import camera_of, world_of
from ..rig import Rig
from ..world import World

__all__ = ["disparity", "flow"]

Maps = dict[str, npt.NDArray[Any]]


def flow(
    world: World | str | os.PathLike[str],
    camera: Camera | str | os.PathLike[str] | None = None,
    world2: World | str | os.PathLike[str] | None = None,
    camera2: Camera | str | os.PathLike[str] | None = None,
    *,
    threads: int | None = None,
) -> Maps:
    """Returns the optical flow and the scene flow between two images.

    The first image shows `world` through `camera`, the second image `world2` through `camera2`. `world2` is `world`
    at another time (`world.at(0.5)`), or any world with the same objects and triangles. `world2` and `camera2`
    default to `world` and `camera`. `threads` is the number of threads (default: all). The surface point on each
    pixel's centre ray is identified by its object, triangle and barycentric coordinates, so rigid and deforming
    meshes are both followed, in float64. Returns arrays of the size of `camera`:

    ========== ================= ========================================================================== ==========
    flow       float32 [h, w, 2] pixels right and down, from the pixel's centre to the point's new image    NaN
    scene_flow float32 [h, w, 3] motion of the point in the world, metres                                   NaN
    depth      float32 [h, w]    z of the point along the principal axis of `camera2`, metres               NaN
    occluded   bool [h, w]       the point is inside the second image, but hidden there                   False
    outside    bool [h, w]       the point is not inside the second image                                 False
    ========== ================= ========================================================================== ==========

    The last column is the value of pixels that show the background. `flow` is also NaN if `camera2` cannot project
    the point: behind the camera, or outside its lens model's valid region. A point is occluded if the second camera's
    ray to it hits a surface that is closer by more than 1e-6 of the distance. A point on the far side of its own
    object is occluded too.

    With a rolling shutter, each line shows the world at its own time, in both images. In the second image, points
    move linearly between the times of two lines.

    Raises `WorldError` if the worlds differ in objects or triangles. If the second camera has a rolling shutter, each
    line requires its own copy of the moving parts. A copy has about 1 KiB per object, and 128 bytes per vertex and
    triangle of deforming meshes. If all copies together exceed 2 GiB, `WorldError` is raised, too.
    """
    world = world_of(world)
    camera = camera_of(world, camera)
    world2 = None if world2 is None else world_of(world2)
    camera2 = None if camera2 is None else camera_of(world2 or world, camera2)
    second = (world if world2 is None else world2, camera if camera2 is None else camera2)
    return _core.flow((world._core, camera._core), (second[0]._core, second[1]._core), thread_count(threads))


def disparity(
    world: World | str | os.PathLike[str],
    left: Camera | Rig | str | os.PathLike[str],
    right: Camera | str | os.PathLike[str] | None = None,
    *,
    of: Literal["left", "right"] = "left",
    threads: int | None = None,
) -> Maps:
    """Returns the disparity of a rectified pair, in the image of one of its cameras.

    The disparity is x_left - x_right in pixels. The pair is two cameras `left` and `right`, or a rig, of which the
    first two cameras are used; both may be given as names in the world or as paths. `of` selects the image, "left" or
    "right". Returns `disparity` float32 [h, w] (NaN for the background), and `occluded` and `outside` bool [h, w] for
    the other camera, as in `flow`. With focal length f and baseline B, the disparity is f B / depth + (cx_left -
    cx_right). `threads` is the number of threads (default: all).

    Raises `CameraError` if the cameras are not a rectified pair. Both cameras of
    a rectified pair have the same rotation, focal lengths, skew and principal point row, and no lens. The right
    camera is displaced along the x axis of the left camera. `Rig.rectified` creates such a pair from any two cameras.
    """
    world = world_of(world)
    if isinstance(left, str) and left in world.rigs:
        left = world.rigs[left]
    if isinstance(left, Rig):
        if right is not None:
            raise CameraError(
                "right cannot be combined with a rig, which contains both cameras of the pair; omit right, or pass two "
                "cameras",
                code="conflicting_values",
            )
        rig = left
        left, right = (rig[name] for name in rig.pair())
    left = camera_of(world, left)
    if right is None:
        raise CameraError(
            "right is missing; pass the right camera of the pair, or a rig", code="missing_value"
        )
    right = camera_of(world, right)
    if not isinstance(of, str) or of not in ("left", "right"):
        raise CameraError(
            f'of={of!r}: expected "left" or "right", the camera whose image is computed',
            code="invalid_value",
        )
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
    """Raises `CameraError` if two cameras are not a rectified pair."""
    for camera in (left, right):
        if camera.is_parallel:
            raise CameraError(
                "not a rectified pair, because the rays are parallel; raycam.flow supports any two cameras",
                code="unsupported_camera",
            )
        if camera.shutter is not None:
            raise CameraError(
                "not a rectified pair, because a camera has a shutter (motion blur or a rolling shutter), so the rows "
                "of the two images do not correspond; raycam.flow supports any two cameras, and camera.still() returns "
                "the camera at rest",
                code="unsupported_camera",
            )
    same = np.ones((3, 3), dtype=bool)
    same[0, 2] = False
    baseline = product(left.R, right.C - left.C)
    reasons = {
        "a lens model": left.model != "pinhole" or right.model != "pinhole",
        "different rotations": not np.allclose(left.R, right.R, rtol=0, atol=1e-9),
        "different intrinsics": not np.allclose(left.K[same], right.K[same], rtol=1e-9, atol=1e-9),
        "different values of pixel_center": left.pixel_center != right.pixel_center,
        f"the right camera's position {baseline} in the left camera's axes (expected: x > 0, y = z = 0)": not (
            baseline[0] > 0 and np.abs(baseline[1:]).max() <= 1e-9 * baseline[0]
        ),
    }
    found = [reason for reason, there in reasons.items() if there]
    if found:
        raise CameraError(
            f"not a rectified pair, because of {', '.join(found)}; raycam.flow supports any two cameras",
            code="unsupported_camera",
        )
