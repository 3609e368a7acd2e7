"""Checks and conversions of camera constructors' arguments."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Literal, NamedTuple, TypedDict, TypeVar

import numpy as np
import numpy.typing as npt

from .. import _core
from ..arguments import Floats, floats, one_of, size_of
from ..errors import CameraError, Notice, nearest
from ..notices import warn

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


class LensKeys(TypedDict, total=False):
    """Lens arguments of the constructors of `Camera`."""

    distortion: npt.ArrayLike | None
    """The lens coefficients (default: no lens)."""
    model: Model
    """The lens model of `distortion` (default: "opencv")."""
    pixel_center: PixelCenter
    """The coordinates of the first pixel's centre: "integer" for (0, 0) (default), "half" for (0.5, 0.5)."""


class ViewKeys(LensKeys, total=False):
    """Lens, intrinsics and image size: arguments of `Camera.from_pose` and `Camera.look_at`."""

    size: Size
    """The image size (width, height) in pixels (default: 640 x 480)."""
    focal: float | Sequence[float] | None
    """The focal length in pixels, or (fx, fy)."""
    fov: float | None
    """The vertical field of view in degrees."""
    K: npt.ArrayLike | None
    """The intrinsics [3, 3] in pixels."""
    skew: float | None
    """The skew, in addition to `focal` or `fov`."""
    principal_point: npt.ArrayLike | None
    """The principal point [2] in pixels, in addition to `focal` or `fov` (default: the image centre)."""


class View(NamedTuple):
    """Checked lens, intrinsics and image size."""

    k: list[list[float]]
    size: Size
    lens: Lens | None
    pixel_center: PixelCenter


Constructor = TypeVar("Constructor", bound=Callable[..., Any])


def either_order(constructor: Constructor) -> Constructor:
    """Decorates a constructor that also accepts the argument order K, size, pose.

    The constructor's own arguments are K, pose, size.
    """

    @functools.wraps(constructor)
    def called(*args: Any, **kwargs: Any) -> Any:
        if len(args) > 2 and np.shape(args[2]) == (2,):
            kwargs["size"] = args[2]
            args = (*args[:2], *args[3:])
        return constructor(*args, **kwargs)

    return called  # type: ignore[return-value]


def checked_pixel_center(pixel_center: object) -> PixelCenter:
    """Returns `pixel_center`; raises `CameraError` for an unknown name."""
    if isinstance(pixel_center, str) and pixel_center in ("integer", "half"):
        return "integer" if pixel_center == "integer" else "half"
    raise CameraError(
        f'pixel_center is {pixel_center!r}; expected "integer" (OpenCV: the centre of the first pixel is (0, 0)) '
        'or "half" (COLMAP, OpenGL: (0.5, 0.5))',
        code="invalid_value",
    )


def make(constructor: str, *args: Any) -> _core.Camera:
    """Creates a core camera with the constructor of this name ("": the class itself)."""
    *numbers, size, pixel_center = args
    checked_pixel_center(pixel_center)
    make: Any = getattr(_core.Camera, constructor) if constructor else _core.Camera
    made: _core.Camera = make(*numbers, size_of(size, error=CameraError), pixel_center)
    return made


def report_nearest_rotation(given: npt.NDArray[np.float64], made: _core.Camera) -> None:
    """Warns if the camera's R differs from the given matrix.

    Differences within the rounding of float32 are ignored.
    """
    off = float(np.abs(np.asarray(made.r) - given).max())
    if off > 1e-7:
        text = f"R differs from a rotation by up to {off:.1e}; the nearest rotation is used"
        warn(Notice(text, "repaired_rotation"))


