"""Cameras of pyrender, which look along -z with y up."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from .values import Converted, number, text

__all__ = ["Camera", "IntrinsicsCamera", "OrthographicCamera", "PerspectiveCamera"]

Floats = npt.NDArray[Any]


class Camera:
    """A camera with near and far planes, which clip surfaces; `zfar` None means no far plane."""

    name = Converted(text)
    znear = Converted(number("znear", 0))
    zfar = Converted(number("zfar", 0, above=True, optional=True))

    def __init__(
        self, znear: float | None = 0.05, zfar: float | None = 100.0, name: str | None = None
    ) -> None:
        self.name, self.znear, self.zfar = name, 0.05 if znear is None else znear, zfar

    def _check_values(self) -> None:
        """Raises `ValueError` if the far plane is not behind the near plane.

        This method is called after each assignment.
        """
        near, far = self.__dict__.get("_znear"), self.__dict__.get("_zfar")
        if near is not None and far is not None and far <= near:
            raise ValueError(f"zfar is {far} and znear {near}: expected zfar > znear")

    def rays(self, columns: Floats, rows: Floats, size: tuple[int, int]) -> tuple[Floats, Floats]:
        """Returns the origins and directions [n, 3] of rays, in camera coordinates.

        The rays go through the image positions (`columns`, `rows`), in pixels from the image's top left
        corner; `size` is the image's (width, height). Directions have z = -1, so that t is depth.
        """
        raise NotImplementedError

    def get_projection_matrix(self, width: int | None = None, height: int | None = None) -> Floats:
        """Returns the matrix [4, 4] from camera coordinates to OpenGL's clip coordinates."""
        size = (width or 1, height or 1)
        corners = np.array([[0.0, 0.0], [size[0], size[1]]])
        starts, ways = self.rays(corners[:, 0], corners[:, 1], size)
        near, far = self.znear, self.zfar
        at = (starts + ways)[:, :2]  # the rays' points on the plane z = -1
        (left, top), (right, bottom) = at
        matrix = np.zeros((4, 4))
        matrix[0, 0], matrix[1, 1] = 2 / (right - left), 2 / (top - bottom)
        shift = [(right + left) / (right - left), (top + bottom) / (top - bottom)]
        if np.ptp(starts[:, :2]) > 0:  # parallel rays
            deep = 100.0 if far is None else far
            matrix[2, 2], matrix[2, 3] = 2 / (near - deep), (deep + near) / (near - deep)
            matrix[0, 3], matrix[1, 3], matrix[3, 3] = -shift[0], -shift[1], 1
            return matrix
        matrix[0, 2], matrix[1, 2], matrix[3, 2] = shift[0], shift[1], -1
        matrix[2, 2] = -1 if far is None else (far + near) / (near - far)
        matrix[2, 3] = -2 * near if far is None else 2 * far * near / (near - far)
        return matrix


def _pinhole(
    columns: Floats, rows: Floats, focal: tuple[float, float], center: tuple[float, float]
) -> tuple[Floats, Floats]:
    x, y = (columns - center[0]) / focal[0], (center[1] - rows) / focal[1]
    ways = np.stack([x, y, np.full_like(x, -1.0)], axis=-1)
    return np.zeros_like(ways), ways


class PerspectiveCamera(Camera):
    """A camera with a vertical field of view `yfov` in radians.

    `aspectRatio` defaults to the viewport's aspect ratio.
    """

    yfov = Converted(number("yfov", 0, np.pi, above=True))
    aspectRatio = Converted(number("aspectRatio", 0, above=True, optional=True))

    def __init__(
        self,
        yfov: float,
        znear: float | None = 0.05,
        zfar: float | None = None,
        aspectRatio: float | None = None,
        name: str | None = None,
    ) -> None:
        super().__init__(znear, zfar, name)
        self.yfov, self.aspectRatio = yfov, aspectRatio

    def get_projection_matrix(self, width: int | None = None, height: int | None = None) -> Floats:
        """Returns the matrix [4, 4] from camera to clip coordinates.

        Raises `ValueError` without an aspect ratio.
        """
        if self.aspectRatio is None and (width is None or height is None):
            raise ValueError("aspectRatio is missing; set it, or pass the image's width and height")
        return super().get_projection_matrix(width, height)

    def rays(self, columns: Floats, rows: Floats, size: tuple[int, int]) -> tuple[Floats, Floats]:
        """Returns rays through image positions; see `Camera.rays`."""
        width, height = size
        tangent = np.tan(self.yfov / 2)
        aspect = self.aspectRatio or width / height
        focal = (width / (2 * aspect * tangent), height / (2 * tangent))
        return _pinhole(columns, rows, focal, (width / 2, height / 2))


