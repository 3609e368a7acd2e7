"""The self-check: OpenCV must recover a camera from rendered images of a board.

The board is rendered through the camera from many positions. OpenCV detects the corners and calibrates, and the
recovered parameters are compared with the camera's. A second calibration, from the exact projections of the corners,
separates errors of the image from errors of the corner detection.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from ..arguments import Floats, whole
from ..camera import Camera, check_camera
from ..camera._arguments import Size
from ..errors import CameraError, SettingsError
from ..render import render
from ..render.frame import Frame
from .board import Board, opencv

__all__ = ["Calibration", "SelfCheck", "selfcheck"]

Progress = Callable[[int, int], object]
MAX_COEFFICIENTS = 14
MIN_VIEWS = 3


@dataclass(frozen=True)
class Calibration:
    """A calibration by OpenCV from corners, and its differences from the true camera."""

    rms: float
    """OpenCV's reprojection error: the root mean square distance of corners and reprojected corners, pixels."""
    K: Floats
    """The recovered intrinsics [3, 3], pixel centres at integers."""
    distortion: Floats
    """The recovered distortion coefficients, as many as the camera's."""
    focal_error: float
    """The larger relative error of fx and fy."""
    center_error: float
    """The distance between the principal points, pixels."""
    picture_error: float
    """The largest distance in pixels between the projections of a ray by the camera and by the recovered camera.

    Only the part of the image that contains corners counts. Unlike differences of single coefficients, which may
    compensate each other, this distance shows the error in the image.
    """


@dataclass(frozen=True)
class SelfCheck:
    """The results of the self-check. Distances are in pixels."""

    camera: Camera
    """The checked camera; its pose does not matter."""
    board: str
    """The kind of board."""
    views: int
    """The number of images."""
    corners: int
    """The number of corners that OpenCV detected in all images."""
    detected: Calibration
    """The calibration from the detected corners."""
    exact: Calibration
    """The calibration from the exact projections of the same corners: only the camera models can cause differences."""
    detector_rms: float
    """The root mean square distance of the detected corners from their exact projections."""
    detector_bias: float
    """The length of the mean offset of the detected corners; a shift of the image by half a pixel would show here."""
    picture_largest: float
    """The largest distance of a pixel's centre from the projection of the surface point in that pixel."""

    @property
    def cause(self) -> str:
        """The source of the residual: "picture" if the image's error is large, otherwise "detector".

        The error is large if it exceeds half of `detector_rms`.
        """
        picture = max(self.picture_largest, self.exact.picture_error, self.detector_bias)
        return "picture" if picture > self.detector_rms / 2 else "detector"

    def __str__(self) -> str:
        """The comparison as text."""
        camera, found, exact = _whole_centers(self.camera), self.detected, self.exact
        width, height = self.camera.size
        lines = [
            f"{self.views} views of a {self.board} board, {width} x {height}, {self.corners} corners found",
            f"{'':12} {'camera':>16} {'recovered':>16} {'difference':>12}",
        ]
        for name, place in (("fx", (0, 0)), ("fy", (1, 1)), ("cx", (0, 2)), ("cy", (1, 2))):
            true, got = camera.K[place], found.K[place]
            lines.append(f"{name:12} {true:16.6f} {got:16.6f} {got - true:+12.6f}")
        lens = self.camera.distortion
        for name, true, got in zip(
            _names(self.camera), [] if lens is None else lens, found.distortion, strict=False
        ):
            lines.append(f"{name:12} {true:16.8f} {got:16.8f} {got - true:+12.2e}")
        lines += [
            f"OpenCV's RMS reprojection error                      {found.rms:.4f} px",
            f"error of the focal length                            {found.focal_error * 100:.4f} %",
            f"error of the principal point                         {found.center_error:.4f} px",
            f"largest distance between the pixels of the same ray  {found.picture_error:.4f} px",
            "errors with exact projections as corners             "
            f"RMS {exact.rms:.1e} px, focal length {exact.focal_error * 100:.1e} %, "
            f"principal point {exact.center_error:.1e} px",
            "detected minus exact corners                         "
            f"{self.detector_rms:.4f} px RMS, length of the mean offset {self.detector_bias:.4f} px",
            f"pixel centre minus projection of its surface point   {self.picture_largest:.1e} px at most",
            "the residual comes from "
            + ("the corner detector" if self.cause == "detector" else "the image, which is a bug in raycam"),
        ]
        return "\n".join(lines)


