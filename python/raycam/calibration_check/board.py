"""The calibration board of the self-check.

The module creates the board's mesh and camera poses that view the board, and detects the board's corners.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from ..arguments import Floats
from ..camera import Camera
from ..errors import SettingsError
from ..world import World

__all__ = ["BOARDS", "Board", "opencv"]

BOARDS = ("charuco", "checkerboard")
CELLS = 12
"""Cells along the side of a ChArUco square; the marker is the 6 x 6 cells in the middle."""
LENS_BLUR = 1.5
"""Standard deviation of the lens blur in pixels; without blur, edges alias and detected corners shift."""
GOLDEN = (0.7548776662466927, 0.5698402909980532)
"""Step of M. Roberts' R2 low-discrepancy sequence, 2018."""


def opencv() -> Any:
    """Imports OpenCV; raises `SettingsError` if it is not installed or too old."""
    try:
        import cv2
    except ImportError as error:
        raise SettingsError(
            f"the self-check requires OpenCV ({error}); pip install opencv-python-headless",
            code="missing_dependency",
        ) from None
    if not hasattr(cv2, "aruco") or not hasattr(cv2.aruco, "CharucoDetector"):
        raise SettingsError(
            f"the self-check requires OpenCV 4.8 or later with its aruco module; installed: {cv2.__version__}: "
            "pip install --upgrade opencv-python-headless",
            code="missing_dependency",
        )
    return cv2


