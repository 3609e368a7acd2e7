"""Copies of a camera with new intrinsics or a new background, and pixel maps.

A pixel map connects the pixels of two cameras' images.
"""

from __future__ import annotations

import os
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from ..arguments import Floats, product, real, size_of
from ..errors import CameraError
from ._arguments import Model, PixelCenter, Size, Up, checked_pixel_center, lens_of, make, matrix, number
from ._background import Background
from ._geometry import refuse_other_types
from ._optics import Optics

__all__ = ["Copies"]

PANORAMIC = ("equirectangular", "cylindrical")
MIN_FORWARD = 1e-3
"""Minimum z of a unit ray in an undistorted image."""


class Copies(Optics):
    """Base class of `Camera` with the methods that return changed copies.

    A copy keeps every property that is not named: pose, lens, pixel centres, aperture, vignetting, shutter. `pinhole`,
    `cropped`, `resized` and `undistorted` warp the camera's background photo to the new view; `replace` corrects the
    description of the camera that took the photo, so the photo stays unchanged.
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
    ) -> Self:
        """Returns a copy with new values for the given arguments of `Camera`.

        `R` [3, 3] and `C` [3] move the camera. `distortion` without `model` keeps the lens model ("opencv"
        for a pinhole); `pinhole` removes the lens. `pixel_center` alone changes the pixel coordinates'
        origin: K moves by half a pixel. `size` alone keeps K; `resized` and `cropped` change both. `up` is
        the world's up axis. Raises the errors of `Camera`, and `CameraError` for `K` of a camera that was
        created from a matrix with its centre at infinity.
        """
        posed = self
        if R is not None or C is not None:
            posed = self.at_pose(self.R if R is None else R, self.location if C is None else C)
        table = posed.to_dict()
        if pixel_center is not None and checked_pixel_center(pixel_center) != self.pixel_center:
            table["pixel_center"] = pixel_center
            if K is None:
                _require_k(table)
                shift = 0.5 if pixel_center == "half" else -0.5
                table["K"] = (self.K + np.array([[0, 0, shift], [0, 0, shift], [0, 0, 0]])).tolist()
        if K is not None:
            _require_k(table)
            table["K"] = matrix("K", K).tolist()
        if size is not None:
            table["size"] = list(size_of(size, error=CameraError))
        if model is not None and distortion is None and self.distortion is not None:
            distortion = self.distortion
        if distortion is not None or model is not None:
            named: Model = "opencv" if self.model == "pinhole" else self.model
            lens = lens_of(distortion, named if model is None else model)
            if lens is not None:
                table["lens"], table["distortion"] = lens
        return self.from_dict(table, up=self.up if up is None else up)

    def pinhole(self) -> Self:
        """Returns a copy without the lens, with the same K.

        Raises `CameraError` for "equirectangular" and "cylindrical", whose K is in pixels per radian.
        """
        if self.model in PANORAMIC:
            raise CameraError(
                f"pinhole() cannot keep the K of lens model {self.model!r}, which is in pixels per radian; create a "
                "camera with a K in pixels",
                code="unsupported_camera",
            )
        table = {key: value for key, value in self.to_dict().items() if key not in ("lens", "distortion")}
        return self._with_same_photo(self.from_dict(table, up=self.up))

    def cropped(self, x: int, y: int, width: int, height: int) -> Self:
        """Returns the camera for a part of the image.

        The part has `width` x `height` pixels from column `x` and row `y`. The part may extend beyond the
        image. Raises `CameraError` for numbers that are not whole.
        """
        left, top = (
            real(name, value, what="a column or row", error=CameraError)
            for name, value in (("x", x), ("y", y))
        )
        for name, value in (("x", left), ("y", top)):
            if not value.is_integer():
                raise CameraError(f"{name} is {value}; expected a whole number of pixels", code="wrong_type")
        shift = np.array([[1.0, 0.0, -left], [0.0, 1.0, -top], [0.0, 0.0, 1.0]])
        new = size_of((width, height), error=CameraError)
        return self._with_intrinsics(product(shift, self.K), new)

    def resized(self, size: Size) -> Self:
        """Returns the camera with the same view and another image `size` (width, height).

        K is scaled, and the edges of the view stay the same.
        """
        new = size_of(size, error=CameraError)
        x, y = new[0] / self.size[0], new[1] / self.size[1]
        corner = self.corner
        scale = np.array([[x, 0.0, (1.0 - x) * corner], [0.0, y, (1.0 - y) * corner], [0.0, 0.0, 1.0]])
        return self._with_intrinsics(product(scale, self.K), new)

    def _with_intrinsics(self, K: Floats, size: tuple[int, int]) -> Self:
        return self._with_same_photo(self._of(self._core.with_intrinsics(K.tolist(), size), self.up))

    def undistorted(self, balance: float = 0.0, *, size: Size | None = None) -> Self:
        """Returns the pinhole camera for the undistorted image, at the same pose.

        The image size stays the same unless `size` is given. With `balance` 0, every pixel of the undistorted image
        shows a part of the original image; with 1, the undistorted image contains the whole original image; in between,
        K is interpolated. `pixel_map` maps between the two images. Raises `CameraError` for parallel rays, and for
        lenses with too wide a field of view for `balance`.

        Source: OpenCV, `getOptimalNewCameraMatrix`, whose `alpha` is `balance` here. OpenCV uses nine points per side
        and five iterations of the inverse lens model; raycam uses all border pixels and the exact inverse. For strong
        distortion (k1 = -0.35), K differs by up to 0.2 pixels.
        """
        share = number("balance", balance)
        if not 0.0 <= share <= 1.0:
            raise CameraError(f"balance is {share}; expected 0 to 1", code="out_of_range")
        if self.is_parallel:
            raise CameraError(
                "undistorted() requires a camera with a centre; this camera has parallel rays",
                code="unsupported_camera",
            )
        new = self.size if size is None else size_of(size, error=CameraError)
        inner, outer = _rectangles(self)
        K = np.eye(3)
        for axis in (0, 1):
            last = new[axis] - 1.0
            ends = [
                (last / (high - low), -low * last / (high - low)) for low, high in (inner[axis], outer[axis])
            ]
            focal, first = (a * (1.0 - share) + b * share for a, b in zip(*ends, strict=True))
            K[axis, axis], K[axis, 2] = focal, first + self.corner + 0.5
        if self.model in PANORAMIC:
            pinhole = make("", K.tolist(), self.R.tolist(), self.location.tolist(), new, self.pixel_center)
            return self._with_same_photo(self._of(pinhole, self.up))
        return self.pinhole().replace(K=K, size=new)

    def pixel_map(self, source: Self) -> npt.NDArray[np.float32]:
        """Returns, for each pixel of this camera, the pixel of `source` with the same ray.

        The map is float32 [h, w, 2] in OpenCV's convention, for
        `cv2.remap(image, map[..., 0], map[..., 1], ...)`. The map is NaN for rays outside the view of
        `source`. Raises `CameraError` unless both cameras have the same centre.
        """
        refuse_other_types(source)
        if self.is_parallel or source.is_parallel or not np.allclose(self.C, source.C, rtol=0, atol=1e-9):
            raise CameraError(
                f"pixel_map requires two cameras with the same centre C, not {self!r} and {source!r}",
                code="unsupported_camera",
            )
        origins, directions = self.rays()
        points = (origins + directions).reshape(-1, 3)
        pixels, seen = source.project(points)
        pixels = np.where(seen[:, None], pixels, np.nan) - (source.corner + 0.5)
        return pixels.reshape((*directions.shape[:2], 2)).astype(np.float32)

    @property
    def background(self) -> Background | None:
        """The photo that `raycam.render` shows behind the rendered objects, or None."""
        found = self._core.background
        if found is None:
            return None
        image, fit, camera = found
        return Background(image, None if camera is None else self._of(camera, self._up), fit)

    def with_background(self, background: Background | str | os.PathLike[str] | None) -> Self:
        """Returns the same camera with a background.

        `background` is the path of a photo that the camera took, or a `Background`. None removes the
        background. Raises `CameraError` for an array, and for a `Background` with an `orientation` other than
        "auto"; pass these to `raycam.render(..., background=background)` instead.
        """
        if background is None:
            return self._of(self._core.with_background(None, False, None), self._up)
        given = background if isinstance(background, Background) else Background(background)
        if given.orientation != "auto":
            raise CameraError(
                f"a camera cannot store orientation={given.orientation!r} of its background; pass the background to "
                "raycam.render(..., background=background)",
                code="conflicting_values",
            )
        camera = None if given.camera is None else given.camera._core
        return self._of(self._core.with_background(given.file, given.fit == "cover", camera), self._up)

    def _with_same_photo(self, copy: Self) -> Self:
        """Adds this camera's background photo to a copy with new intrinsics, and returns the copy."""
        photo = self.background
        if photo is None:
            return copy
        if photo.fit == "exact" and photo.camera is None:
            photo = Background(photo.image, self)
        return copy.with_background(photo)


