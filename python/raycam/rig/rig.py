"""Rigs: several cameras and other sensors on one moving body."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Self

import numpy as np
import numpy.typing as npt

from .. import _core
from .._serialization import DictSerializable
from ..arguments import Floats, one_of, product, word
from ..camera import Camera
from ..camera._arguments import Up, checked_up, matrix, number, vector
from ..camera._optics import Readout
from ..errors import CameraError
from ..io.html_form import html_table
from ..read_only import ReadOnlyDict, read_only_array
from ..sensors import Sensor, describe_sensor
from ..sensors.sensor import LIDAR, read_mounted_sensors, require_sensor
from ._rectify import rectified

if TYPE_CHECKING:
    from ..render.frame import Frame
    from ..world import World

__all__ = ["Rig"]

CAMERA_FROM_BODY = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])
"""The rotation camera_from_body of a camera that looks along the body's x axis, with the body's z axis up."""

RIG_REMEDY = "rigs are read-only; rig.at_pose(R, C) returns a rig at another pose"
"""Error message if a rig's array is changed."""


class Rig(DictSerializable, Mapping[str, Camera]):
    """Cameras mounted on one body: a mapping from names to cameras in world coordinates.

    A rig is immutable. `cameras` are given in body coordinates: their `R` is camera_from_body, their `C` the centre on
    the body. The body's pose is `R` [3, 3], the rotation body_from_world, and `C` [3], its position in the world. The
    rotation of a camera in the world is camera_from_body · body_from_world. If angles specify the pose (`placed`, world
    files, videos), the body axes are those of ROS REP-103: x forward, y left, z up. Otherwise, the body axes are
    arbitrary: Kalibr's body is the IMU, COLMAP's and KITTI's body is the first camera.

    `cameras` may also contain other sensors (`raycam.Sensor`), whose pose is then body_from_sensor; `sensors` lists
    them. Raises `CameraError` if there are no sensors, or if the pose is not a rotation and a finite position, and
    `SettingsError` for an object that is not a sensor.
    """

    __slots__ = ("_cameras", "_core", "_mounted", "_up")

    def __init__(
        self,
        cameras: Mapping[str, Camera | Sensor],
        R: npt.ArrayLike = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)),
        C: npt.ArrayLike = (0.0, 0.0, 0.0),
        *,
        name: str = "rig",
        up: Up = "z",
    ) -> None:
        if not isinstance(cameras, Mapping):
            raise CameraError(
                f"cameras must be a mapping from names to cameras, not {cameras!r}", code="wrong_type"
            )
        if not cameras:
            raise CameraError(
                "the rig has no sensors; expected at least one camera or lidar", code="missing_value"
            )
        named = {word("sensor names", key): item for key, item in cameras.items()}
        mounts = [(key, item._core) for key, item in named.items() if isinstance(item, Camera)]
        others = {
            key: require_sensor(f"cameras[{key!r}]", item)
            for key, item in named.items()
            if not isinstance(item, Camera)
        }
        self._set(_core.Rig(word("name", name), matrix("R", R).tolist(), vector("C", C), mounts), up, others)

    def _set(self, core: _core.Rig, up: str, mounted: Mapping[str, Sensor]) -> None:
        self._core = core
        self._up = checked_up(up)
        self._mounted = dict(mounted)
        self._cameras = {name: Camera._of(camera, self._up) for name, camera in core.cameras()}

    @classmethod
    def _of(cls, core: _core.Rig, up: str, mounted: Mapping[str, Sensor] | None = None) -> Self:
        rig = cls.__new__(cls)
        rig._set(core, up, mounted or {})
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
        """Returns a rig of cameras in world coordinates, on a body at `R` and `C`.

        `R` [3, 3] is the rotation body_from_world, and `C` [3] the body's position in the world; by default, they are
        the first camera's pose. `cameras` are cameras by name, and `name` is the rig's name in a world. Raises
        `CameraError` for a camera with its centre at infinity.
        """
        if not cameras:
            raise CameraError("cameras is empty; a rig requires at least one camera", code="missing_value")
        for key, camera in cameras.items():
            if not isinstance(camera, Camera):
                raise CameraError(
                    f"cameras[{key!r}] must be a camera, not {camera!r}; mount other sensors with "
                    "raycam.Rig({name: sensor, ...})",
                    code="wrong_type",
                )
            if camera._core.center == "infinity":
                raise CameraError(
                    f"camera {key!r} cannot be mounted on a body, because its centre is at infinity",
                    code="unsupported_camera",
                )
        first = next(iter(cameras.values()))
        turn = first.R if R is None else matrix("R", R)
        place = first.location if C is None else np.array(vector("C", C))
        mounts = {
            key: camera.at_pose(product(camera.R, turn.T), product(turn, camera.location - place))
            for key, camera in cameras.items()
        }
        return cls(mounts, turn, place, name=name, up=first.up)

    @classmethod
    def stereo(cls, camera: Camera, baseline: float, *, name: str = "stereo") -> Self:
        """Returns a rectified pair of cameras, "left" and "right".

        `camera` is the left camera; the right camera is a copy, `baseline` metres to its right. The body is the left
        camera. `name` is the rig's name in a world. Raises `CameraError` for a baseline that is not greater than 0.
        """
        length = number("baseline", baseline)
        if not 0.0 < length < np.inf:
            raise CameraError(
                f"baseline is {baseline}; expected the distance to the right camera in metres, more than 0",
                code="out_of_range",
            )
        right = camera.at_pose(camera.R, camera.location + length * camera.R[0])
        return cls.of({"left": camera, "right": right}, name=name)

    @classmethod
    def from_dict(cls, description: Mapping[str, Any], *, up: Up = "z") -> Self:
        """Returns the rig that a `[rig]` table of a world file describes.

        `description` is the table as a dict (see `to_dict`), and `up` is the world's up axis. Raises `WorldError` or
        `CameraError` with the name of the invalid key.
        """
        table = dict(description)
        core = _core.Rig.from_dict(table, checked_up(up))
        rows, tables = core.sensors(), table.get("sensor", ())
        descriptions = iter([tables] if isinstance(tables, Mapping) else tables)
        for place, (name, kind, _, pose, files) in enumerate(rows):
            if kind != LIDAR:  # the description as given, because the core's JSON cannot represent infinity
                settings = json.dumps(next(descriptions).get("description", {}))
                rows[place] = (name, kind, settings, pose, files)
        return cls._of(core, up, read_mounted_sensors(rows, "z", imports=True))

    def to_dict(self) -> dict[str, Any]:
        """Returns the rig as a `[rig]` table of a world file.

        `from_dict` restores exactly the same rig. Sensors that are not cameras are listed under "sensor".
        """
        description: dict[str, Any] = json.loads(self._core.to_json())
        if self._mounted:
            description["sensor"] = [
                {"name": name, **describe_sensor(sensor)} for name, sensor in self._mounted.items()
            ]
        return description

    def _key(self) -> tuple[str, str]:
        """The description used to compare rigs."""
        return self._up, json.dumps(self.to_dict(), sort_keys=True) if self._mounted else self._core.to_json()

    def _moved(self, core: _core.Rig) -> Self:
        """Returns the rig with another body pose or motion, and the same sensors."""
        return self._of(core, self._up, self._mounted)

    # Cameras ----------------------------------------------------------------------------------------------

    def __getitem__(self, name: str) -> Camera:
        """The camera with this name in world coordinates; raises `KeyError` for an unknown name."""
        return self._cameras[name]

    def __iter__(self) -> Iterator[str]:
        """Iterates over the names of the cameras."""
        return iter(self._cameras)

    def __len__(self) -> int:
        """The number of cameras."""
        return len(self._cameras)

    @property
    def mounts(self) -> dict[str, Camera]:
        """The cameras in body coordinates, by name."""
        mounts = {name: Camera._of(camera, "z") for name, camera in self._core.mounts()}
        return ReadOnlyDict(
            mounts, "rigs are read-only; raycam.Rig(mounts, rig.R, rig.C) returns another rig", CameraError
        )

    @property
    def sensors(self) -> dict[str, Sensor]:
        """All sensors by name, in world coordinates at the middle of the body's motion.

        Cameras come first. As a mapping, the rig contains the cameras only.
        """
        found: dict[str, Sensor] = dict(self._cameras)
        for name, sensor in self._mounted.items():
            pose = sensor.pose
            body_from_sensor, position = pose[:3, :3], pose[:3, 3]
            R = product(body_from_sensor.T, self.R)
            found[name] = sensor.at_pose(R, self.C + product(self.R.T, position))
        return ReadOnlyDict(
            found, "rigs are read-only; raycam.Rig(sensors, rig.R, rig.C) returns another rig", CameraError
        )

    @property
    def name(self) -> str:
        """The rig's name in a world."""
        return self._core.name

    @property
    def R(self) -> Floats:
        """The rotation body_from_world [3, 3]; for a moving body, at the middle of its motion."""
        return read_only_array(self._core.r, RIG_REMEDY, CameraError)

    @property
    def C(self) -> Floats:
        """The body's position [3] in the world."""
        return read_only_array(self._core.c, RIG_REMEDY, CameraError)

    @property
    def up(self) -> Up:
        """The world's up axis for `roll_pitch_yaw`: "z" or "y"."""
        return self._up

    @property
    def roll_pitch_yaw(self) -> Floats:
        """Roll, pitch and yaw [3] of the body in degrees.

        The body axes are x forward, y left, z up, as in `placed`.
        """
        ahead = Camera(np.eye(3), product(CAMERA_FROM_BODY, self.R), self.C, (1, 1), up=self._up)
        return ahead.roll_pitch_yaw

    @property
    def shutter(self) -> dict[str, Any] | None:
        """`exposure`, `readout`, `direction` and the `track` of the body; None for a body at rest."""
        table: dict[str, Any] | None = self.to_dict().get("shutter")
        if table is None:
            return None
        return ReadOnlyDict(table, "rigs are read-only; rig.moving(...) returns a changed rig", CameraError)

    def baseline(self, first: str | None = None, second: str | None = None) -> Floats:
        """Returns the vector [3] from one camera's centre to another's, in metres.

        The vector is in the axes of the first camera. `first` and `second` are names of cameras (default: the first two
        cameras of the rig). Raises the errors of `pair`.
        """
        left, right = (self[name] for name in self.pair(first, second))
        return product(left.R, right.C - left.C)

    def pair(self, first: str | None = None, second: str | None = None) -> tuple[str, str]:
        """Returns the names of two cameras (default: the first two).

        If only `second` is missing, the first camera other than `first` is used. Raises `CameraError` for an
        unknown name, and if the rig has fewer than two cameras.
        """
        names = list(self)
        if len(names) < 2:
            raise CameraError(
                f"a pair requires two cameras; rig {self.name!r} has {len(names)}", code="missing_value"
            )
        left = names[0] if first is None else one_of("camera", first, names, error=CameraError)
        others = [name for name in names if name != left]
        return left, others[0] if second is None else one_of("camera", second, names, error=CameraError)

    # Poses ------------------------------------------------------------------------------------------------

    def at_pose(self, R: npt.ArrayLike, C: npt.ArrayLike) -> Self:
        """Returns the rig at another pose: `R`, body_from_world [3, 3], and the position `C` [3].

        The motion of the body is transformed in the same way.
        """
        return self._moved(self._core.at_pose(matrix("R", R).tolist(), vector("C", C)))

    def placed(
        self, location: npt.ArrayLike, roll: float = 0.0, pitch: float = 0.0, yaw: float = 0.0
    ) -> Self:
        """Returns the rig with its body at `location` [3], rotated by angles in degrees.

        `roll`, `pitch` and `yaw` are as in `Camera.from_pose`.
        """
        ahead = Camera.from_pose(location, roll, pitch, yaw, focal=1.0, size=(1, 1), up=self._up)
        return self.at_pose(product(CAMERA_FROM_BODY.T, ahead.R), ahead.C)

    def moving(
        self,
        to: Rig | Sequence[tuple[float, Rig]],
        *,
        exposure: float = 0.0,
        readout: float = 0.0,
        direction: Readout = "down",
    ) -> Self:
        """Returns the rig in motion while the shutters of all its cameras are open.

        The motion and the other arguments are as in `Camera.moving`. The body moves from its own pose to the
        pose of `to`, or through the poses of a list of (seconds, rig). Its position is interpolated linearly,
        its rotation along the shortest arc, so cameras away from the body's centre move on arcs.
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
        return self._moved(_core.Rig.from_dict({**table, "shutter": shutter}, self._up))

    def still(self) -> Self:
        """Returns the rig at rest, at the middle of its motion."""
        table = self.to_dict()
        if table.pop("shutter", None) is None:
            return self
        return self._moved(_core.Rig.from_dict({**table, **_pose(self)}, self._up))

    # Images ---------------------------------------------------------------------------------------------

    def render(
        self,
        world: World,
        *,
        channels: Sequence[str] | str = ("color", "depth", "instance", "triangle"),
        pair: tuple[str, str] | None = None,
        **options: Any,
    ) -> dict[str, Frame]:
        """Renders a frame of `world` with each camera; returns the frames by camera name.

        `options` are those of `raycam.render`.

        Each camera has its own random numbers, so that the noise of two images is independent; the first camera has the
        same random numbers as in `raycam.render`.

        `channels` may also contain "disparity", float32 [h, w] in pixels, of the rectified `pair` (left, right;
        default: the first two cameras). Both frames then have this channel, as in `raycam.disparity`.

        Raises `CameraError` if the rig has no camera or if the pair is not rectified (see `rectified`), and the errors
        of `raycam.render`.
        """
        from ..annotations.rig_frames import render_rig

        return render_rig(self, world, channels=channels, pair=pair, **options)

    def rectified(
        self,
        left: str | None = None,
        right: str | None = None,
        *,
        K: npt.ArrayLike | None = None,
        size: Sequence[int] | None = None,
    ) -> Rig:
        """Returns a rectified pair, whose image rows correspond, for two cameras.

        `left` and `right` are names of cameras (default: the first two). The pair consists of the pinholes "left" and
        "right". Both pinholes have the same `K` and the same rotation: halfway between the two cameras, and turned by
        the smallest angle that makes x parallel to the baseline. By default, `K` has the mean of the two cameras' focal
        lengths along y, and a principal point that keeps both image centres in the centre on average. The default
        `size` is the left camera's. The body is the left camera.

        Raises `CameraError` if the second camera is above, below or to the left of the first, and for parallel rays.

        Source: Bouguet's algorithm as in OpenCV's `stereoRectify`, with identical rotations.
        """
        names = self.pair(left, right)
        return Rig.of(rectified(self[names[0]], self[names[1]], K, size), name=self.name)

    def _repr_html_(self) -> str:
        """The table of cameras that a notebook shows."""
        rows = [
            (name, f"{one.size[0]} x {one.size[1]}", one.C.round(6).tolist()) for name, one in self.items()
        ]
        return html_table(repr(self).partition("\n")[0], ("camera", "size", "C"), rows)

    def __repr__(self) -> str:
        """The body and its sensors as text."""
        with np.printoptions(precision=6, suppress=True, floatmode="maxprec"):
            angles = ", ".join(f"{angle:.6g}" for angle in self.roll_pitch_yaw)
            body = f"Rig {self.name!r} at C = {self.C}; roll, pitch, yaw = {angles} degrees ({self._up} up)"
            places = {name: np.array(camera.c) for name, camera in self._core.mounts()}
            places |= {name: sensor.pose[:3, 3] for name, sensor in self._mounted.items()}
            return "\n    ".join(
                [body, *(f"{name}: at {place} of the body" for name, place in places.items())]
            )


def _pose(rig: Rig) -> dict[str, Any]:
    return {"R": rig.R.tolist(), "C": rig.C.tolist()}