class OrthographicCamera(Camera):
    """A camera with parallel rays whose image is 2 `ymag` high.

    As in pyrender, the image's width follows from its aspect ratio; `xmag` is only used if the size is unknown.
    """

    znear = Converted(number("znear", 0, above=True))
    zfar = Converted(number("zfar", 0, above=True))
    xmag = Converted(number("xmag", 0, above=True))
    ymag = Converted(number("ymag", 0, above=True))

    def __init__(
        self,
        xmag: float,
        ymag: float,
        znear: float | None = 0.05,
        zfar: float | None = 100.0,
        name: str | None = None,
    ) -> None:
        super().__init__(znear, 100.0 if zfar is None else zfar, name)
        self.xmag, self.ymag = xmag, ymag

    def get_projection_matrix(self, width: int | None = None, height: int | None = None) -> Floats:
        """Returns the matrix [4, 4] from camera to clip coordinates.

        Without a size, the width is 2 `xmag`.
        """
        if width is not None and height is not None:
            return super().get_projection_matrix(width, height)
        matrix = super().get_projection_matrix()
        matrix[0, 0] = 1 / self.xmag
        return matrix

    def rays(self, columns: Floats, rows: Floats, size: tuple[int, int]) -> tuple[Floats, Floats]:
        """Returns rays through image positions; see `Camera.rays`."""
        x = (2 * columns / size[0] - 1) * self.ymag * size[0] / size[1]
        y = (1 - 2 * rows / size[1]) * self.ymag
        starts = np.stack([x, y, np.zeros_like(x)], axis=-1)
        return starts, np.broadcast_to([0.0, 0.0, -1.0], starts.shape)


class IntrinsicsCamera(Camera):
    """A camera with the intrinsics of a matrix K in pixels.

    The centre of the top left pixel is (0.5, 0.5), and v points down.
    """

    zfar = Converted(number("zfar", 0, above=True))
    fx, fy = Converted(number("fx")), Converted(number("fy"))
    cx, cy = Converted(number("cx")), Converted(number("cy"))

    def __init__(
        self,
        fx: float,
        fy: float,
        cx: float,
        cy: float,
        znear: float | None = 0.05,
        zfar: float | None = 100.0,
        name: str | None = None,
    ) -> None:
        super().__init__(znear, 100.0 if zfar is None else zfar, name)
        self.fx, self.fy, self.cx, self.cy = fx, fy, cx, cy

    def _check_values(self) -> None:
        """Raises `ValueError` for a focal length of 0, and the errors of all cameras."""
        super()._check_values()
        for name in ("fx", "fy"):
            if self.__dict__.get(f"_{name}") == 0:
                raise ValueError(f"{name} is 0: expected the focal length in pixels")

    def get_projection_matrix(self, width: int, height: int) -> Floats:  # type: ignore[override]
        """Returns the matrix [4, 4] from camera to clip coordinates.

        `width` and `height` are the image's size in pixels.
        """
        return super().get_projection_matrix(width, height)

    def rays(self, columns: Floats, rows: Floats, size: tuple[int, int]) -> tuple[Floats, Floats]:
        """Returns rays through image positions; see `Camera.rays`."""
        return _pinhole(columns, rows, (self.fx, self.fy), (self.cx, self.cy))
