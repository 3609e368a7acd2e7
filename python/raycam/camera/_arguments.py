"""Checks and conversions of the arguments of camera constructors."""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from typing import Any, Literal, TypeVar

import numpy as np
import numpy.typing as npt

from .. import _core
from ..arguments import Floats, floats, one_of, size_of
from ..errors import CameraError

PixelCenter = Literal["integer", "half"]
Up = Literal["z", "y"]
Model = Literal[
    "opencv",
    "fisheye",
    "thin_prism_fisheye",
    "rad_tan_thin_prism_fisheye",
    "fov",
    "division",
    "omni",
    "eucm",
    "ds",
    "equirectangular",
    "cylindrical",
]
Lens = tuple[Model, list[float]]
PANORAMAS = dict(_core.lens_models())
"""The lens models by name: True for panoramas, which have no coefficients."""

Size = Sequence[int]
Constructor = TypeVar("Constructor", bound=Callable[..., Any])


def either_order(constructor: Constructor) -> Constructor:
    """A decorator for constructors with K, a pose and a size, which may stand as K, size, pose too."""

    @functools.wraps(constructor)
    def called(*args: Any, **kwargs: Any) -> Any:
        if len(args) > 2 and np.shape(args[2]) == (2,):
            kwargs["size"] = args[2]
            args = (*args[:2], *args[3:])
        return constructor(*args, **kwargs)

    return called  # type: ignore[return-value]


def checked_pixel_center(pixel_center: object) -> PixelCenter:
    """Returns the checked name of the place where pixels are counted from."""
    if isinstance(pixel_center, str) and pixel_center in ("integer", "half"):
        return "integer" if pixel_center == "integer" else "half"
    raise CameraError(
        f'pixel_center is {pixel_center!r}; expected "integer" (OpenCV: the centre of the first pixel is (0, 0)) '
        'or "half" (COLMAP, OpenGL: (0.5, 0.5))'
    )


def make(constructor: str, *args: Any) -> _core.Camera:
    """Makes a core camera by the name of its constructor, "" for the class."""
    *numbers, size, pixel_center = args
    checked_pixel_center(pixel_center)
    make: Any = getattr(_core.Camera, constructor) if constructor else _core.Camera
    made: _core.Camera = make(*numbers, size_of(size, error=CameraError), pixel_center)
    return made


def lens_of(distortion: npt.ArrayLike | None, model: Model) -> Lens | None:
    """The lens of a constructor's arguments; None for a pinhole."""
    one_of("lens model", model, list(PANORAMAS), error=CameraError)
    if distortion is None:
        if PANORAMAS[model]:
            return model, []
        if model != "opencv":
            zeros = "; [0, 0, 0, 0] is the equidistant fisheye" if model == "fisheye" else ""
            raise CameraError(f'model is "{model}" and distortion, its coefficients, is missing{zeros}')
        return None
    return model, np.ravel(
        floats("distortion", distortion, ("n",), (1, "n"), ("n", 1), error=CameraError)
    ).tolist()


def matrix(name: str, value: npt.ArrayLike) -> Floats:
    """Returns a checked copy of a matrix [3, 3]."""
    return floats(name, value, (3, 3), error=CameraError).copy()


def vector(name: str, value: npt.ArrayLike) -> list[float]:
    """Returns a checked vector [3]."""
    return [float(v) for v in floats(name, value, (3,), error=CameraError)]


def number(name: str, value: float) -> float:
    """Returns a checked number."""
    return float(floats(name, value, (), error=CameraError))


def checked_up(up: str) -> Up:
    """Returns the checked name of the up axis."""
    if isinstance(up, str) and up in ("y", "z"):
        return "y" if up == "y" else "z"
    raise CameraError(f'up is {up!r}; expected "z" or "y"')


def intrinsics(
    size: Size,
    focal: float | Sequence[float] | None,
    fov: float | None,
    K: npt.ArrayLike | None,
    skew: float | None,
    principal_point: npt.ArrayLike | None,
    pixel_center: str,
) -> list[list[float]]:
    """K [3, 3] from exactly one of `focal`, `fov` and `K`."""
    given = [name for name, value in (("focal", focal), ("fov", fov), ("K", K)) if value is not None]
    if len(given) != 1:
        raise CameraError(
            f"intrinsics: exactly one of focal, fov and K is needed, {' and '.join(given) or 'none'} given"
        )
    pair = size_of(size, error=CameraError)
    if K is not None:
        if skew is not None or principal_point is not None:
            raise CameraError("skew and principal_point are part of K: give them there")
        return [[float(v) for v in row] for row in matrix("K", K)]
    if fov is not None:
        k = _core.intrinsics_from_fov(number("fov", fov), pair, pixel_center)
    else:
        values = floats("focal", focal if focal is not None else 0.0, (), (2,), error=CameraError)
        k = _core.intrinsics_from_focal(float(values.flat[0]), pair, pixel_center)
        k[1][1] = float(values.flat[-1])
    if skew is not None:
        k[0][1] = number("skew", skew)
    if principal_point is not None:
        k[0][2], k[1][2] = map(float, floats("principal_point", principal_point, (2,), error=CameraError))
    return k
