"""A camera's aperture, vignetting, shutter and motion."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal, Self

import numpy as np
import numpy.typing as npt

from ..arguments import Floats, flag, floats
from ..errors import CameraError
from ..read_only import ReadOnlyDict
from ._arguments import number
from ._geometry import CameraGeometry, refuse_other_types

__all__ = ["Optics"]

Readout = Literal["down", "up", "right", "left"]


class Optics(CameraGeometry):
    """Base class of `Camera` with its optics.

    Ground truth uses the middle of the aperture and of the exposure.
    """

    __slots__ = ()

    def _changed(self, **tables: Any) -> Self:
        table = self.to_dict() | tables
        present = {name: value for name, value in table.items() if value is not None}
        return self.from_dict(present, up=self.up)

    def _table(self, name: str, change: str) -> dict[str, Any] | None:
        table: dict[str, Any] | None = self.to_dict().get(name)
        if table is None:
            return None
        return ReadOnlyDict(table, f"cameras are read-only; {change} returns a changed camera", CameraError)

    @property
    def aperture(self) -> dict[str, Any] | None:
        """The aperture's `radius`, `focus`, `blades` and `rotation`; None for a pinhole."""
        return self._table("aperture", "camera.with_aperture(...)")

    @property
    def vignetting(self) -> dict[str, Any] | None:
        """The vignetting's `cos4` and `polynomial`; None without vignetting."""
        return self._table("vignetting", "camera.with_vignetting(...)")

    @property
    def shutter(self) -> dict[str, Any] | None:
        """The shutter's settings; None without a shutter.

        The settings are `exposure`, `readout`, `direction` and the `track` of poses.
        """
        return self._table("shutter", "camera.moving(...) or camera.exposing(...)")

    @property
    def times(self) -> Floats:
        """The middle of each line's exposure, in seconds relative to the world's time.

        The times are float64 [lines]. The world's time is the middle of the whole exposure. Without a
        rolling shutter, the result is [0.0].
        """
        shutter = self.shutter
        if shutter is None or not shutter["readout"]:
            return np.zeros(1)
        width, height = self._core.size
        lines = height if shutter["direction"] in ("down", "up") else width
        fractions = (np.arange(lines) + 0.5) / lines - 0.5
        backwards = shutter["direction"] in ("up", "left")
        return (fractions[::-1] if backwards else fractions) * float(shutter["readout"])

    def with_aperture(
        self,
        radius: float | None = None,
        *,
        focus: float,
        f_number: float | None = None,
        focal_length: float | None = None,
        blades: int = 0,
        rotation: float = 0.0,
    ) -> Self:
        """Returns the camera with depth of field.

        The lens is a thin lens with the given `radius`, or with the radius `focal_length` / (2 `f_number`).
        Lengths are in world units (50 mm is 0.05). Surfaces at the depth `focus` are sharp; for lens models
        other than "opencv" and "fov", `focus` is the distance from the camera's centre. The aperture is
        round, or a polygon with `blades` sides, rotated by `rotation` degrees from the camera's x towards its
        y. Only the colour is blurred, with more than one sample per pixel; all other channels belong to the
        ray through the middle of the aperture.

        Raises `CameraError` or `WorldError` for invalid numbers, and for parallel rays.
        """
        given = {"radius": radius, "f_number": f_number, "focal_length": focal_length}
        sizes = {name: number(name, value) for name, value in given.items() if value is not None}
        rest = {"focus": number("focus", focus), "blades": blades, "rotation": number("rotation", rotation)}
        return self._changed(aperture=sizes | rest)

    def with_vignetting(self, *, cos4: bool = False, polynomial: npt.ArrayLike = ()) -> Self:
        """Returns the camera with vignetting.

        The colour is multiplied by 1 + a r² + b r⁴ + ... with the coefficients a, b, ... in `polynomial`; r is the
        distance from the principal point in focal lengths. If `cos4` is True, the colour is also multiplied by cos⁴
        of the angle to the principal axis.
        """
        terms = floats("polynomial", polynomial, ("n",), error=CameraError).tolist()
        return self._changed(vignetting={"cos4": flag("cos4", cos4, error=CameraError), "polynomial": terms})

    def moving(
        self,
        to: Self | Sequence[tuple[float, Self]],
        *,
        exposure: float = 0.0,
        readout: float = 0.0,
        direction: Readout = "down",
    ) -> Self:
        """Returns the camera in motion while its shutter is open, which causes motion blur.

        With a `readout`, the camera has a rolling shutter. Lines (rows from the top for `direction` "down", from the
        bottom for "up"; columns for "right" and "left") open one after another within `readout` seconds, each for
        `exposure` seconds. A line at the fraction f of the image is open from f * readout to f * readout + exposure.
        The camera moves from its own pose, when the first line opens, to the pose of the camera `to`, when the last
        line closes; or along a list of (seconds, camera). Centres are interpolated linearly, rotations along the
        shortest arc.

        The pose (`R`, `C`, `P`) of the result is the pose at the middle, (readout + exposure) / 2. `rays`, `project`
        and all channels but `color` use the middle of each line's exposure.
        """
        shutter: dict[str, Any] = {
            "exposure": number("exposure", exposure),
            "readout": number("readout", readout),
            "direction": direction,
        }
        if isinstance(to, Sequence) and not isinstance(to, str | bytes):
            shutter["track"] = [
                {"time": number("time", time), "pose": _pose(camera)} for time, camera in map(_moment, to)
            ]
            nowhere = dict.fromkeys(("R", "C", "matrix"))
            return self.still()._changed(**self._as_pose({}), **nowhere, shutter=shutter)
        shutter["end"] = _pose(to)
        return self.still()._changed(shutter=shutter)

    def exposing(self, exposure: float, *, readout: float = 0.0, direction: Readout = "down") -> Self:
        """Returns the camera at rest with an open shutter.

        Moving objects are blurred, or skewed by the `readout`. `exposure`, `readout` (seconds) and `direction` are as
        in `moving`. The world moves during the exposure: the time of `World.at` is the middle, (readout + exposure)
        / 2. `World.camera_at` adds the camera's motion in the video.
        """
        shutter = {"exposure": number("exposure", exposure), "readout": number("readout", readout)}
        return self.still()._changed(shutter={**shutter, "direction": direction})

    def _as_pose(self, pose: dict[str, Any]) -> dict[str, Any]:
        """Returns the description `pose` with this camera's `K` added, unless `pose` contains K."""
        return {"K": self.K.tolist(), **pose}

    def still(self) -> Self:
        """Returns the camera at rest, at the middle of its motion."""
        if self.shutter is None:
            return self
        return self._changed(shutter=None, **self._as_pose(_pose(self)))


def _moment(given: Any) -> tuple[float, Any]:
    """Checks an entry of a track, and returns its time in seconds and its camera."""
    try:
        time, camera = given
    except (TypeError, ValueError):
        raise CameraError(
            f"a track must be a list of (seconds, camera), got {given!r}", code="wrong_type"
        ) from None
    return time, camera


def _pose(camera: CameraGeometry) -> dict[str, Any]:
    refuse_other_types(camera)
    return {"R": camera.R.tolist(), "C": camera.location.tolist()}
