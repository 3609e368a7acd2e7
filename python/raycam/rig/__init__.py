"""Rigs: several cameras on one moving body."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Self

import numpy as np
import numpy.typing as npt

from .. import _core
from .._serialization import DictSerializable
from ..annotations.flow import disparity
from ..arrays import Floats
from ..camera import Camera
from ..camera._arguments import Up, checked_up, matrix, number, vector
from ..camera._optics import Readout
from ..errors import CameraError, nearest
from ..render import channel_names, render
from ..render.frame import Frame
from ._rectify import rectified

if TYPE_CHECKING:
    from ..world import World

__all__ = ["Rig"]

CAMERA_FROM_BODY = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])
"""The axes of a camera that looks along the x axis of a body with its z axis upwards."""


class Rig(DictSerializable, Mapping[str, Camera]):
    """Cameras that one body carries, immutable: a mapping from their names to the cameras in the world.

    `cameras` are those in the axes of the body: their `R` is camera_from_body, their `C` the centre there. The body
    is placed by `R` [3, 3], the rotation body_from_world, and `C` [3], where it is in the world; so a camera in the
    world has the rotation camera_from_body · body_from_world. Where angles place a body (`placed`, world files,
    videos), its axes are those of ROS REP-103: x ahead, y left, z up. Otherwise they may be any: Kalibr's body is the
    IMU, COLMAP's and KITTI's is the first camera.

    Raises `CameraError` where there are no cameras, or the pose is no rotation and finite place.
    """

    __slots__ = ("_cameras", "_core", "_up")

    def __init__(
        self,
        cameras: Mapping[str, Camera],
        R: npt.ArrayLike = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)),
        C: npt.ArrayLike = (0.0, 0.0, 0.0),
        *,
        name: str = "rig",
        up: Up = "z",
    ) -> None:
        named = [(key, camera._core) for key, camera in cameras.items()]
        self._set(_core.Rig(name, matrix("R", R).tolist(), vector("C", C), named), up)

    def _set(self, core: _core.Rig, up: str) -> None:
        self._core = core
        self._up = checked_up(up)
        self._cameras = {name: Camera._of(camera, self._up) for name, camera in core.cameras()}

    @classmethod
    def _of(cls, core: _core.Rig, up: str) -> Self:
        rig = cls.__new__(cls)
        rig._set(core, up)
        return rig

    @classmethod
    def of(
        cls,
        cameras: Mapping[str, Camera],
        R: npt.ArrayLike | None = None,
        C: npt.ArrayLike | None = None,
        *,
        name: str = "rig",
    ) -> Self:
        """The rig of cameras as they stand in the world, on a body at `R` and `C`, by default those of the first one.

        Raises `CameraError` for a camera that has no place, of a matrix with its centre at infinity.
        """
        if not cameras:
            raise CameraError("a rig without cameras; expected at least one")
        for key, camera in cameras.items():
            if camera._core.center == "infinity":
                raise CameraError(
                    f"camera {key!r} has its centre at infinity: no body can carry it, it is nowhere"
                )
        first = next(iter(cameras.values()))
        turn = first.R if R is None else matrix("R", R)
        place = first.location if C is None else np.array(vector("C", C))
        mounts = {
            key: camera.at_pose(camera.R @ turn.T, turn @ (camera.location - place))
            for key, camera in cameras.items()
        }
        return cls(mounts, turn, place, name=name, up=first.up)

    @classmethod
    def stereo(cls, camera: Camera, baseline: float, *, name: str = "stereo") -> Self:
        """A rectified pair: `camera` as "left", and the same `baseline` metres to its right as "right".

        The body is the left camera. Raises `CameraError` where the baseline is not greater than 0.
        """
        length = number("baseline", baseline)
        if not 0.0 < length < np.inf:
            raise CameraError(f"baseline is {baseline}; expected metres to the right camera, more than 0")
        right = camera.at_pose(camera.R, camera.location + length * camera.R[0])
        return cls.of({"left": camera, "right": right}, name=name)

    @classmethod
    def from_dict(cls, description: Mapping[str, Any], *, up: Up = "z") -> Self:
        """The rig of a `[rig]` table of a world file, as a dict; `to_dict` makes one.

        Raises `WorldError` or `CameraError` with the key at fault.
        """
        return cls._of(_core.Rig.from_dict(dict(description), checked_up(up)), up)

    def to_dict(self) -> dict[str, Any]:
        """All of it as a `[rig]` table of a world file: `from_dict` gives the same rig to the last digit."""
        description: dict[str, Any] = json.loads(self._core.to_json())
        return description

    # Its cameras ------------------------------------------------------------------------------------------

    def __getitem__(self, name: str) -> Camera:
        """A camera in the world; `KeyError` where there is none of that name."""
        return self._cameras[name]

    def __iter__(self) -> Iterator[str]:
        """The names of the cameras."""
        return iter(self._cameras)

    def __len__(self) -> int:
        """How many cameras it has."""
        return len(self._cameras)

    @property
    def mounts(self) -> dict[str, Camera]:
        """The cameras in the axes of the body."""
        return {name: Camera._of(camera, "z") for name, camera in self._core.mounts()}

    @property
    def name(self) -> str:
        """What it is asked for by in a world."""
        return self._core.name

    @property
    def R(self) -> Floats:
        """The rotation body_from_world [3, 3]; of a moving body, that of the middle of its motion."""
        return np.array(self._core.r)

    @property
    def C(self) -> Floats:
        """Where the body is in the world [3]."""
        return np.array(self._core.c)

    @property
    def up(self) -> Up:
        """The axis of the world that `roll_pitch_yaw` calls up."""
        return self._up

    @property
    def roll_pitch_yaw(self) -> Floats:
        """Roll, pitch and yaw [3] in degrees of a body with the axes x ahead, y left, z up, as `placed` takes them."""
        ahead = Camera(np.eye(3), CAMERA_FROM_BODY @ self.R, self.C, (1, 1), up=self._up)
        return ahead.roll_pitch_yaw

    @property
    def shutter(self) -> dict[str, Any] | None:
        """`exposure`, `readout`, `direction` and the `track` of the body; None where it stands."""
        table: dict[str, Any] | None = self.to_dict().get("shutter")
        return table

    def baseline(self, first: str | None = None, second: str | None = None) -> Floats:
        """From the centre of one camera to that of another [3], in the axes of the first, in metres.

        The cameras are by name; not given, they are the first and the second of the rig.
        """
        left, right = (self[name] for name in self.pair(first, second))
        return left.R @ (right.C - left.C)

    def pair(self, first: str | None = None, second: str | None = None) -> tuple[str, str]:
        """The names of two of its cameras, the first two where not given; raises `CameraError` where there are none."""
        names = list(self)
        if len(names) < 2:
            raise CameraError(f"a pair of cameras is asked for, and the rig {self.name!r} has one")
        chosen = (first or names[0], second or next(name for name in names if name != (first or names[0])))
        for name in chosen:
            if name not in self:
                raise CameraError(nearest("camera", name, names))
        return chosen

    # Elsewhere --------------------------------------------------------------------------------------------

    def at_pose(self, R: npt.ArrayLike, C: npt.ArrayLike) -> Self:
        """The same rig at another pose of its body: body_from_world [3, 3] and its place. A moving one moves along."""
        return self._of(self._core.at_pose(matrix("R", R).tolist(), vector("C", C)), self._up)

    def placed(
        self, location: npt.ArrayLike, roll: float = 0.0, pitch: float = 0.0, yaw: float = 0.0
    ) -> Self:
        """The same rig with its body at `location` [3], its axes turned by angles in degrees as of a camera's pose."""
        ahead = Camera.from_pose(location, roll, pitch, yaw, focal=1.0, size=(1, 1), up=self._up)
        return self.at_pose(CAMERA_FROM_BODY.T @ ahead.R, ahead.C)

    def moving(
        self,
        to: Rig | Sequence[tuple[float, Rig]],
        *,
        exposure: float = 0.0,
        readout: float = 0.0,
        direction: Readout = "down",
    ) -> Self:
        """The same rig whose body moves while the shutters of all its cameras are open, as `Camera.moving` describes.

        The body moves from its own pose to that of `to`, or along a list of (seconds, rig): its place on lines, its
        rotation the shortest way, both evenly; cameras far from the axis go along arcs.
        """
        shutter: dict[str, Any] = {
            "exposure": number("exposure", exposure),
            "readout": number("readout", readout),
            "direction": direction,
        }
        table = self.still().to_dict()
        if isinstance(to, Sequence):
            shutter["track"] = [{"time": number("time", time), "pose": _pose(rig)} for time, rig in to]
            del table["R"], table["C"]
        else:
            shutter["end"] = _pose(to)
        return self._of(_core.Rig.from_dict({**table, "shutter": shutter}, self._up), self._up)

    def still(self) -> Self:
        """The same rig standing where its body is in the middle of its motion."""
        table = self.to_dict()
        if table.pop("shutter", None) is None:
            return self
        return self._of(_core.Rig.from_dict({**table, **_pose(self)}, self._up), self._up)

    # Pictures ---------------------------------------------------------------------------------------------

    def render(
        self,
        world: World,
        *,
        channels: Sequence[str] | str = ("color", "depth", "instance", "triangle"),
        pair: tuple[str, str] | None = None,
        **options: Any,
    ) -> dict[str, Frame]:
        """What each camera sees, by name; `options` are those of `raycam.render`.

        `channels` may have "disparity" as well, float32 [h, w] in pixels, of the rectified `pair` (left, right): the
        frames of both have it, as `raycam.disparity` describes, each as its own camera sees it. The pair is the first
        two cameras where not given.

        Raises `CameraError` where the pair is not rectified (see `rectified`), and what `raycam.render` raises.
        """
        asked = [channels] if isinstance(channels, str) else list(channels)
        names = [name for name in asked if name != "disparity"]
        found: dict[str, npt.NDArray[Any]] = {}
        if len(names) < len(asked):
            left, right = self.pair(*(pair or ()))
            cameras, threads = (self[left], self[right]), options.get("threads")
            found[left] = disparity(world, *cameras, of="left", threads=threads)["disparity"]
            found[right] = disparity(world, *cameras, of="right", threads=threads)["disparity"]
        plain = channel_names("all" if names == ["all"] else names or ["depth"])
        frames = {}
        for name, camera in self.items():
            frame = render(world, camera, channels=plain, **options)
            planes = {key: frame[key] for key in frame if names}
            if name in found:
                x, y, width, height = frame.region
                planes["disparity"] = np.ascontiguousarray(found[name][y : y + height, x : x + width])
            frames[name] = Frame(
                planes,
                camera=camera,
                size=frame.size,
                region=frame.region,
                exposure=frame.exposure,
                view=frame.view,
                transparent=frame.transparent,
                notices=frame.notices,
            )
        return frames

    def rectified(
        self,
        left: str | None = None,
        right: str | None = None,
        *,
        K: npt.ArrayLike | None = None,
        size: Sequence[int] | None = None,
    ) -> Rig:
        """The rectified pair of two of its cameras: pinholes "left" and "right" whose rows fit one another.

        Both get the rotation halfway between theirs, turned the least so that x runs along the baseline, and the same
        `K`: the mean of their focal lengths along y, and a principal point at which the middles of both pictures lie
        in the middle, where not given. `size` is that of the left camera. The body is the left camera.

        Raises `CameraError` where the second camera is not to the right of the first (it is above, below, or to the
        left), and for parallel rays.

        Source: Bouguet's algorithm as in OpenCV, `stereoRectify`, whose rotations these are.
        """
        names = self.pair(left, right)
        return Rig.of(rectified(self[names[0]], self[names[1]], K, size), name=self.name)

    def __repr__(self) -> str:
        """The body and its cameras, for people."""
        with np.printoptions(precision=6, suppress=True, floatmode="maxprec"):
            angles = ", ".join(f"{angle:.6g}" for angle in self.roll_pitch_yaw)
            body = f"Rig {self.name!r} at C = {self.C}; roll, pitch, yaw = {angles} degrees ({self._up} up)"
            mounts = self._core.mounts()
            return "\n    ".join(
                [body, *(f"{name}: at {np.array(camera.c)} of the body" for name, camera in mounts)]
            )


def _pose(rig: Rig) -> dict[str, Any]:
    return {"R": rig.R.tolist(), "C": rig.C.tolist()}