def selfcheck(
    camera: Camera | None = None,
    *,
    views: int = 20,
    size: Size | None = None,
    board: str = "charuco",
    samples: int = 64,
    threads: int | None = None,
    progress: Progress | None = None,
    keep: Callable[[int, Frame], object] | None = None,
) -> SelfCheck:
    """Renders a board through `camera`, calibrates with OpenCV and compares the results.

    The board is rendered from `views` positions.

    `camera` (default: 1920 x 1080 with five coefficients) has a lens that OpenCV calibrates: none, "opencv" with any
    of its coefficients, or "fisheye". The camera's pose does not matter. `size` (width, height) replaces the camera's
    image size. `board` is "charuco" or "checkerboard". The images have `samples` rays per pixel, a lens blur of 1.5
    pixels and 8 bits of linear light. `progress(done, total)` counts the views; `keep(number, frame)` receives each
    image. `threads` is the number of threads (default: all).

    The calibration starts without the camera's values: OpenCV receives only the number of lens coefficients. Raises
    `SettingsError` if OpenCV is not installed (`pip install opencv-python-headless`) or detects the board in too few
    images, and `CameraError` for a lens that OpenCV does not calibrate.

    Source: OpenCV, `calib3d`: Z. Zhang, A Flexible New Technique for Camera Calibration, 2000.
    """
    opencv()  # raises an error before anything is rendered
    camera = (
        _default() if camera is None else check_camera(camera, ", such as raycam.load_cameras(path)[name]")
    )
    camera = camera if size is None else camera.resized(size)
    _check(camera)
    views = whole("views", views, MIN_VIEWS, 10_000)
    target = Board(board)
    places = target.cameras(camera, views)
    found: list[tuple[npt.NDArray[np.int64], Floats, Camera]] = []
    picture = 0.0
    for number, place in enumerate(places):
        if progress is not None:
            progress(number, views)
        frame = render(
            target.world,
            place,
            integrator="flat",
            samples=samples,
            channels=["color", "position"],
            threads=threads,
        )
        if keep is not None:
            keep(number, frame)
        picture = max(picture, _reprojection_error(place, frame["position"]))
        light = np.rint(frame["color"][..., 1].clip(0.0, 1.0) * 255.0).astype(np.uint8)
        numbers, corners = target.detect(light)
        if len(numbers) >= 8:
            found.append((numbers, corners, place))
    if progress is not None:
        progress(views, views)
    if len(found) < MIN_VIEWS:
        raise SettingsError(
            f"OpenCV found the board in {len(found)} of {views} views, but requires {MIN_VIEWS}; use larger "
            "images, more views or more samples",
            code="out_of_range",
        )
    objects = [target.corners[numbers] for numbers, _, _ in found]
    true = [_pixels(place, target.corners[numbers]) for numbers, _, place in found]
    off = np.concatenate([corners - right for (_, corners, _), right in zip(found, true, strict=True)])
    return SelfCheck(
        camera,
        board,
        views,
        len(off),
        _calibrate(camera, objects, [corners for _, corners, _ in found]),
        _calibrate(camera, objects, true),
        float(np.sqrt((off**2).sum(axis=1).mean())),
        float(np.linalg.norm(off.mean(axis=0))),
        picture,
    )


def _default() -> Camera:
    k = [[1500.0, 0.0, 965.0], [0.0, 1495.0, 530.0], [0.0, 0.0, 1.0]]
    lens = [-0.2, 0.05, 1e-3, -5e-4, 0.01]
    return Camera(k, np.eye(3), [0.0, 0.0, 0.0], (1920, 1080), distortion=lens)


def _check(camera: Camera) -> None:
    if camera.model not in ("pinhole", "opencv", "fisheye"):
        raise CameraError(
            f"OpenCV cannot calibrate lens model {camera.model}; supported: pinhole, opencv, fisheye",
            code="unsupported_camera",
        )
    if camera.K[0, 1] != 0.0 and camera.model != "fisheye":
        raise CameraError(
            f"the camera has skew {camera.K[0, 1]}, which OpenCV calibrates for fisheye lenses only",
            code="unsupported_camera",
        )


def _whole_centers(camera: Camera) -> Camera:
    """The camera at the origin, with pixel centres at integers."""
    k = camera.K.copy()
    k[:2, 2] -= 0.5 + camera.corner
    model: Any = "opencv" if camera.model == "pinhole" else camera.model
    return Camera(k, np.eye(3), np.zeros(3), camera.size, distortion=camera.distortion, model=model)


def _pixels(camera: Camera, points: Floats) -> Floats:
    """Returns the projections [n, 2] of points, with pixel centres at integers."""
    return camera.project(points)[0] - (0.5 + camera.corner)


def _reprojection_error(camera: Camera, position: Floats) -> float:
    """Returns the largest distance between a pixel and its surface point's projection.

    Distances are in pixels from the pixel's centre, along the columns or the rows.
    """
    rows, columns = np.nonzero(np.isfinite(position[..., 0]))
    if not len(rows):
        return 0.0
    pixels = _pixels(camera, position[rows, columns])
    return float(np.abs(pixels - np.column_stack([columns, rows])).max())


