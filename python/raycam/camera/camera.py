"""The camera: `P = K R [I | -C]`, in the conventions of OpenCV and of Hartley and Zisserman."""

from __future__ import annotations

import json
import os
import re
from typing import TYPE_CHECKING, Any, Literal, Self

import numpy as np
import numpy.typing as npt

from .. import _core
from .._serialization import DictSerializable
from ..arguments import Bools, Floats, floats
from ..errors import CameraError
from ..io.html_form import html_table
from ..io.other_names import no_attribute
from ..notices import understands
from ._arguments import Lens, Model, PixelCenter, Size, Up, checked_up, lens_of, make, matrix, vector
from ._background import Background
from ._constructors import Constructors
from ._copies import Copies
from ._optics import Optics

__all__ = ["Background", "Camera"]


class Camera(Constructors, Copies, Optics, DictSerializable):
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
    "fisheye"                    OpenCV's fisheye, Kalibr's equi: `k1 k2 k3 k4` (0: the equidistant fisheye)
    "thin_prism_fisheye"         COLMAP's: `k1 k2 p1 p2 k3 k4 sx1 sy1`
    "rad_tan_thin_prism_fisheye" COLMAP's, Project Aria's: `k0 k1 k2 k3 k4 k5 p0 p1 s0 s1 s2 s3`
    "fov"                        COLMAP's FOV, Kalibr's fov: `omega`
    "division"                   COLMAP's DIVISION: `k`
    "omni"                       unified, Kalibr's omni, OpenCV's omnidir: `xi` or `xi k1 k2 p1 p2`
    "eucm", "ds"                 enhanced unified `alpha beta`, double sphere `xi alpha`, as in Kalibr
    "equirectangular"            none; see `Camera.equirectangular`
    "cylindrical"                none; see `Camera.cylindrical`
    ============================ ==================================================================================

    Coefficients of "opencv" and "division" that are all 0 mean no lens. A lens model is used around the principal axis
    as far as the model is one-to-one, which may reach behind the camera; `valid` tells which pixels that are. Pixels
    beyond have no ray (NaN) and show the background. Points beyond have no pixel (NaN) and are not visible.

    Raises `CameraError` if K has another form, R is not a rotation (with the deviation), a number is not finite, the
    size is 0 or exceeds 65536 per side or 2^28 pixels, or the number of coefficients does not fit the lens.

    Source: Hartley and Zisserman, Multiple View Geometry, 2nd edition, chapter 6; OpenCV's `calib3d` and `fisheye`
    (Kannala and Brandt 2006); COLMAP's `sensor/models.h`; Devernay and Faugeras 2001 (fov); Fitzgibbon 2001
    (division); Mei and Rives 2007 (omni); Khomutenko et al. 2016 (eucm); Usenko et al. 2018 (ds).
    """

    __slots__ = ("_core", "_lens", "_up")

    @understands(lens="model")
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
                raise CameraError(f"skew is given twice: {skew} and K[0, 1] = {k[0, 1]}")
            k[0, 1] = skew
        made = make("", k.tolist(), matrix("R", R).tolist(), vector("C", C), size, pixel_center)
        self._set(made, up, lens_of(distortion, model))

    def _set(self, core: _core.Camera, up: str, lens: Lens | None) -> None:
        self._core = core.with_lens(*lens) if lens is not None else core
        self._lens = self._core.lens
        self._up = checked_up(up)

    @classmethod
    def _of(cls, core: _core.Camera, up: str, lens: Lens | None = None) -> Self:
        camera = cls.__new__(cls)
        camera._set(core, up, lens)
        return camera

    @classmethod
    def from_dict(cls, description: dict[str, Any], *, up: Up = "z") -> Self:
        """The camera described by a `[camera]` table of a world file, given as a dict such as `to_dict` returns.

        Raises `WorldError` or `CameraError` with the key at fault.
        """
        return cls._of(_core.Camera.from_dict(description, checked_up(up)), up)

    def to_dict(self) -> dict[str, Any]:
        """The camera as a `[camera]` table of a world file; `from_dict` restores the same camera to the last digit."""
        description: dict[str, Any] = json.loads(self._core.to_json())
        return description

    @property
    def K(self) -> Floats:
        """Intrinsics [3, 3] in pixels, `K[2, 2]` = 1."""
        return np.array(self._core.k)

    @property
    def R(self) -> Floats:
        """The rotation camera_from_world [3, 3]."""
        return np.array(self._core.r)

    @property
    def C(self) -> Floats:
        """The centre [3] in the world.

        Raises `CameraError` for a centre at infinity; `center` has the direction of the parallel rays.
        """
        if self.is_parallel:
            raise CameraError(
                "the rays of this camera are parallel: its centre lies at infinity. camera.center is its direction "
                "as a homogeneous point, camera.location where depth counts from"
            )
        return self.location

    @property
    def center(self) -> Floats:
        """The centre as a homogeneous point [4]: (C, 1), or (d, 0) for parallel rays along d."""
        return np.append(self.forward, 0.0) if self.is_parallel else np.append(self.location, 1.0)

    @property
    def location(self) -> Floats:
        """The centre [3] in the world.

        For an orthographic camera, a point of the plane on which rays start. For a matrix with its centre at infinity,
        the world's origin, from which depth is measured.
        """
        return np.array(self._core.c)

    @property
    def is_parallel(self) -> bool:
        """True for parallel rays: an orthographic camera, or a matrix with its centre at infinity."""
        return self._core.center != "point"

    @property
    def t(self) -> Floats:
        """The translation -R C [3]."""
        return np.array(self._core.t)

    @property
    def P(self) -> Floats:
        """The camera matrix K R [I | -C], [3, 4], by which `project` projects if there is no lens."""
        return np.array(self._core.p)

    @property
    def distortion(self) -> Floats | None:
        """The coefficients of the lens as given; None for a pinhole."""
        return None if self._lens is None else np.array(self._lens[1])

    @property
    def model(self) -> Model | Literal["pinhole"]:
        """The name of the lens model."""
        return "pinhole" if self._lens is None else self._lens[0]

    @property
    def colmap(self) -> tuple[str, Floats]:
        """The name and parameters of the equivalent COLMAP model, with COLMAP's pixel centres.

        Raises `CameraError` if COLMAP has no such model: skew, OpenCV's prism and tilt, "omni", "ds", "cylindrical".
        """
        name, params = self._core.colmap()
        return name, np.array(params)

    @property
    def size(self) -> tuple[int, int]:
        """(width, height) in pixels."""
        return self._core.size

    @property
    def pixel_center(self) -> PixelCenter:
        """The centre of the first pixel: "integer" for (0, 0), "half" for (0.5, 0.5)."""
        return self._core.pixel_center

    @property
    def corner(self) -> float:
        """Both pixel coordinates of the picture's top left corner: -0.5 for `pixel_center` "integer", else 0."""
        return -0.5 if self.pixel_center == "integer" else 0.0

    @property
    def up(self) -> Up:
        """The axis of the world that `roll_pitch_yaw` calls up: "z" or "y"."""
        return self._up

    @property
    def background(self) -> Background | None:
        """The picture behind what the camera sees, which `raycam.render` shows where nothing is rendered; or None."""
        found = self._core.background
        if found is None:
            return None
        image, fit, camera = found
        return Background(image, None if camera is None else Camera._of(camera, self._up), fit)

    def with_background(self, background: Background | str | os.PathLike[str] | None) -> Camera:
        """The same camera with a picture behind what it sees: the path of a photograph that it took, or a `Background`.

        Raises `CameraError` for an array, which is for `raycam.render(..., background=array)`.
        """
        if background is None:
            return Camera._of(self._core.with_background(None, False, None), self._up)
        given = background if isinstance(background, Background) else Background(background)
        taker = None if given.camera is None else given.camera._core
        return Camera._of(self._core.with_background(given.file, given.fit == "cover", taker), self._up)

    @property
    def forward(self) -> Floats:
        """The principal axis [3] in the world, of unit length: the third row of R."""
        return np.array(self._core.r[2])

    @property
    def roll_pitch_yaw(self) -> Floats:
        """Roll, pitch and yaw [3] in degrees, as `from_pose` takes them; pitch lies in -90..90.

        For a camera that looks straight up or down, roll is 0 and yaw holds the whole rotation.
        """
        return np.array(self._core.roll_pitch_yaw(self._up)) + 0.0  # no -0

    def project(self, points: npt.ArrayLike) -> tuple[Floats, Bools]:
        """The pixels [n, 2] of world points [n, 3], and True [n] for points in front of the camera.

        A single point [3] gives a pixel [2] and a bool. Behind the camera (depth < 0), the pixel is the intersection of
        the image with the line through point and centre; at depth 0 it is not finite. With a lens, the bool is True if
        the lens has an image of the point (a fisheye may have one of points behind it), and the pixel is NaN otherwise.
        For a matrix with its centre at infinity, all points count as in front. With a rolling shutter, a point appears
        on the line that is open when it shows the point, at the middle of that line's exposure; NaN without such a
        line.
        """
        array = floats("points", points, ("n", 3), (3,))
        pixels, in_front = self._core.project(array.reshape(-1, 3))
        return pixels.reshape((*array.shape[:-1], 2)), in_front.reshape(array.shape[:-1])[()]

    def rays(self, pixels: npt.ArrayLike | None = None) -> tuple[Floats, Floats]:
        """Origins and unit directions [n, 3] in the world of the rays through pixels [n, 2]: the inverse of `project`.

        A single pixel [2] gives two vectors [3]. Without `pixels`, the rays go through all pixel centres: [height,
        width, 3]. The direction is NaN for pixels without a ray (see `valid`). Parallel rays start on the plane through
        `location`. Rays go through the middle of the aperture, at the middle of the line's exposure.
        """
        array = self._centers() if pixels is None else floats("pixels", pixels, ("n", 2), (2,))
        shape = (*array.shape[:-1], 3)
        origins, directions = self._core.rays(array.reshape(-1, 2))
        return origins.reshape(shape), directions.reshape(shape)

    def valid(self, pixels: npt.ArrayLike | None = None) -> Bools:
        """True [n] for pixels [n, 2] with a ray: all pixels without a lens, those in the valid region with one.

        A single pixel [2] gives a bool. Without `pixels`, all pixel centres are tested: [height, width].
        """
        return np.isfinite(self.rays(pixels)[1][..., 0])

    def _centers(self) -> Floats:
        """The pixel coordinates of the centres of all pixels, [height, width, 2]."""
        width, height = self.size
        first = self.corner + 0.5
        array = np.empty((height, width, 2))
        array[..., 0] = np.arange(width) + first
        array[..., 1] = (np.arange(height) + first)[:, None]
        return array

    def _require_pinhole(self, what: str) -> None:
        """Raises `CameraError` for cameras that their camera matrix alone does not describe."""
        if self._lens is not None:
            raise CameraError(
                f"{what} works with the camera matrix P, and this camera has a lens ({self.model}, distortion "
                f"{self._lens[1]}): give it the camera without distortion"
            )
        if self.is_parallel:
            raise CameraError(
                f"{what} starts its rays at the camera centre C, and this camera has parallel rays: its centre lies "
                "at infinity"
            )
        if self.shutter is not None:
            raise CameraError(
                f"{what} works with one camera matrix P, and this camera moves: give it camera.still()"
            )

    def at_pose(self, R: npt.ArrayLike, C: npt.ArrayLike) -> Camera:
        """The same camera at another pose: camera_from_world [3, 3] and centre [3]. A camera's motion moves along."""
        return Camera._of(self._core.at_pose(matrix("R", R).tolist(), vector("C", C)), self._up)

    def _repr_html_(self) -> str:
        """The table that a notebook shows."""
        name, *lines = repr(self).split("\n")
        rows = [line.partition(" = ")[::2] for line in re.split(r"\n {4}(?=\S)", "\n".join(lines)[4:])]
        return html_table(name, ("", ""), [(key, " ".join(value.split())) for key, value in rows])

    if not TYPE_CHECKING:  # type checkers shall see what is missing

        def __getattr__(self, name: str) -> Any:
            """Raises `AttributeError`, which says what is meant by a name of another library."""
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
