"""The geometry of a camera: intrinsics, pose and lens.

These determine the maps between points, pixels and rays.
"""

from __future__ import annotations

import json
from typing import Any, Literal, Self

import numpy as np
import numpy.typing as npt

from .. import _core
from .._serialization import DictSerializable
from ..arguments import Bools, Floats, floats
from ..errors import CameraError, SettingsError
from ..read_only import read_only_array
from ._arguments import Lens, Model, PixelCenter, Up, checked_up, matrix, vector

__all__ = ["CameraGeometry", "refuse_other_types"]


class CameraGeometry(DictSerializable):
    """Base class of `Camera` with the properties and maps that its matrix and lens define."""

    __slots__ = ("_core", "_lens", "_up")

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
        """Returns the camera that a `[camera]` table of a world file describes.

        `description` is the table as a dict (see `to_dict`), and `up` is the world's up axis. Raises `WorldError` or
        `CameraError` with the name of the invalid key.
        """
        return cls._of(_core.Camera.from_dict(description, checked_up(up)), up)

    def to_dict(self) -> dict[str, Any]:
        """Returns the camera as a `[camera]` table of a world file.

        `from_dict` restores the camera exactly from this table.
        """
        description: dict[str, Any] = json.loads(self._core.to_json())
        return description

    @property
    def K(self) -> Floats:
        """Intrinsics [3, 3] in pixels, `K[2, 2]` = 1."""
        return _fixed(self._core.k, "camera.replace(K=...)")

    @property
    def R(self) -> Floats:
        """The rotation camera_from_world [3, 3]."""
        return _fixed(self._core.r, "camera.replace(R=...)")

    @property
    def C(self) -> Floats:
        """The centre [3] in the world.

        Raises `CameraError` for a centre at infinity; `center` has the direction of the parallel rays.
        """
        if self.is_parallel:
            raise CameraError(
                "this camera has parallel rays, so its centre is at infinity; camera.center is its direction "
                "as a homogeneous point, camera.location the point with depth 0",
                code="unsupported_camera",
            )
        return self.location

    @property
    def center(self) -> Floats:
        """The centre as a homogeneous point [4]: (C, 1), or (d, 0) for parallel rays along d."""
        center = np.append(self.forward, 0.0) if self.is_parallel else np.append(self.location, 1.0)
        return _fixed(center, "camera.replace(C=...)")

    @property
    def location(self) -> Floats:
        """The centre [3] in the world.

        For an orthographic camera, this is a point of the plane on which its rays start. For a camera from a matrix
        with its centre at infinity, it is the world's origin, from which depth is measured.
        """
        return _fixed(self._core.c, "camera.replace(C=...)")

    @property
    def is_parallel(self) -> bool:
        """True for a camera with parallel rays.

        Such a camera is orthographic, or has a matrix with its centre at infinity.
        """
        return self._core.center != "point"

    @property
    def t(self) -> Floats:
        """The translation -R C [3]."""
        return _fixed(self._core.t, "camera.replace(C=...)")

    @property
    def pose(self) -> Floats:
        """The pose world_from_camera [4, 4].

        The camera axes are x right, y down, z forward. See `raycam.Sensor`.
        """
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = self.R.T, self.location
        return _fixed(pose, "camera.at_pose(R, C)")

    @property
    def P(self) -> Floats:
        """The camera matrix K R [I | -C], [3, 4], which `project` uses for a camera without a lens."""
        return _fixed(self._core.p, "camera.replace(K=..., R=..., C=...)")

    @property
    def distortion(self) -> Floats | None:
        """The coefficients of the lens as given; None for a pinhole."""
        return None if self._lens is None else _fixed(self._lens[1], "camera.replace(distortion=...)")

    @property
    def model(self) -> Model | Literal["pinhole"]:
        """The name of the lens model."""
        return "pinhole" if self._lens is None else self._lens[0]

    @property
    def colmap(self) -> tuple[str, Floats]:
        """The name and parameters of the equivalent COLMAP model, with COLMAP's pixel centres.

        Raises `CameraError` if COLMAP has no such model: for skew, OpenCV's prism and tilt coefficients, and the lens
        models "omni", "ds" and "cylindrical".
        """
        name, params = self._core.colmap()
        return name, _fixed(params, "raycam.Camera.from_colmap(...)")

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
        """The value of both pixel coordinates at the image's top left corner: -0.5 or 0.

        The value is -0.5 for `pixel_center="integer"` and 0 for `"half"`.
        """
        return -0.5 if self.pixel_center == "integer" else 0.0

    @property
    def up(self) -> Up:
        """The world's up axis for `roll_pitch_yaw`: "z" or "y"."""
        return self._up

    @property
    def forward(self) -> Floats:
        """The principal axis [3] in the world, of unit length: the third row of R."""
        return _fixed(self._core.r[2], "camera.replace(R=...)")

    @property
    def roll_pitch_yaw(self) -> Floats:
        """Roll, pitch and yaw [3] in degrees, as in `from_pose`; pitch is in -90..90.

        For a camera that looks straight up or down, roll is 0 and yaw contains the whole rotation.
        """
        angles = np.array(self._core.roll_pitch_yaw(self._up)) + 0.0  # turns -0.0 into 0.0
        return _fixed(angles, "raycam.Camera.from_pose(location, roll, pitch, yaw, ...)")

    def project(self, points: npt.ArrayLike) -> tuple[Floats, Bools]:
        """Returns the pixels [n, 2] of world `points` [n, 3], and whether each point is in front.

        The second array [n] is True for points in front of the camera. A single point [3] returns a pixel [2]
        and a bool. For a point behind the camera (depth < 0), the pixel is the intersection of the image
        plane with the line through point and centre; at depth 0 it is not finite. With a lens, the bool is
        True if the lens projects the point (a fisheye also projects some points behind it), and the pixel is
        NaN otherwise. For a camera with its centre at infinity, all points count as in front. With a rolling
        shutter, the pixel is on the line that shows the point at the middle of that line's exposure; NaN if
        there is no such line.
        """
        array = floats("points", points, ("n", 3), (3,))
        pixels, in_front = self._core.project(array.reshape(-1, 3))
        return pixels.reshape((*array.shape[:-1], 2)), in_front.reshape(array.shape[:-1])[()]

    def rays(self, pixels: npt.ArrayLike | None = None) -> tuple[Floats, Floats]:
        """Returns the rays through pixels [n, 2]: origins and unit directions [n, 3] in the world.

        This is the inverse of `project`. A single pixel [2] returns two vectors [3]. Without `pixels`, the rays of all
        pixel centres are returned: [height, width, 3]. The direction is NaN for pixels without a ray (see `valid`).
        Parallel rays start on the plane through `location`. Rays pass through the centre of the aperture, at the middle
        of the line's exposure.
        """
        array = self._centers() if pixels is None else floats("pixels", pixels, ("n", 2), (2,))
        shape = (*array.shape[:-1], 3)
        origins, directions = self._core.rays(array.reshape(-1, 2))
        return origins.reshape(shape), directions.reshape(shape)

    def valid(self, pixels: npt.ArrayLike | None = None) -> Bools:
        """Returns True [n] for pixels [n, 2] with a ray.

        Without a lens, all pixels have a ray; with a lens, only the pixels inside the lens's valid region
        have one. A single pixel [2] returns a bool. Without `pixels`, all pixel centres are tested: [height,
        width].
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

    def at_pose(self, R: npt.ArrayLike, C: npt.ArrayLike) -> Self:
        """Returns the camera, with its motion, at another pose.

        `R` is camera_from_world [3, 3], and `C` is the centre [3].
        """
        return self._of(self._core.at_pose(matrix("R", R).tolist(), vector("C", C)), self._up)


def _fixed(values: npt.ArrayLike, change: str) -> Floats:
    """Returns the read-only array of a property.

    Assignments raise an error that names the call that returns a changed camera.
    """
    return read_only_array(values, f"cameras are read-only; {change} returns a changed camera", CameraError)


def refuse_other_types(camera: object, hint: str = "") -> None:
    """Raises `SettingsError` unless `camera` is a `raycam.Camera`."""
    if not isinstance(camera, CameraGeometry):
        raise SettingsError(
            f"camera must be a raycam.Camera, not {type(camera).__name__}{hint}", code="wrong_type"
        )
