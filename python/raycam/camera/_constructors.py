"""Constructors of cameras.

Cameras are created from a matrix, a pose, a target, or the parameters of OpenCV, OpenGL and COLMAP.
"""

from __future__ import annotations

from typing import Any, Literal, Self, Unpack

import numpy as np
import numpy.typing as npt

from .. import _core
from ..arguments import Floats, floats, lengths, one_of, product, size_of, word
from ..errors import CameraError
from ._arguments import (
    LensKeys,
    Model,
    PixelCenter,
    Size,
    Up,
    ViewKeys,
    checked_up,
    either_order,
    lens_of,
    make,
    matrix,
    number,
    read_lens,
    read_view,
    vector,
)
from ._geometry import CameraGeometry

__all__ = ["Constructors"]

Axes = Literal["opencv", "opengl", "x_forward"]
OPENCV_FROM = {
    "opencv": np.eye(3),
    "opengl": np.diag([1.0, -1.0, -1.0]),
    "x_forward": np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]]),
}
"""Rotations from other camera axes to OpenCV's camera axes, by the name of the other axes."""


class Constructors(CameraGeometry):
    """Base class of `Camera` with the alternative constructors."""

    __slots__ = ()

    @classmethod
    def from_matrix(
        cls, P: npt.ArrayLike, size: Size, *, pixel_center: PixelCenter = "integer", up: Up = "z"
    ) -> Self:
        """Returns a camera from its matrix `P` [3, 4], of any scale and sign, by RQ decomposition.

        `size` (width, height), `pixel_center` and `up` are as in `Camera`. The centre is the null vector of P. The
        third row of the left 3x3 part, times the sign of its determinant, points forward. The camera has no lens:
        `p.replace(distortion=...)` adds a lens to a camera `p`. Raises `CameraError` for a rank below 3.

        If the left 3x3 part is singular, the centre is at infinity (`center` is its direction). The rays are then
        parallel lines without a starting point, so nothing is behind the camera. Of the two possible directions, the
        rays have the direction for which the image is not mirrored. Depth, which may be negative, is measured from the
        plane through the world's origin. The camera is affine if the last row is 0 0 0 w.

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
        up: Up = "z",
        **view: Unpack[ViewKeys],
    ) -> Self:
        """Returns a camera at `location` [3], rotated by `roll`, `pitch`, `yaw` in degrees.

        Body axes follow ROS REP-103 (x forward, y left, z up), R_world_from_body = Rz(yaw) Ry(pitch) Rx(roll). With
        all angles 0, the camera looks along +x of a z-up world (along -z if `up` is "y"). Positive yaw turns the
        camera left, positive pitch turns it down. The intrinsics are exactly one of `focal` (one number or (fx, fy),
        pixels), `fov` (vertical, degrees) and `K`. `skew` and `principal_point` (default: the image centre) may be
        added to `focal` or `fov`. `distortion` and `model` are the lens, and `size` (default: 640 x 480) and
        `pixel_center` are as in `Camera`. Raises `CameraError` for invalid values.
        """
        k, size, lens, pixel_center = read_view(view)
        angles = [number(name, v) for name, v in (("roll", roll), ("pitch", pitch), ("yaw", yaw))]
        place = vector("location", location)
        return cls._of(make("from_pose", place, angles, checked_up(up), k, size, pixel_center), up, lens)

    @classmethod
    def look_at(
        cls,
        eye: npt.ArrayLike,
        target: npt.ArrayLike,
        up: npt.ArrayLike | Up = "z",
        **view: Unpack[ViewKeys],
    ) -> Self:
        """Returns a camera at `eye` [3] whose principal point shows `target` [3].

        `up` is the world direction that points upwards in the image: "z", "y", or a vector [3] not parallel to the
        viewing direction. The other keywords, such as `fov` and `size`, are as in `from_pose`; the default vertical
        field of view is 45 degrees. Raises `CameraError` for invalid values.
        """
        if all(view.get(name) is None for name in ("focal", "fov", "K")):
            view = {**view, "fov": 45.0}
        k, size, lens, pixel_center = read_view(view)
        if isinstance(up, str):
            axis = checked_up(up)
            upwards = [0.0, 0.0, 1.0] if axis == "z" else [0.0, 1.0, 0.0]
        else:
            upwards = vector("up", up)
            axis = "y" if upwards[0] == upwards[2] == 0.0 and upwards[1] > 0.0 else "z"
        ends = (vector("eye", eye), vector("target", target))
        return cls._of(make("look_at", *ends, upwards, k, size, pixel_center), axis, lens)

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
        """Returns a camera from the results of `cv2.calibrateCamera` and `cv2.solvePnP`.

        `K` are the intrinsics [3, 3] in pixels. `rvec` is the rotation camera_from_world as a Rodrigues vector [3],
        [3, 1] or [1, 3] (axis times angle in radians) or as a matrix [3, 3]; `tvec` [3], [3, 1] or [1, 3] is t = -R C.
        `distortion` are the coefficients of `cv2.calibrateCamera`, or with `model="fisheye"` of
        `cv2.fisheye.calibrate`: [n], [n, 1] or [1, n]. `size`, `pixel_center` and `up` are as in `Camera`. Raises the
        errors of `Camera`.
        """
        k = matrix("K", K).tolist()
        shapes: tuple[tuple[int | str, ...], ...] = ((3,), (3, 1), (1, 3))
        t = floats("tvec", tvec, *shapes, error=CameraError).ravel()
        r = floats("rvec", rvec, *shapes, (3, 3), error=CameraError)
        if r.shape == (3, 3):
            made = make("", k, r.tolist(), (-product(r.T, t)).tolist(), size, pixel_center)
        else:
            made = make("from_opencv", k, r.ravel().tolist(), t.tolist(), size, pixel_center)
        return cls._of(made, up, lens_of(distortion, model))

    @classmethod
    @either_order
    def from_opengl(
        cls,
        K: npt.ArrayLike,
        world_from_camera: npt.ArrayLike,
        size: Size,
        *,
        up: Up = "z",
        **lens: Unpack[LensKeys],
    ) -> Self:
        """Returns a camera from the pose matrix [4, 4] of OpenGL, Blender, pyrender and NeRF.

        The camera axes are x right, y up, z backward, and `world_from_camera` maps camera to world coordinates. `K`
        [3, 3] is in pixels; `size`, `up` and the lens are as in `Camera`. Raises `CameraError` for invalid values. Only
        the axes follow OpenGL: `pixel_center` is "integer" by default. If `K` has cx = width / 2 for the image centre,
        pass `pixel_center="half"`.
        """
        pose = floats("world_from_camera", world_from_camera, (4, 4), error=CameraError).tolist()
        coefficients, pixel_center = read_lens(lens)
        k = matrix("K", K).tolist()
        return cls._of(make("from_opengl", k, pose, size, pixel_center), up, coefficients)

    @classmethod
    @either_order
    def from_transform(
        cls,
        K: npt.ArrayLike,
        world_from_camera: npt.ArrayLike | None = None,
        size: Size | None = None,
        *,
        camera_from_world: npt.ArrayLike | None = None,
        axes: Axes = "opencv",
        up: Up = "z",
        **lens: Unpack[LensKeys],
    ) -> Self:
        """Returns a camera from its pose as a matrix [4, 4] or [3, 4].

        The matrix is given as `world_from_camera` or as `camera_from_world`. `K` [3, 3] is in pixels; `size`, `up` and
        the lens are as in `Camera`. `axes` are the camera axes of the matrix: "opencv" (x right, y down, z forward),
        "opengl" (x right, y up, z backward: Blender, NeRF) or "x_forward" (x forward, y left, z up: ROS bodies, Waymo).
        The positional arguments may be K, pose, size, as in `from_opengl`, or K, size, pose.

        Raises `CameraError` if the size is missing, or if not exactly one matrix is given. Also raises `CameraError`
        if the last row is not 0 0 0 1 (with a hint if the matrix is transposed), or the 3x3 part is not a rotation.
        """
        if size is None:
            raise CameraError("size is missing; expected (width, height) in pixels", code="missing_value")
        given = [value for value in (world_from_camera, camera_from_world) if value is not None]
        if len(given) != 1:
            raise CameraError(
                f"expected either world_from_camera or camera_from_world, got {'both' if given else 'neither'}",
                code="missing_value",
            )
        name = "camera_from_world" if world_from_camera is None else "world_from_camera"
        table = floats(name, given[0], (4, 4), (3, 4), error=CameraError)
        if len(table) == 4 and table[3].tolist() != [0.0, 0.0, 0.0, 1.0]:
            hint = "; the matrix is transposed" if table[:, 3].tolist() == [0.0, 0.0, 0.0, 1.0] else ""
            raise CameraError(
                f"{name} has the last row {table[3]}; expected 0 0 0 1{hint}", code="invalid_matrix"
            )
        return cls._posed(K, size, (table[:3, :3], table[:3, 3]), name, axes, up, lens)

    @classmethod
    @either_order
    def from_x_forward(
        cls,
        K: npt.ArrayLike,
        world_from_camera: npt.ArrayLike,
        size: Size,
        *,
        up: Up = "z",
        **lens: Unpack[LensKeys],
    ) -> Self:
        """Returns a camera from the pose of a body with x forward, y left, z up.

        These are the axes of ROS bodies and of Waymo's cameras. `world_from_camera` is a matrix [4, 4] or [3, 4] that
        maps points in these axes to the world. `K`, `size`, `up` and the lens are as in `from_transform`. With the
        identity, the camera looks along +x of the world, as in `from_pose`. Raises the errors of `from_transform`.
        """
        return cls.from_transform(K, world_from_camera, size, axes="x_forward", up=up, **lens)

    @classmethod
    def from_quaternion(
        cls,
        K: npt.ArrayLike,
        quaternion: npt.ArrayLike,
        translation: npt.ArrayLike,
        size: Size,
        *,
        order: Literal["wxyz", "xyzw"],
        direction: Literal["world_from_camera", "camera_from_world"],
        axes: Axes = "opencv",
        up: Up = "z",
        **lens: Unpack[LensKeys],
    ) -> Self:
        """Returns a camera from a unit quaternion [4] and a translation [3].

        `K` [3, 3] is in pixels; `size`, `up` and the lens are as in `Camera`. `order` is the position of the real part
        of `quaternion`: "wxyz" (COLMAP, Eigen's constructor, nuScenes) or "xyzw" (ROS, TUM, SciPy). `direction` is the
        transform that `quaternion` and `translation` describe: "world_from_camera" (the translation is then the centre)
        or "camera_from_world" (COLMAP). Neither argument has a default, because a wrong guess would go unnoticed.
        `axes` are as in `from_transform`. Raises `CameraError` for a length that differs from 1 by more than 1e-3.
        """
        one_of("order", order, ("wxyz", "xyzw"), error=CameraError)
        one_of("direction", direction, ("world_from_camera", "camera_from_world"), error=CameraError)
        q = floats("quaternion", quaternion, (4,), error=CameraError)
        length = float(lengths(q))
        if abs(length - 1.0) > 1e-3:
            raise CameraError(f"quaternion {q} has length {length:.6g}; expected 1", code="not_a_rotation")
        w, x, y, z = (q if order == "wxyz" else np.roll(q, 1)) / length
        turn = np.array(
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
            ]
        )
        t = np.array(vector("translation", translation))
        return cls._posed(K, size, (turn, t), direction, axes, up, lens)

    @classmethod
    def _posed(
        cls,
        K: npt.ArrayLike,
        size: Size,
        pose: tuple[Floats, Floats],
        direction: str,
        axes: str,
        up: Up,
        keys: LensKeys,
    ) -> Self:
        """Returns a camera from its rotation and translation.

        The pose is between the world and a camera with the given `axes`, in the given `direction`.
        """
        rotation, translation = pose
        lens, pixel_center = read_lens(keys)
        opencv_from_axes = OPENCV_FROM[one_of("axes", axes, list(OPENCV_FROM), error=CameraError)]
        if direction == "world_from_camera":
            R, C = product(opencv_from_axes, rotation.T), translation
        else:
            R, C = product(opencv_from_axes, rotation), -product(rotation.T, translation)
        core = make("", matrix("K", K).tolist(), (R + 0.0).tolist(), (C + 0.0).tolist(), size, pixel_center)
        return cls._of(core, up, lens)

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
        """Returns a camera from a COLMAP camera model and an image's pose.

        `model` is one of COLMAP's names, from SIMPLE_PINHOLE to EQUIRECTANGULAR; `size` and `up` are as in `Camera`.
        `params` are COLMAP's, with the centre of the first pixel at (0.5, 0.5); `pixel_center="integer"` shifts the
        principal point accordingly. `R` [3, 3] and `t` [3] are COLMAP's `cam_from_world`. SIMPLE_PINHOLE and PINHOLE
        become pinholes; SIMPLE_RADIAL, RADIAL, OPENCV and FULL_OPENCV become the lens model "opencv", the FISHEYE
        models "fisheye", and the others lens models of the same name. The property `colmap` returns COLMAP's model and
        parameters. Raises `CameraError` for unknown names and a wrong number of parameters.

        Source: COLMAP, `sensor/models.h`.
        """
        values = np.ravel(floats("params", params, ("n",), error=CameraError)).tolist()
        pose = (matrix("R", R).tolist(), vector("t", t))
        made = make("from_colmap", word("model", model, error=CameraError), values, *pose, size, pixel_center)
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
        """Returns a camera with parallel rays, whose image is `height` world units high.

        The pixels are square. `roll`, `pitch` and `yaw` are as in `from_pose`; with `target` [3], the camera looks at
        this point instead. `size`, `pixel_center` and `up` are as in `Camera`. `location` [3] is the centre of the
        image plane. Rays start on this plane, so surfaces behind it are not visible, and depth is measured from it. The
        last row of `P` is 0 0 0 1. `K` is in pixels per world unit. Raises `CameraError` for invalid values.
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
        """Returns a panorama camera at `location` [3].

        The panorama covers 360 degrees horizontally and 180 degrees vertically. Columns are evenly spaced longitudes,
        rows evenly spaced latitudes. The image centre has the orientation of `from_pose` for `roll`, `pitch` and `yaw`;
        `size`, `pixel_center` and `up` are as in `Camera`. The left and right edges show what is behind the camera. In
        camera axes, longitude is atan2(x, z) and latitude, positive downwards, is atan2(y, hypot(x, z)). Depth is z
        along the axis, negative behind the camera; the channel `distance` contains the ray length. For a part of a
        panorama, create a `Camera` with `model="equirectangular"` and a `K` in pixels per radian.
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
        """Returns a panorama camera at `location` [3] that covers 360 degrees on a cylinder.

        `roll`, `pitch` and `yaw` are as in `from_pose`; `size`, `pixel_center` and `up` are as in `Camera`. The axis of
        the cylinder is the camera's y axis. Columns are longitudes as in `equirectangular`; rows are
        heights y / hypot(x, z) on the cylinder. Pixels are square at the horizon, which is in the middle of the image.
        Vertical lines are straight in the image.
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
