"""The camera: `P = K R [I | -C]`, in the conventions of OpenCV and of Hartley and Zisserman."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from ..errors import CameraError
from ..io.html_form import html_table
from ..io.other_names import no_attribute
from ._arguments import Model, PixelCenter, Size, Up, lens_of, make, matrix, report_nearest_rotation, vector
from ._constructors import Constructors
from ._copies import Copies
from ._geometry import refuse_other_types

if TYPE_CHECKING:
    from ..robots.mounted import MountedCamera
    from ..robots.robot import Robot
    from ..world import World

__all__ = ["Camera", "check_camera"]


class Camera(Constructors, Copies):
    """A camera, immutable; all numbers are float64.

    Camera axes are x right, y down, z forward. A world point X projects to the pixel x = P X with
    `P = K R [I | -C]`; pixel coordinates (u, v) run right and down, and the centre of the first pixel is (0, 0)
    for `pixel_center="integer"` (OpenCV) or (0.5, 0.5) for `"half"` (COLMAP, OpenGL).

    `K` [3, 3] is upper triangular with focal lengths > 0, in pixels: `[[fx, skew, cx], [0, fy, cy], [0, 0, 1]]`.
    `R` [3, 3] is the rotation camera_from_world, `C` [3] the centre in the world. `size` is (width, height).
    `skew` may be given separately if K has none. `up` ("z" or "y") only affects `roll_pitch_yaw`.

    `distortion` are the coefficients of the lens `model`, which is applied between R and K:

    ============================ ==================================================================================
    "opencv"                     4, 5, 8, 12 or 14: `k1 k2 p1 p2 [k3 [k4 k5 k6 [s1 s2 s3 s4 [tau_x tau_y]]]]`
    "fisheye"                    OpenCV's fisheye, Kalibr's equi: `k1 k2 k3 k4` (all 0: equidistant fisheye)
    "thin_prism_fisheye"         COLMAP's: `k1 k2 p1 p2 k3 k4 sx1 sy1`
    "rad_tan_thin_prism_fisheye" COLMAP's, Project Aria's: `k0 k1 k2 k3 k4 k5 p0 p1 s0 s1 s2 s3`
    "fov"                        COLMAP's FOV, Kalibr's fov: `omega`
    "division"                   COLMAP's DIVISION: `k`
    "omni"                       unified, Kalibr's omni, OpenCV's omnidir: `xi` or `xi k1 k2 p1 p2`
    "eucm", "ds"                 enhanced unified `alpha beta`, double sphere `xi alpha`, as in Kalibr
    "equirectangular"            none; see `Camera.equirectangular`
    "cylindrical"                none; see `Camera.cylindrical`
    ============================ ==================================================================================

    Coefficients of "opencv" and "division" that are all 0 mean no lens. A lens model is valid in the region around
    the principal axis in which it is one-to-one; this region may extend behind the camera. `valid` returns its
    pixels. Pixels outside it have no ray (NaN) and show the background; points outside it have no pixel (NaN) and are
    not visible.

    A matrix R that differs from a rotation by at most 1e-3 in an entry is converted to the nearest rotation, with a
    notice.

    Raises `CameraError` if K does not have this form, R is not a rotation (with the deviation), or a number is not
    finite. Also raises `CameraError` if the size is 0 or exceeds 65536 per side or 2^28 pixels, or if the lens model
    requires another number of coefficients.

    Source: Hartley and Zisserman, Multiple View Geometry, 2nd edition, chapter 6; OpenCV's `calib3d` and `fisheye`
    (Kannala and Brandt 2006); COLMAP's `sensor/models.h`; Devernay and Faugeras 2001 (fov); Fitzgibbon 2001
    (division); Mei and Rives 2007 (omni); Khomutenko et al. 2016 (eucm); Usenko et al. 2018 (ds).
    """

    __slots__ = ()

    def __init__(
        self,
        K: npt.ArrayLike,
        R: npt.ArrayLike,
        C: npt.ArrayLike,
        size: Size,
        *,
        skew: float | None = None,
        distortion: npt.ArrayLike | None = None,
        model: Model = "opencv",
        pixel_center: PixelCenter = "integer",
        up: Up = "z",
    ) -> None:
        k = matrix("K", K)
        if skew is not None:
            if k[0, 1] != 0.0:
                raise CameraError(
                    f"skew={skew} and K[0, 1]={k[0, 1]} cannot be combined; pass one of them",
                    code="conflicting_values",
                )
            k[0, 1] = skew
        r = matrix("R", R)
        made = make("", k.tolist(), r.tolist(), vector("C", C), size, pixel_center)
        report_nearest_rotation(r, made)
        self._set(made, up, lens_of(distortion, model))

    def sample(
        self, world: World, *, frame: int = 0, threads: int | None = None, **options: Any
    ) -> dict[str, npt.NDArray[Any]]:
        """Renders `world` and returns the channels' arrays by name.

        This method implements `raycam.Sensor`. `frame`, `threads` and `options` are those of `raycam.render`, which
        returns a `Frame` with the same arrays.
        """
        from ..render import render

        return dict(render(world, self, frame=frame, threads=threads, **options))

    def mounted(
        self,
        robot: Robot,
        link: str,
        R: npt.ArrayLike | None = None,
        C: npt.ArrayLike | None = None,
    ) -> MountedCamera:
        """Returns the camera mounted on a robot's link; its pose follows the robot's joints.

        `robot` is a robot of `World.robots`, and `link` the name of the link. `R` [3, 3] is the rotation
        camera_from_link and `C` [3] the camera's centre in the link's frame, as a hand-eye calibration returns them
        (default: `R` and `C` of this camera). Raises `WorldError` with the nearest name for an unknown link, and
        `CameraError` if R is not a rotation.
        """
        from ..robots.mounted import MountedCamera

        on_link = self.at_pose(self.R if R is None else R, self.location if C is None else C)
        return MountedCamera(Camera._of(on_link._core, on_link._up), robot, link)

    def _require_pinhole(self, what: str) -> None:
        """Raises `CameraError` for cameras that are not completely described by their camera matrix."""
        if self._lens is not None:
            raise CameraError(
                f"{what} requires a pinhole camera, but this camera has lens model {self.model} with distortion "
                f"{self._lens[1]}; pass camera.pinhole()",
                code="unsupported_camera",
            )
        if self.is_parallel:
            raise CameraError(
                f"{what} requires a camera centre C, and this camera has parallel rays",
                code="unsupported_camera",
            )
        if self.shutter is not None:
            raise CameraError(
                f"{what} requires a camera at rest, and this camera moves; pass camera.still()",
                code="unsupported_camera",
            )

    def _repr_html_(self) -> str:
        """The table that a notebook shows."""
        name, *lines = repr(self).split("\n")
        rows = [line.partition(" = ")[::2] for line in re.split(r"\n {4}(?=\S)", "\n".join(lines)[4:])]
        return html_table(name, ("", ""), [(key, " ".join(value.split())) for key, value in rows])

    if not TYPE_CHECKING:  # so that type checkers report missing attributes

        def __getattr__(self, name: str) -> Any:
            """Raises `AttributeError`, with raycam's counterpart for names of other libraries."""
            raise no_attribute(self, name)

    def __repr__(self) -> str:
        """Size, K, R, C, angles and lens as text."""
        with np.printoptions(precision=6, suppress=True, floatmode="maxprec"):
            indent = " " * 8
            k, r = (str(m).replace("\n", "\n" + indent) for m in (self.K, self.R))
            angles = ", ".join(f"{angle:.6g}" for angle in self.roll_pitch_yaw)
            width, height = self.size
            where = (
                f"center = {self.center}, location = {self.location}" if self.is_parallel else f"C = {self.C}"
            )
            lines = [
                f'Camera {width} x {height}, pixel_center="{self.pixel_center}"',
                f"K = {k}",
                f"R = {r}",
                where,
                f"roll, pitch, yaw = {angles} degrees ({self._up} up)",
            ]
            if self._lens is not None:
                lines.append(f"distortion = {self._lens[1]} ({self._lens[0]})")
            if self.background is not None:
                lines.append(f"background = {self.background.image}")
            for name, value in (
                ("aperture", self.aperture),
                ("vignetting", self.vignetting),
                ("shutter", self.shutter),
            ):
                if value is not None:
                    lines.append(f"{name} = {value}")
            return "\n    ".join(lines)


def check_camera(camera: object, hint: str = "") -> Camera:
    """Returns `camera`; raises `SettingsError` with the `hint` unless it is a `Camera`."""
    refuse_other_types(camera, hint)
    assert isinstance(camera, Camera)
    return camera
