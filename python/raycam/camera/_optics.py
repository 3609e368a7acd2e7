"""What a camera has beside its matrix and its lens: aperture, vignetting, exposure and motion."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Literal, Self

import numpy as np
import numpy.typing as npt

from ..arrays import floats
from ..errors import CameraError
from ._arguments import number

if TYPE_CHECKING:
    from . import Camera

__all__ = ["Optics"]

Readout = Literal["down", "up", "right", "left"]


class Optics:
    """Copies of a `Camera` with other optics. Ground truth keeps to the middle of the lens and of the exposure."""

    __slots__ = ()

    def _changed(self, **tables: Any) -> Self:
        camera: Any = self
        table = camera.to_dict() | tables
        present = {name: value for name, value in table.items() if value is not None}
        changed: Self = camera.from_dict(present, up=camera.up)
        return changed

    def _table(self, name: str) -> dict[str, Any] | None:
        camera: Any = self
        table: dict[str, Any] | None = camera.to_dict().get(name)
        return table

    @property
    def aperture(self) -> dict[str, Any] | None:
        """`radius`, `focus`, `blades` and `rotation`; None for a pinhole."""
        return self._table("aperture")

    @property
    def vignetting(self) -> dict[str, Any] | None:
        """`cos4` and `polynomial`; None where all light arrives."""
        return self._table("vignetting")

    @property
    def shutter(self) -> dict[str, Any] | None:
        """`exposure`, `readout`, `direction` and the `track` of poses; None for a camera without a shutter."""
        return self._table("shutter")

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
        """The same camera with depth of field: a thin lens of a `radius`, or `focal_length` / (2 `f_number`).

        Lengths are in units of the world (50 mm is 0.05). What is at the depth `focus` is sharp; with lenses other
        than a pinhole, "opencv" and "fov", what is at that distance. The opening is round, or a polygon with `blades`
        sides, turned by `rotation` degrees from the camera's x towards its y. The colour is blurred where there is
        more than one sample a pixel; all other channels are those of the ray through the middle.

        Raises `CameraError` or `WorldError` where a number makes no sense, and for parallel rays.
        """
        given = {"radius": radius, "f_number": f_number, "focal_length": focal_length}
        sizes = {name: number(name, value) for name, value in given.items() if value is not None}
        rest = {"focus": number("focus", focus), "blades": blades, "rotation": number("rotation", rotation)}
        return self._changed(aperture=sizes | rest)

    def with_vignetting(self, *, cos4: bool = False, polynomial: npt.ArrayLike = ()) -> Self:
        """The same camera with less light away from the middle.

        The factor of the colour is 1 + a r² + b r⁴ + ... with the coefficients `polynomial`, r being the distance
        from the principal point in focal lengths, times cos⁴ of the angle to the principal axis if `cos4`.
        """
        terms = floats("polynomial", np.asarray(polynomial, dtype=float), ("n",), error=CameraError).tolist()
        return self._changed(vignetting={"cos4": cos4, "polynomial": terms})

    def moving(
        self,
        to: Camera | Sequence[tuple[float, Camera]],
        *,
        exposure: float = 0.0,
        readout: float = 0.0,
        direction: Readout = "down",
    ) -> Self:
        """The same camera moving while its shutter is open: motion blur, and with a `readout` a rolling shutter.

        Lines (rows from the top for `direction` "down", from the bottom for "up"; columns for "right" and "left")
        open one after another within `readout` seconds, each for `exposure` seconds. A line at the fraction f of the
        picture is open from f readout to f readout + exposure. It moves from its own pose, when the first line opens,
        to that of the camera `to`, when the last one closes; or along a list of (seconds, camera). Centres move
        on lines, rotations the shortest way, both evenly.

        The pose (`R`, `C`, `P`) of the result is that of the middle, (readout + exposure) / 2. `rays`, `project` and
        all channels but `color` are those of the middle of each line's exposure.
        """
        shutter: dict[str, Any] = {
            "exposure": number("exposure", exposure),
            "readout": number("readout", readout),
            "direction": direction,
        }
        if isinstance(to, Sequence):
            shutter["track"] = [{"time": number("time", time), "pose": _pose(camera)} for time, camera in to]
            nowhere = dict.fromkeys(("R", "C", "matrix"))
            return self.still()._changed(**self._as_pose({}), **nowhere, shutter=shutter)
        shutter["end"] = _pose(to)
        return self.still()._changed(shutter=shutter)

    def exposing(self, exposure: float, *, readout: float = 0.0, direction: Readout = "down") -> Self:
        """The same camera standing while its shutter is open: what moves before it is blurred, or leans.

        Times and lines are as in `moving`. A world at a time (`World.at`) moves on meanwhile: its own time is that of
        the middle, (readout + exposure) / 2. `World.camera_at` lets such a camera move on as the video moves it.
        """
        shutter = {"exposure": number("exposure", exposure), "readout": number("readout", readout)}
        return self.still()._changed(shutter={**shutter, "direction": direction})

    def _as_pose(self, pose: dict[str, Any]) -> dict[str, Any]:
        """K in place of a matrix."""
        camera: Any = self
        return {"K": camera.K.tolist(), **pose}

    def still(self) -> Self:
        """The same camera standing where it is in the middle of its motion."""
        if self.shutter is None:
            return self
        return self._changed(shutter=None, **self._as_pose(_pose(self)))


def _pose(camera: Any) -> dict[str, Any]:
    return {"R": camera.R.tolist(), "C": camera.location.tolist()}
