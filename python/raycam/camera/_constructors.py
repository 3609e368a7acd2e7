"""Constructors of cameras: from a matrix, a pose, a target, or the parameters of OpenCV, OpenGL and COLMAP."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from .. import _core
from ..arrays import floats, size_of
from ..errors import CameraError
from ._arguments import (
    Lens,
    Model,
    PixelCenter,
    Size,
    Up,
    checked_up,
    intrinsics,
    lens_of,
    make,
    matrix,
    number,
    vector,
)

__all__ = ["Constructors"]


class Constructors:
    """Alternative constructors of `Camera`."""

    __slots__ = ()

    @classmethod
    def _of(cls, core: _core.Camera, up: str, lens: Lens | None = None) -> Self:
        raise NotImplementedError

    @classmethod
    def from_matrix(
        cls, P: npt.ArrayLike, size: Size, *, pixel_center: PixelCenter = "integer", up: Up = "z"
    ) -> Self:
        """A camera from its 3x4 matrix, of any scale and sign, by RQ decomposition.

        The centre is the null vector of P. The third row of the left 3x3 part, times the sign of its determinant,
        points forward. The camera has no lens: `Camera(p.K, p.R, p.C, p.size, distortion=...)` adds one to a camera
        `p`. Raises `CameraError` for a rank below 3.

        If the left 3x3 part is singular, the centre lies at infinity (`center` is its direction) and rays are parallel
        lines without an origin, so that everything is visible. The camera is affine if the last row is 0 0 0 w. The
        direction of the rays is the one in which the picture is not mirrored. Depth, which may be negative, is measured
        from the plane through the world's origin.

        Source: Hartley and Zisserman, sections 6.2.3, 6.2.4 and 6.3.
        """
        p = floats("P", P, (3, 4), error=CameraError)
        return cls._of(make("from_matrix", p.tolist(), size, pixel_center), up)

    @classmethod
    def from_pose(
        cls,
        location: npt.ArrayLike,
        roll: float = 0.0,
        pitch: float = 0.0,
        yaw: float = 0.0,
        *,
        size: Size = (640, 480),
        focal: float | Sequence[float] | None = None,
        fov: float | None = None,
        K: npt.ArrayLike | None = None,
        skew: float | None = None,
        principal_point: npt.ArrayLike | None = None,
        distortion: npt.ArrayLike | None = None,
        model: Model = "opencv",
        pixel_center: PixelCenter = "integer",
        up: Up = "z",
    ) -> Self:
        """A camera at `location` [3], turned by `roll`, `pitch`, `yaw` in degrees.

        Body axes follow ROS REP-103 (x forward, y left, z up), R_world_from_body = Rz(yaw) Ry(pitch) Rx(roll). With all
        angles 0, the camera looks along +x of a z-up world (along -z if `up` is "y"). Positive yaw turns left, positive
        pitch looks down. Intrinsics are exactly one of `focal` (pixels: one or (fx, fy)), `fov` (vertical, degrees) and
        `K`; `skew` and `principal_point` (default: the centre of the image) go with the first two; `distortion` and
        `model` are the lens, as in `Camera`.
        """
        k = intrinsics(size, focal, fov, K, skew, principal_point, pixel_center)
        angles = [number(name, v) for name, v in (("roll", roll), ("pitch", pitch), ("yaw", yaw))]
        place = vector("location", location)
        made = make("from_pose", place, angles, checked_up(up), k, size, pixel_center)
        return cls._of(made, up, lens_of(distortion, model))

    @classmethod
    def look_at(
        cls,
        eye: npt.ArrayLike,
        target: npt.ArrayLike,
        up: npt.ArrayLike | Up = "z",
        *,
        size: Size = (640, 480),
        focal: float | Sequence[float] | None = None,
        fov: float | None = None,
        K: npt.ArrayLike | None = None,
        skew: float | None = None,
        principal_point: npt.ArrayLike | None = None,
        distortion: npt.ArrayLike | None = None,
        model: Model = "opencv",
        pixel_center: PixelCenter = "integer",
    ) -> Self:
        """A camera at `eye` [3] that sees `target` [3] at its principal point.

        `up` is the world direction that points upwards in the picture: "z", "y", or a vector [3] not parallel to the
        view. Intrinsics and lens are as in `from_pose`; the default vertical field of view is 45 degrees.
        """
        if focal is None and fov is None and K is None:
            fov = 45.0
        k = intrinsics(size, focal, fov, K, skew, principal_point, pixel_center)
        if isinstance(up, str):
            axis = checked_up(up)
            upwards = [0.0, 0.0, 1.0] if axis == "z" else [0.0, 1.0, 0.0]
        else:
            upwards = vector("up", up)
            axis = "y" if upwards[0] == upwards[2] == 0.0 and upwards[1] > 0.0 else "z"
        ends = (vector("eye", eye), vector("target", target))
        made = make("look_at", *ends, upwards, k, size, pixel_center)
        return cls._of(made, axis, lens_of(distortion, model))

    @classmethod
    def from_opencv(
        cls,
        K: npt.ArrayLike,
        rvec: npt.ArrayLike,
        tvec: npt.ArrayLike,
        size: Size,
        distortion: npt.ArrayLike | None = None,
        *,
        model: Model = "opencv",
        pixel_center: PixelCenter = "integer",
        up: Up = "z",
    ) -> Self:
        """A camera from the results of `cv2.calibrateCamera` and `cv2.solvePnP`.

        `rvec` is the rotation camera_from_world as a Rodrigues vector [3], [3, 1] or [1, 3] (axis times angle in
        radians) or as a matrix [3, 3]; `tvec` [3], [3, 1] or [1, 3] is t = -R C. `distortion` are the coefficients
        of `cv2.calibrateCamera`, or with `model="fisheye"` of `cv2.fisheye.calibrate`, in any shape.
        """
        k = matrix("K", K).tolist()
        shapes: tuple[tuple[int | str, ...], ...] = ((3,), (3, 1), (1, 3))
        t = floats("tvec", tvec, *shapes, error=CameraError).ravel()
        r = floats("rvec", rvec, *shapes, (3, 3), error=CameraError)
        if r.shape == (3, 3):
            made = make("", k, r.tolist(), (-r.T @ t).tolist(), size, pixel_center)
        else:
            made = make("from_opencv", k, r.ravel().tolist(), t.tolist(), size, pixel_center)
        return cls._of(made, up, lens_of(distortion, model))

    @classmethod
    def from_opengl(
        cls,
        K: npt.ArrayLike,
        world_from_camera: npt.ArrayLike,
        size: Size,
        *,
        distortion: npt.ArrayLike | None = None,
        model: Model = "opencv",
        pixel_center: PixelCenter = "integer",
        up: Up = "z",
    ) -> Self:
        """A camera from the pose matrix [4, 4] of OpenGL, Blender, pyrender and NeRF.

        The camera axes are x right, y up, z backward, and the matrix maps camera to world coordinates. `K` is in
        pixels; the lens is as in `Camera`.
        """
        pose = floats("world_from_camera", world_from_camera, (4, 4), error=CameraError)
        k = matrix("K", K).tolist()
        made = make("from_opengl", k, pose.tolist(), size, pixel_center)
        return cls._of(made, up, lens_of(distortion, model))

    @classmethod
    def from_colmap(
        cls,
        model: str,
        params: npt.ArrayLike,
        R: npt.ArrayLike,
        t: npt.ArrayLike,
        size: Size,
        *,
        pixel_center: PixelCenter = "half",
        up: Up = "z",
    ) -> Self:
        """A camera from one of COLMAP's models, SIMPLE_PINHOLE to EQUIRECTANGULAR, with the pose of an image.

        `params` are COLMAP's, with the centre of the first pixel at (0.5, 0.5); `pixel_center="integer"` shifts the
        principal point accordingly. `R` [3, 3] and `t` [3] are COLMAP's `cam_from_world`. SIMPLE_PINHOLE and PINHOLE
        become pinholes, SIMPLE_RADIAL, RADIAL, OPENCV and FULL_OPENCV the lens "opencv", the FISHEYE models "fisheye",
        the others lenses of their own names. `colmap` returns the model. Raises `CameraError` for other names and
        numbers of parameters.

        Source: COLMAP, `sensor/models.h`.
        """
        values = np.ravel(floats("params", params, ("n",), error=CameraError)).tolist()
        pose = (matrix("R", R).tolist(), vector("t", t))
        made = make("from_colmap", model, values, *pose, size, pixel_center)
        return cls._of(made, up)

    @classmethod
    def orthographic(
        cls,
        location: npt.ArrayLike,
        roll: float = 0.0,
        pitch: float = 0.0,
        yaw: float = 0.0,
        *,
        height: float,
        target: npt.ArrayLike | None = None,
        size: Size = (640, 480),
        pixel_center: PixelCenter = "integer",
        up: Up = "z",
    ) -> Self:
        """A camera with parallel rays and square pixels, whose picture is `height` world units high.

        The orientation is as in `from_pose`, or towards `target` [3]. `location` [3] is the middle of the picture. Rays
        start on the image plane through `location`: surfaces behind the plane are not visible, and depth is measured
        from it. The last row of `P` is 0 0 0 1. `K` is in pixels per world unit.
        """
        pose: dict[str, Any] = {"location": vector("location", location)}
        if target is None:
            pose |= {"roll": number("roll", roll), "pitch": number("pitch", pitch), "yaw": number("yaw", yaw)}
        else:
            pose["target"] = vector("target", target)
        table = {"projection": "orthographic", "height": number("height", height), **pose}
        return cls._described(table, size, pixel_center, up)

    @classmethod
    def equirectangular(
        cls,
        location: npt.ArrayLike,
        roll: float = 0.0,
        pitch: float = 0.0,
        yaw: float = 0.0,
        *,
        size: Size = (1024, 512),
        pixel_center: PixelCenter = "integer",
        up: Up = "z",
    ) -> Self:
        """A panorama of all directions from `location` [3]: 360 degrees across, 180 down.

        Columns are evenly spaced longitudes, rows evenly spaced latitudes. The orientation of the middle of the picture
        is as in `from_pose`; the left and right edges look backwards. In camera axes, longitude is atan2(x, z) and
        latitude, positive downwards, is atan2(y, hypot(x, z)). Depth is z along the axis, negative behind the camera;
        the channel `distance` has the ray length. Part of a panorama is a camera with `model="equirectangular"` and a
        `K` in pixels per radian.
        """
        return cls._panorama("equirectangular", location, (roll, pitch, yaw), size, pixel_center, up)

    @classmethod
    def cylindrical(
        cls,
        location: npt.ArrayLike,
        roll: float = 0.0,
        pitch: float = 0.0,
        yaw: float = 0.0,
        *,
        size: Size = (1024, 256),
        pixel_center: PixelCenter = "integer",
        up: Up = "z",
    ) -> Self:
        """A panorama on a cylinder around the camera's y axis, from `location` [3]: 360 degrees across.

        Columns are longitudes as in `equirectangular`; rows are heights y / hypot(x, z) on the cylinder. Pixels are
        square at the horizon, in the middle of the picture. Vertical lines stay straight.
        """
        return cls._panorama("cylindrical", location, (roll, pitch, yaw), size, pixel_center, up)

    @classmethod
    def _panorama(
        cls,
        model: str,
        location: npt.ArrayLike,
        angles: tuple[float, float, float],
        size: Size,
        pixel_center: PixelCenter,
        up: Up,
    ) -> Self:
        named = zip(("roll", "pitch", "yaw"), angles, strict=True)
        turned = {name: number(name, value) for name, value in named}
        table = {"lens": model, "location": vector("location", location), **turned}
        return cls._described(table, size, pixel_center, up)

    @classmethod
    def _described(cls, table: dict[str, Any], size: Size, pixel_center: PixelCenter, up: Up) -> Self:
        whole = size_of(size, error=CameraError)
        table |= {"size": list(whole), "pixel_center": pixel_center}
        return cls._of(_core.Camera.from_dict(table, checked_up(up)), up)
