"""The ray of a camera with lens distortion or parallel rays, in steps with their numbers."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..camera import Camera
from ..errors import CameraError
from ..reference.units import Floats
from .digits import number, vector

if TYPE_CHECKING:
    from ..world import World

__all__ = ["LensSteps", "at_line", "lens_section", "lens_steps", "world_at_line"]


@dataclass(frozen=True)
class LensSteps:
    """The steps from a pixel to its ray, in float64.

    Camera coordinates have x right, y down and z forward.
    """

    model: str
    """The name of the lens model; "parallel" for parallel rays."""
    coefficients: Floats
    """The coefficients of the lens, [n]."""
    pixel: Floats
    """The centre of the pixel, [2]."""
    image_point: Floats
    """K⁻¹ (u, v, 1) without its third coordinate, [2]: the distorted point of the image plane."""
    undistorted: Floats | None
    """The point of the image plane at z = 1 without the lens, [2]; None for a ray that does not meet this plane."""
    in_camera: Floats
    """The direction of the ray in the camera, [3], of unit length."""
    direction: Floats
    """The direction of the ray in the world, [3]: Rᵀ times `in_camera`."""
    origin: Floats
    """The start of the ray in the world, [3], metres."""
    forward: Floats
    """The principal axis in the world, [3], of unit length."""
    back: Floats
    """The pixel [2] to which the camera projects a point of the ray, for comparison."""
    P: Floats
    """The camera matrix [3, 4] of a pinhole with this origin, this `K`, and this ray through the pixel."""


def at_line(camera: Camera, column: int, row: int) -> Camera:
    """Returns the camera at rest, in the middle of the exposure of the pixel's line.

    A camera without a shutter is returned unchanged.
    """
    if camera.shutter is None:
        return camera
    pixel = np.array([column, row]) + camera.corner + 0.5
    still = camera.still()
    rotation = camera._core.rotations(pixel[None])[0]
    # The ray starts at the centre, or next to it for parallel rays.
    beside = still.R @ (still.rays(pixel)[0] - still.location)
    return still.at_pose(rotation, camera.rays(pixel)[0] - rotation.T @ beside)


def world_at_line(world: World, camera: Camera, pixel: Floats) -> World:
    """Returns the world in the middle of the exposure of the image line at `pixel` [2].

    Without a rolling shutter, the world is returned unchanged.
    """
    if camera.shutter is None or camera.shutter["readout"] == 0:
        return world
    return world._derived(world._core.at_line(camera._core, pixel.tolist()))


def lens_steps(camera: Camera, column: int, row: int) -> LensSteps:
    """Returns the steps from a pixel to its ray.

    Raises `CameraError` if the lens has no ray for the pixel.
    """
    pixel = np.array([column, row]) + camera.corner + 0.5
    origin, direction = camera.rays(pixel)
    if not np.isfinite(direction).all():
        raise CameraError(
            f"pixel ({column}, {row}) has no ray: it is outside the valid region of the lens model "
            f"({camera.model}); camera.valid() returns the pixels with a ray",
            code="out_of_range",
        )
    in_camera = camera.R @ direction
    back, _ = camera.project(origin + direction)
    coefficients = np.zeros(0) if camera.distortion is None else camera.distortion
    return LensSteps(
        model="parallel" if camera.is_parallel else camera.model,
        coefficients=coefficients,
        pixel=pixel,
        image_point=np.linalg.solve(camera.K, np.append(pixel, 1.0))[:2],
        undistorted=in_camera[:2] / in_camera[2] if in_camera[2] > 0 else None,
        in_camera=in_camera,
        direction=direction,
        origin=origin,
        forward=camera.forward,
        back=back,
        P=_pinhole(camera, pixel, origin, direction).P,
    )


def lens_section(steps: LensSteps, C: Floats) -> Iterator[str]:
    """The lines of steps 1 and 2 for a camera with a lens or parallel rays; the ray starts at C."""
    yield ""
    if steps.model == "parallel":
        yield "1. THE RAY OF THE PIXEL: ALL RAYS OF THIS CAMERA ARE PARALLEL"
    else:
        yield f"1. THE RAY OF THE PIXEL, THROUGH THE LENS ({steps.model})"
        yield ""
        yield "   A lens bends rays, so no camera matrix P describes them. Each step is inverted instead:"
        yield "   from the pixel to the distorted point, to the direction without the lens, to the world."
    yield ""
    yield f"   x  = (u, v, 1)                {vector(np.append(steps.pixel, 1.0))}, the centre of the pixel"
    if steps.model != "parallel":
        yield f"   m' = K⁻¹ x                    {vector(steps.image_point)}, the distorted point of the image plane"
        listed = ", ".join(number(each) for each in steps.coefficients)
        yield f"   coefficients                  {listed}"
        if steps.undistorted is not None:
            yield f"   m, whose distortion is m'     {vector(steps.undistorted)}, the undistorted point, at z = 1"
        angle = float(np.degrees(np.arccos(np.clip(steps.in_camera[2], -1, 1))))
        yield f"   d, its direction              {vector(steps.in_camera)}, {number(angle)} degrees off the axis"
    else:
        yield f"   d                             {vector(steps.in_camera)}, the same for every pixel"
    yield f"   r  = Rᵀ d                     {vector(steps.direction)}, in the world, of length 1"
    place = "the origin of the ray" if steps.model == "parallel" else "the camera centre"
    yield f"   C                             {vector(C)}, {place}"
    yield f"   C + r, projected again        {vector(steps.back, 9)}: the same pixel"
    yield "   The ray is f(t) = C + t r, and t, the distance, is greater than 0 in front of the camera."


def _pinhole(camera: Camera, pixel: Floats, origin: Floats, direction: Floats) -> Camera:
    """Returns a pinhole camera at `origin` whose ray through `pixel` has the given `direction`.

    The intrinsics are those of `camera`.
    """
    wanted = camera.R @ direction
    has = np.linalg.solve(camera.K, np.append(pixel, 1.0))
    has /= np.linalg.norm(has)
    middle = wanted + has
    if np.linalg.norm(middle) < 1e-9:  # the directions are opposite: use any half turn that exchanges them
        middle = np.cross(has, [1.0, 0.0, 0.0] if abs(has[0]) < 0.9 else [0.0, 1.0, 0.0])
    middle /= np.linalg.norm(middle)
    half_turn = 2.0 * np.outer(middle, middle) - np.eye(3)  # exchanges the two directions
    mirror = 2.0 * np.outer(has, has) - np.eye(3)  # this matrix leaves `has` unchanged
    left, _, right = np.linalg.svd(mirror @ half_turn @ camera.R)
    return Camera(camera.K, left @ right, origin, camera.size, pixel_center=camera.pixel_center, up=camera.up)
