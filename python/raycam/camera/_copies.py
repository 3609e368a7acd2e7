"""Copies of a camera with other intrinsics, and the map between two pictures."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from ..arguments import Floats, product, real, size_of
from ..errors import CameraError
from ._arguments import Model, PixelCenter, Size, Up, checked_pixel_center, lens_of, matrix, number, vector
from ._background import Background
from .asked import only_camera

if TYPE_CHECKING:
    from . import Camera

__all__ = ["Copies"]

PANORAMIC = ("equirectangular", "cylindrical")
FORWARD = 1e-3
"""The least z of a unit ray that a pinhole picture shows."""


class Copies:
    """Copies of a `Camera`. What is not named stays: pose, lens, pixel centres, aperture, vignetting, shutter.

    A photograph behind the camera is seen through the copy of `pinhole`, `cropped`, `resized` and `undistorted`: it is
    warped. `replace` says what the camera itself is: the photograph stays as it is.
    """

    __slots__ = ()

    def replace(
        self,
        *,
        K: npt.ArrayLike | None = None,
        R: npt.ArrayLike | None = None,
        C: npt.ArrayLike | None = None,
        size: Size | None = None,
        distortion: npt.ArrayLike | None = None,
        model: Model | None = None,
        pixel_center: PixelCenter | None = None,
        up: Up | None = None,
    ) -> Camera:
        """The same camera with other values of the given arguments of `Camera`.

        `distortion` without `model` keeps the lens model ("opencv" for a pinhole); `pinhole` takes the lens away.
        `pixel_center` alone changes how the same pixels are counted: K moves by half a pixel. `size` alone keeps K;
        `resized` and `cropped` change both. Raises `CameraError` as `Camera` does, and for K of a camera that is given
        by a matrix with its centre at infinity.
        """
        camera: Any = self
        if R is not None or C is not None:
            pose = (
                camera.R if R is None else matrix("R", R),
                camera.location if C is None else vector("C", C),
            )
            camera = camera.at_pose(*pose)
        table = camera.to_dict()
        if pixel_center is not None and checked_pixel_center(pixel_center) != camera.pixel_center:
            table["pixel_center"] = pixel_center
            if K is None:
                _require_k(table)
                shift = 0.5 if pixel_center == "half" else -0.5
                table["K"] = (camera.K + np.array([[0, 0, shift], [0, 0, shift], [0, 0, 0]])).tolist()
        if K is not None:
            _require_k(table)
            table["K"] = matrix("K", K).tolist()
        if size is not None:
            table["size"] = list(size_of(size, error=CameraError))
        if model is not None and distortion is None and camera.distortion is not None:
            distortion = camera.distortion
        if distortion is not None or model is not None:
            named: Model = "opencv" if camera.model == "pinhole" else camera.model
            lens = lens_of(distortion, named if model is None else model)
            if lens is not None:
                table["lens"], table["distortion"] = lens
        made: Camera = camera.from_dict(table, up=camera.up if up is None else up)
        return made

    def pinhole(self) -> Camera:
        """The same camera without its lens, with the same K.

        Raises `CameraError` for "equirectangular" and "cylindrical", whose K is in pixels per radian.
        """
        camera: Any = self
        if camera.model in PANORAMIC:
            raise CameraError(
                f"a pinhole has K in pixels, and {camera.model} in pixels per radian: give it a K of its own"
            )
        table = {key: value for key, value in camera.to_dict().items() if key not in ("lens", "distortion")}
        made: Camera = camera.from_dict(table, up=camera.up)
        return _behind(camera, made)

    def cropped(self, x: int, y: int, width: int, height: int) -> Camera:
        """The camera of the part of the picture that begins at column `x` and row `y`, of `width` x `height` pixels.

        The part may reach beyond the picture. Raises `CameraError` unless all are whole numbers.
        """
        camera: Any = self
        left, top = (
            real(name, value, what="a column or row", error=CameraError)
            for name, value in (("x", x), ("y", y))
        )
        for name, value in (("x", left), ("y", top)):
            if not value.is_integer():
                raise CameraError(f"{name} is {value}; expected a whole number of pixels")
        shift = np.array([[1.0, 0.0, -left], [0.0, 1.0, -top], [0.0, 0.0, 1.0]])
        new = size_of((width, height), error=CameraError)
        return self._with_intrinsics(product(shift, camera.K), new)

    def resized(self, size: Size) -> Camera:
        """The same view in a picture of another size (width, height): K is scaled so that the edges stay the same."""
        camera: Any = self
        new = size_of(size, error=CameraError)
        x, y = new[0] / camera.size[0], new[1] / camera.size[1]
        corner = camera.corner
        scale = np.array([[x, 0.0, (1.0 - x) * corner], [0.0, y, (1.0 - y) * corner], [0.0, 0.0, 1.0]])
        return self._with_intrinsics(product(scale, camera.K), new)

    def _with_intrinsics(self, K: Floats, size: tuple[int, int]) -> Camera:
        camera: Any = self
        made: Camera = camera._of(camera._core.with_intrinsics(K.tolist(), size), camera.up)
        return _behind(camera, made)

    def undistorted(self, balance: float = 0.0, *, size: Size | None = None) -> Camera:
        """The pinhole at the same pose for the undistorted picture, of the same size or of `size`.

        With `balance` 0, all its pixels show something that the camera sees; with 1, all that the camera sees in front
        of it is in the picture; between them, K is a mean. `pixel_map` is the map between the pictures. Raises
        `CameraError` for parallel rays, and for lenses that see too far to the side for the `balance`.

        Source: OpenCV, `getOptimalNewCameraMatrix`, with `balance` for its `alpha`. It looks at nine points a side and
        takes five steps of its inverse of the lens; here are all pixels of the border and the exact inverse. For
        strong lenses (k1 = -0.35), K differs by up to 0.2 pixels.
        """
        camera: Any = self
        share = number("balance", balance)
        if not 0.0 <= share <= 1.0:
            raise CameraError(f"balance is {share}; expected 0 to 1")
        if camera.is_parallel:
            raise CameraError(
                "an undistorted picture is of a camera with a centre, and this one has parallel rays"
            )
        new = camera.size if size is None else size_of(size, error=CameraError)
        inner, outer = _rectangles(camera)
        K = np.eye(3)
        for axis in (0, 1):
            last = new[axis] - 1.0
            ends = [
                (last / (high - low), -low * last / (high - low)) for low, high in (inner[axis], outer[axis])
            ]
            focal, first = (a * (1.0 - share) + b * share for a, b in zip(*ends, strict=True))
            K[axis, axis], K[axis, 2] = focal, first + camera.corner + 0.5
        if camera.model in PANORAMIC:
            return _behind(camera, _pinhole(camera, K, new))
        return self.pinhole().replace(K=K, size=new)

    def pixel_map(self, source: Camera) -> npt.NDArray[np.float32]:
        """The pixels [h, w, 2] of the picture of `source` that show what each pixel of this camera shows.

        float32, in OpenCV's convention, for `cv2.remap(picture, map[..., 0], map[..., 1], ...)`; NaN where `source`
        does not see it. Raises `CameraError` unless both cameras stand at the same place.
        """
        camera: Any = self
        source = only_camera(source)
        if camera.is_parallel or source.is_parallel or not np.allclose(camera.C, source.C, rtol=0, atol=1e-9):
            raise CameraError("a map between pictures is of two cameras at one place")
        origins, directions = camera.rays()
        points = (origins + directions).reshape(-1, 3)
        pixels, seen = source.project(points)
        pixels = np.where(seen[:, None], pixels, np.nan) - (source.corner + 0.5)
        found: npt.NDArray[np.float32] = pixels.reshape((*directions.shape[:2], 2)).astype(np.float32)
        return found


def _behind(camera: Any, made: Camera) -> Camera:
    """A copy of the camera with other intrinsics, behind which the same photograph is."""
    behind = camera.background
    if behind is None:
        return made
    if behind.fit == "exact" and behind.camera is None:
        behind = Background(behind.image, camera)
    return made.with_background(behind)


def _require_k(table: dict[str, Any]) -> None:
    if "matrix" in table:
        raise CameraError(
            "this camera is given by its matrix and has no K of its own: use Camera.from_matrix"
        )


def _pinhole(camera: Any, K: Floats, size: tuple[int, int]) -> Camera:
    made: Camera = type(camera)(K, camera.R, camera.C, size, pixel_center=camera.pixel_center, up=camera.up)
    return made


def _rectangles(camera: Any) -> tuple[list[tuple[float, float]], list[tuple[float, float]]]:
    """The ranges of x and y on the plane z = 1: inside the border of the picture, and around it."""
    width, height = camera.size
    first = camera.corner + 0.5
    u, v = np.arange(width) + first, np.arange(height) + first
    sides = [
        np.column_stack([np.full(height, u[0]), v]),
        np.column_stack([np.full(height, u[-1]), v]),
        np.column_stack([u, np.full(width, v[0])]),
        np.column_stack([u, np.full(width, v[-1])]),
    ]
    lying = camera.at_pose(np.eye(3), np.zeros(3)).still()
    planes = []
    for pixels in sides:
        directions = lying.rays(pixels)[1]
        if not (directions[:, 2] > FORWARD).all():
            raise CameraError(
                "the border of the picture has no ray, or looks to the side or behind: crop it first (cropped), or "
                "give a pinhole of your own (pinhole().replace(K=...))"
            )
        planes.append(directions[:, :2] / directions[:, 2:])
    left, right, top, bottom = planes
    inner = [(left[:, 0].max(), right[:, 0].min()), (top[:, 1].max(), bottom[:, 1].min())]
    everything = np.concatenate(planes)
    outer = list(zip(everything.min(axis=0), everything.max(axis=0), strict=True))
    if any(low >= high for low, high in inner):
        raise CameraError("the border of the picture folds over itself: crop it first (cropped)")
    return [(float(a), float(b)) for a, b in inner], [(float(a), float(b)) for a, b in outer]