def _names(camera: Camera) -> Sequence[str]:
    if camera.model == "fisheye":
        return ("k1", "k2", "k3", "k4")
    return ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6", "s1", "s2", "s3", "s4", "tau_x", "tau_y")


def _calibrate(camera: Camera, objects: Sequence[Floats], corners: Sequence[Floats]) -> Calibration:
    """Calibrates with OpenCV from corners in views, and compares with the camera."""
    cv2 = opencv()
    count = 0 if camera.distortion is None else len(camera.distortion)
    points = [np.ascontiguousarray(one, np.float32).reshape(-1, 1, 3) for one in objects]
    images = [np.ascontiguousarray(one, np.float32).reshape(-1, 1, 2) for one in corners]
    try:
        if camera.model == "fisheye":
            names = ["CALIB_RECOMPUTE_EXTRINSIC", *(["CALIB_FIX_SKEW"] if camera.K[0, 1] == 0.0 else [])]
            # OpenCV 5 has moved these functions.
            flags = sum(int(getattr(cv2.fisheye, name, None) or getattr(cv2, name)) for name in names)
            until = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_MAX_ITER, 200, 1e-12)
            wide = [one.astype(np.float64).reshape(1, -1, 3) for one in points]
            seen = [np.asarray(one, np.float64).reshape(1, -1, 2) for one in corners]
            rms, k, lens, _, _ = cv2.fisheye.calibrate(
                wide, seen, camera.size, None, None, flags=flags, criteria=until
            )
        else:
            until = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_MAX_ITER, 300, 1e-12)
            rms, k, lens, _, _ = cv2.calibrateCamera(
                points, images, camera.size, None, None, flags=_calibration_flags(cv2, count), criteria=until
            )
    except cv2.error as error:
        raise SettingsError(
            f"OpenCV cannot calibrate from these views: {error}; more views may help", code="nothing_visible"
        ) from None
    k, lens = np.asarray(k, np.float64), np.ravel(lens)[:count].astype(np.float64)
    true = _whole_centers(camera)
    focal = max(abs(k[i, i] / true.K[i, i] - 1.0) for i in (0, 1))
    center = float(np.linalg.norm(k[:2, 2] - true.K[:2, 2]))
    return Calibration(float(rms), k, lens, float(focal), center, _ray_difference(true, k, lens, corners))


def _calibration_flags(cv2: Any, count: int) -> int:
    """The flags of `cv2.calibrateCamera` that free `count` of the 14 coefficients."""
    names = {
        0: "FIX_K1 FIX_K2 ZERO_TANGENT_DIST FIX_K3",
        4: "FIX_K3",
        5: "",
        8: "RATIONAL_MODEL",
        12: "RATIONAL_MODEL THIN_PRISM_MODEL",
        MAX_COEFFICIENTS: "RATIONAL_MODEL THIN_PRISM_MODEL TILTED_MODEL",
    }[count]
    return sum(int(getattr(cv2, f"CALIB_{name}")) for name in names.split())


def _ray_difference(true: Camera, k: Floats, lens: Floats, corners: Sequence[Floats]) -> float:
    """Returns the largest distance in pixels between two cameras' images of the same rays.

    The rays form a grid over the part of the image with corners. A calibration cannot separate a rotation of
    the camera from the poses, so the best rotation is removed first.
    """
    every = np.concatenate(corners)
    low, high = every.min(axis=0), every.max(axis=0)
    grid = np.stack(np.meshgrid(*np.linspace(low, high, 33).T), axis=-1).reshape(-1, 2)
    model: Any = "fisheye" if true.model == "fisheye" else "opencv"
    try:
        found = Camera(
            np.array([[k[0, 0], k[0, 1], k[0, 2]], [0.0, k[1, 1], k[1, 2]], [0.0, 0.0, 1.0]]),
            np.eye(3),
            np.zeros(3),
            true.size,
            distortion=lens if len(lens) else None,
            model=model,
        )
    except CameraError:
        return float("inf")  # the lens found by OpenCV is not one-to-one
    ours, theirs = true.rays(grid)[1], found.rays(grid)[1]
    good = np.isfinite(ours[:, 0]) & np.isfinite(theirs[:, 0])
    # The rotation that aligns the rays of both cameras best; source: W. Kabsch 1976.
    u, _, vt = np.linalg.svd(theirs[good].T @ ours[good])
    rotation = u @ np.diag([1.0, 1.0, np.sign(np.linalg.det(u @ vt))]) @ vt
    pixels, _ = found.project(ours[good] @ rotation.T)
    return float(np.linalg.norm(pixels - grid[good], axis=1).max())