@dataclass(frozen=True)
class Board:
    """A ChArUco board or a checkerboard on the plane z = 0, squares of 1 m.

    x is right, y down and z away from the viewer.
    """

    kind: str = "charuco"
    """The board's kind, which is one of `BOARDS`."""
    columns: int = 9
    """The number of squares from left to right."""
    rows: int = 7
    """The number of squares from top to bottom."""

    def __post_init__(self) -> None:
        """Raises `SettingsError` for an unknown kind."""
        if self.kind not in BOARDS:
            raise SettingsError(
                f"board is {self.kind!r}, expected one of {', '.join(BOARDS)}", code="invalid_value"
            )

    @cached_property
    def corners(self) -> Floats:
        """The inner corners [n, 3], row by row, used for calibration."""
        x, y = np.meshgrid(np.arange(1.0, self.columns), np.arange(1.0, self.rows))
        return np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])

    @cached_property
    def _charuco(self) -> Any:
        cv2 = opencv()
        markers = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_250)
        return cv2.aruco.CharucoBoard((self.columns, self.rows), 1.0, 6 / CELLS, markers)

    @property
    def _cells(self) -> npt.NDArray[np.bool_]:
        """True [rows, columns] for the white cells of the whole board."""
        if self.kind == "checkerboard":
            return np.array(np.add.outer(np.arange(self.rows), np.arange(self.columns)) % 2 == 1)
        # OpenCV draws the board with 3 pixels per cell; the middle pixel of each cell is read.
        size = (self.columns * CELLS * 3, self.rows * CELLS * 3)
        white: npt.NDArray[np.bool_] = self._charuco.generateImage(size)[1::3, 1::3] > 127
        return white

    @cached_property
    def world(self) -> World:
        """The board as triangles.

        Colour edges are geometric edges, so that no texture filter affects them.
        """
        cells = np.pad(self._cells, CELLS // 2 if self.kind == "charuco" else 1, constant_values=True)
        rows, columns = cells.shape
        margin, step = (0.5, 1.0 / CELLS) if self.kind == "charuco" else (1.0, 1.0)
        x, y = np.meshgrid(np.arange(columns + 1) * step - margin, np.arange(rows + 1) * step - margin)
        vertices = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
        first = (np.arange(rows)[:, None] * (columns + 1) + np.arange(columns)).ravel()
        one = np.column_stack([first, first + columns + 1, first + columns + 2])
        two = np.column_stack([first, first + columns + 2, first + 1])
        faces = np.stack([one, two], axis=1).reshape(-1, 3)
        # As in print, paper is not quite white, and ink is not quite black.
        shades = np.where(cells.ravel(), 0.9, 0.02).repeat(2)
        world = World()
        world.add_mesh(vertices, faces, name="board", face_colors=np.repeat(shades[:, None], 3, axis=1))
        return world

    def cameras(self, camera: Camera, count: int) -> list[Camera]:
        """Returns `camera` at `count` poses.

        Together, the views of the board cover the whole image area. The board is tilted by up to 40 degrees.
        The poses depend only on the arguments. Raises `SettingsError` if fewer than `count` of the tried
        poses show the board.
        """
        if camera.is_parallel:
            raise SettingsError(
                "a camera with parallel rays cannot be calibrated from images of a board",
                code="unsupported_camera",
            )
        found: list[Camera] = []
        for number in range(1, 40 * count):
            placed = self._placed(camera, number)
            if placed is not None:
                found.append(placed)
            if len(found) == count:
                return found
        raise SettingsError(
            f"the board is visible in only {len(found)} of the tried camera poses, expected {count}; request fewer "
            "views, or check the camera's K and distortion",
            code="nothing_visible",
        )

    def _placed(self, camera: Camera, number: int) -> Camera | None:
        """The camera at the pose with this number; None if too little of the board is visible."""
        still = _placed(camera, np.eye(3), np.zeros(3))
        size = np.array(camera.size, float)
        spread = np.array(GOLDEN) * number % 1.0
        pixel = size * (0.2 + 0.6 * spread) + camera.corner
        reach = 0.3 * size.min()
        around = pixel + reach * np.array([[0, 0], [-1, 0], [1, 0], [0, -1], [0, 1]])
        ways = still.rays(around)[1]
        if not np.isfinite(ways).all():
            return None
        # The board spans about twice `reach` pixels, and the board's near side spans more.
        opening = min(np.arccos(np.clip(ways[i] @ ways[i + 1], -1, 1)) for i in (1, 3))
        distance = self.rows / (2 * np.tan(opening / 2)) * (0.85 + 0.3 * (number * 0.41421356 % 1.0))
        tilt, around_z = (
            np.radians(40 * np.sqrt(number * 0.7320508 % 1.0)),
            2 * np.pi * (number * 0.618034 % 1.0),
        )
        turn = np.radians(60 * (number * 0.2360679 % 1.0) - 30)
        board_axes = _facing(ways[0]) @ _about_z(around_z) @ _about_x(tilt) @ _about_z(turn - around_z)
        middle = np.array([self.columns / 2, self.rows / 2, 0.0])
        # In camera coordinates, the board's middle is at ways[0] * distance.
        center = middle - board_axes.T @ (ways[0] * distance)
        placed = _placed(camera, board_axes, center)
        pixels, seen = placed.project(self.corners)
        inside = seen & ((pixels > 8) & (pixels < size - 9)).all(axis=1)
        enough = len(inside) if self.kind == "checkerboard" else 0.6 * len(inside)
        return placed if inside.sum() >= enough else None

    def detect(self, picture: npt.NDArray[np.uint8]) -> tuple[npt.NDArray[np.int64], Floats]:
        """Returns the ids [n] and pixel coordinates [n, 2] of corners in a grey image [h, w].

        OpenCV detects the corners. Pixel centres are integers. Corners are refined in the blurred image, in a
        window without other edges.
        """
        cv2 = opencv()
        if self.kind == "checkerboard":
            flags = cv2.CALIB_CB_EXHAUSTIVE | cv2.CALIB_CB_ACCURACY
            found, corners = cv2.findChessboardCornersSB(
                picture, (self.columns - 1, self.rows - 1), flags=flags
            )
            numbers = np.arange(len(self.corners) if found else 0)
            places = np.reshape(corners, (-1, 2)) if found else np.empty((0, 2))
            if found and np.linalg.norm(places[0]) > np.linalg.norm(places[-1]):
                places = places[::-1]  # a checkerboard is symmetric: either end may come first
        else:
            corners, ids, _, _ = cv2.aruco.CharucoDetector(self._charuco).detectBoard(picture)
            numbers = np.empty(0, np.int64) if ids is None else np.ravel(ids).astype(np.int64)
            places = np.empty((0, 2)) if ids is None else np.reshape(corners, (-1, 2))
        if len(numbers) == 0:
            return numbers, np.empty((0, 2))
        blurred = cv2.GaussianBlur(picture, (0, 0), LENS_BLUR)
        return numbers, refined(blurred, places, self._window(numbers, places))

    def _window(self, numbers: npt.NDArray[np.int64], places: Floats) -> int:
        """Returns half the side of the refinement window in pixels.

        No edge of a corner ends inside the window.
        """
        grid = np.full((self.rows - 1, self.columns - 1, 2), np.nan)
        grid.reshape(-1, 2)[numbers] = places
        steps = np.concatenate([np.diff(grid, axis=axis).reshape(-1, 2) for axis in (0, 1)])
        lengths = np.linalg.norm(steps, axis=1)
        shortest = float(np.nanmin(lengths)) if np.isfinite(lengths).any() else 16.0
        # A marker starts a quarter of a square from the square's edges; the diagonal and the blur reduce this distance.
        return max(3, min(8, int(shortest * (0.15 if self.kind == "charuco" else 0.3)) - 1))


def refined(picture: npt.NDArray[np.uint8], places: Floats, window: int) -> Floats:
    """Corners refined by OpenCV from the gradients around them: Förstner and Gülch 1987."""
    cv2 = opencv()
    until = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_MAX_ITER, 100, 1e-5)
    start = np.ascontiguousarray(places, np.float32).reshape(-1, 1, 2)
    found = cv2.cornerSubPix(picture, start, (window, window), (-1, -1), until)
    return np.asarray(found, np.float64).reshape(-1, 2)


def _placed(camera: Camera, rotation: Floats, center: Floats) -> Camera:
    """The camera's K and lens at another pose, without aperture, vignetting and motion."""
    made = Camera(camera.K, rotation, center, camera.size, pixel_center=camera.pixel_center, up=camera.up)
    return Camera._of(made._core, camera.up, camera._lens)


def _facing(way: Floats) -> Floats:
    """Returns the axes [3, 3], as columns, of a board that faces a camera.

    The board is on the camera's ray `way`; z points away from the camera.
    """
    across = np.cross([0.0, 1.0, 0.0], way)
    if np.linalg.norm(across) < 1e-6:
        across = np.array([1.0, 0.0, 0.0])
    x = across / np.linalg.norm(across)
    return np.column_stack([x, np.cross(way, x), way])


def _about_z(angle: float) -> Floats:
    cos, sin = np.cos(angle), np.sin(angle)
    return np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])


def _about_x(angle: float) -> Floats:
    cos, sin = np.cos(angle), np.sin(angle)
    return np.array([[1.0, 0.0, 0.0], [0.0, cos, -sin], [0.0, sin, cos]])
