"""The rectified pair of two cameras (Bouguet's algorithm, as in OpenCV's `stereoRectify`)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from ..arguments import Floats, lengths, product, size_of
from ..camera import Camera
from ..camera._arguments import matrix
from ..errors import CameraError

__all__ = ["rectified"]


def rectified(
    left: Camera, right: Camera, K: npt.ArrayLike | None, size: Sequence[int] | None
) -> dict[str, Camera]:
    """Returns two pinholes at the two cameras' centres, with the same K and rotation.

    The x axis is parallel to the baseline.
    """
    for name, camera in (("left", left), ("right", right)):
        if camera.is_parallel:
            raise CameraError(
                f"the {name} camera has parallel rays, but disparity requires a camera centre",
                code="unsupported_camera",
            )
    left, right = left.still(), right.still()
    R = rotation(left, right)
    shape = left.size if size is None else size_of(size, error=CameraError)
    k = intrinsics(left, right, R, shape) if K is None else matrix("K", K)
    made = {}
    for name, camera in (("left", left), ("right", right)):
        made[name] = Camera(k, R, camera.C, shape, pixel_center=left.pixel_center, up=left.up)
    return made


def rotation(left: Camera, right: Camera) -> Floats:
    """Returns the rotation camera_from_world of both rectified cameras.

    It is halfway between the rotations of the two cameras, and then turned until x is parallel to the baseline.
    """
    looking = [camera.at_pose(camera.R, np.zeros(3)) for camera in (left, right)]
    halfway = looking[0].moving(looking[1], exposure=1.0).R
    baseline = product(halfway, right.C - left.C)
    length = float(lengths(baseline))
    nothing = 1e-12 * (1.0 + float(np.abs(left.C).max()))  # tolerance for the rounding error of the baseline
    if length <= nothing or baseline[0] <= np.abs(baseline[1:]).max():
        raise CameraError(
            f"the second camera must be to the right of the first; its position relative to the first is {baseline}, "
            "in axes halfway between the two cameras' axes (x right, y down, z forward)",
            code="unsupported_camera",
        )
    x, y, z = baseline / length
    # The rotation of b = (x, y, z) to (1, 0, 0) is I + [v] + [v]^2 / (1 + x). [v] is the cross product matrix of
    # v = b x (1, 0, 0), and x is the cosine of the angle.
    cross = np.array([[0.0, y, z], [-y, 0.0, 0.0], [-z, 0.0, 0.0]])
    turn = np.eye(3) + cross + product(cross, cross) / (1.0 + x)
    return product(turn, halfway)


def intrinsics(left: Camera, right: Camera, R: Floats, size: tuple[int, int]) -> Floats:
    """Returns K for both cameras.

    The centres of the old images are, on average, at the centre of the new images.
    """
    focal = (left.K[1, 1] + right.K[1, 1]) / 2.0
    seen = []
    for camera in (left, right):
        _, direction = camera.rays(_middle(camera.size, camera))
        x, y, z = product(R, direction)
        if not z > 0.0:
            raise CameraError(
                "K cannot be computed, because the centre of an original image is behind the rectified cameras; pass K",
                code="unsupported_camera",
            )
        seen.append([focal * x / z, focal * y / z])
    center = _middle(size, left) - np.mean(seen, axis=0)
    return np.array([[focal, 0.0, center[0]], [0.0, focal, center[1]], [0.0, 0.0, 1.0]])


def _middle(size: tuple[int, int], camera: Camera) -> Floats:
    """The pixel coordinates of the middle of an image."""
    return np.array(size) / 2.0 + camera.corner