def _require_k(table: dict[str, Any]) -> None:
    if "matrix" in table:
        raise CameraError(
            "a camera created from a matrix P has no K to replace; use Camera.from_matrix",
            code="unsupported_camera",
        )


def _rectangles(camera: Optics) -> tuple[list[tuple[float, float]], list[tuple[float, float]]]:
    """Returns two rectangles on the plane z = 1, as ranges of x and y.

    The first is the largest rectangle inside the image border, the second the smallest rectangle around the
    border.
    """
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
        if not (directions[:, 2] > MIN_FORWARD).all():
            raise CameraError(
                "pixels at the image border have no ray, or rays that point sideways or backwards; crop the image "
                "first with cropped(), or choose the intrinsics yourself: pinhole().replace(K=...)",
                code="unsupported_camera",
            )
        planes.append(directions[:, :2] / directions[:, 2:])
    left, right, top, bottom = planes
    inner = [(left[:, 0].max(), right[:, 0].min()), (top[:, 1].max(), bottom[:, 1].min())]
    everything = np.concatenate(planes)
    outer = list(zip(everything.min(axis=0), everything.max(axis=0), strict=True))
    if any(low >= high for low, high in inner):
        raise CameraError(
            "the lens folds the image border over itself; crop the image first with cropped()",
            code="unsupported_camera",
        )
    return [(float(a), float(b)) for a, b in inner], [(float(a), float(b)) for a, b in outer]