def lens_of(distortion: npt.ArrayLike | None, model: Model) -> Lens | None:
    """Returns the lens for a constructor's arguments; None for a pinhole."""
    one_of("lens model", model, list(PANORAMAS), error=CameraError)
    if distortion is None:
        if PANORAMAS[model]:
            return model, []
        if model != "opencv":
            zeros = "; use [0, 0, 0, 0] for an equidistant fisheye" if model == "fisheye" else ""
            raise CameraError(
                f'lens model "{model}" requires coefficients: distortion is missing{zeros}',
                code="missing_value",
            )
        return None
    return model, np.ravel(
        floats("distortion", distortion, ("n",), (1, "n"), ("n", 1), error=CameraError)
    ).tolist()


def matrix(name: str, value: npt.ArrayLike) -> Floats:
    """Returns a float64 copy of a matrix [3, 3]; raises `CameraError` for other shapes."""
    return floats(name, value, (3, 3), error=CameraError).copy()


def vector(name: str, value: npt.ArrayLike) -> list[float]:
    """Returns `value` as a list of three floats; raises `CameraError` for other shapes."""
    return [float(v) for v in floats(name, value, (3,), error=CameraError)]


def number(name: str, value: float) -> float:
    """Returns `value` as a float; raises `CameraError` for arrays with axes."""
    return float(floats(name, value, (), error=CameraError))


def checked_up(up: str) -> Up:
    """Returns `up` if it is "z" or "y"; otherwise raises `CameraError`."""
    if isinstance(up, str) and up in ("y", "z"):
        return "y" if up == "y" else "z"
    raise CameraError(f'up is {up!r}; expected "z" or "y"', code="invalid_value")


def check_keys(keys: Mapping[str, object], allowed: type) -> None:
    """Raises `CameraError` for a keyword that the constructor does not have.

    The error contains the nearest name.
    """
    names = list(allowed.__annotations__)
    for name in keys:
        if name not in names:
            raise CameraError(nearest("argument", name, names), code="unknown_key")


def read_lens(keys: LensKeys) -> tuple[Lens | None, PixelCenter]:
    """Checks a constructor's lens arguments; returns the lens and the pixel centre.

    The lens is None for a pinhole.
    """
    check_keys(keys, LensKeys)
    lens = lens_of(keys.get("distortion"), keys.get("model", "opencv"))
    return lens, keys.get("pixel_center", "integer")


def read_view(keys: ViewKeys) -> View:
    """Checks the arguments for lens, intrinsics and image size of a constructor."""
    check_keys(keys, ViewKeys)
    size, pixel_center = keys.get("size", (640, 480)), keys.get("pixel_center", "integer")
    k = _intrinsics(size, pixel_center, keys)
    return View(k, size, lens_of(keys.get("distortion"), keys.get("model", "opencv")), pixel_center)


def _intrinsics(size: Size, pixel_center: str, keys: ViewKeys) -> list[list[float]]:
    """Returns K [3, 3] from exactly one of `focal`, `fov` and `K`."""
    given = [name for name in ("focal", "fov", "K") if keys.get(name) is not None]
    if len(given) != 1:
        raise CameraError(
            f"intrinsics: expected one of focal, fov and K; got {' and '.join(given) or 'none'}",
            code="conflicting_values",
        )
    skew, principal_point = keys.get("skew"), keys.get("principal_point")
    pair = size_of(size, error=CameraError)
    if (K := keys.get("K")) is not None:
        if skew is not None or principal_point is not None:
            raise CameraError(
                "skew and principal_point cannot be combined with K, which contains them",
                code="conflicting_values",
            )
        return [[float(v) for v in row] for row in matrix("K", K)]
    if (focal := keys.get("focal")) is not None:
        values = floats("focal", focal, (), (2,), error=CameraError)
        k = _core.intrinsics_from_focal(float(values.flat[0]), pair, pixel_center)
        k[1][1] = float(values.flat[-1])
    elif (fov := keys.get("fov")) is not None:
        k = _core.intrinsics_from_fov(number("fov", fov), pair, pixel_center)
    if skew is not None:
        k[0][1] = number("skew", skew)
    if principal_point is not None:
        k[0][2], k[1][2] = map(float, floats("principal_point", principal_point, (2,), error=CameraError))
    return k
