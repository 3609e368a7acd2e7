"""The class `Lidar`: a device or pattern, its settings and its pose."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping, Sequence, Sized
from typing import TYPE_CHECKING, Any, Literal, Self, TypeGuard

import numpy as np
import numpy.typing as npt

from ..arguments import Floats, flag, floats, product, real
from ..errors import LidarError, nearest
from ..rotations import rotation_of
from .device import device_description
from .mirrors import frame_rate, mirror_table
from .ouster import ouster_metadata
from .pattern import Pattern, check_count
from .patterns import check_family, make_pattern, ouster_unit
from .pose import Track
from .settings import SETTING_CHECKS, Returns

if TYPE_CHECKING:
    from ..world import World

__all__ = ["LIGHT_SPEED", "MAX_RING", "Lidar"]

FWHM_TO_FULL = math.sqrt(2.0 / math.log(2.0))
"""The width of a Gaussian beam at 1/e² divided by its full width at half maximum: 1.699."""

MAX_RING = (1 << 31) - 1
"""The largest absolute ring number."""
LIGHT_SPEED = 299792458.0
"""The speed of light in metres per second."""


class Lidar:
    """A lidar at a pose: a device by name, a calibration or any pattern.

    Lidars are immutable. `load_lidar` returns the lidar of a calibration, and `Lidar.of` the lidar of a
    pattern.

        lidar = raycam.Lidar("vlp16", rate=10).placed([0, 0, 1.8], yaw=90)
        scan = raycam.scan(world, lidar)

    Sensor axes are x forward, y left, z up. `rate` is in frames per second. The settings, which default to the device's
    numbers and can be changed with `replace`:

    =============== ============================================================================================
    returns         "first", "last", "strongest", "dual" (strongest and last) or "all"
    mode            Ouster: columns and rate, such as "1024x10"
    beam_samples    rays per pulse: 1 (the beam's axis), 7, 19 or 37
    beam_width      width of the beam at its origin, at 1/e², in metres: one number, or (horizontal, vertical)
    beam_divergence full divergence at 1/e², in radians: one number, or (horizontal, vertical)
    range_10        distance at which a target of 10 % reflectance is detected with probability 1/2, in metres
    min_range, max_range   limits of the measured distance, in metres
    range_noise     standard deviation of the distance at high signal, in metres
    azimuth_noise   standard deviation of the azimuth of a column, in degrees
    step            distances are rounded to multiples of this length in metres; 0: not rounded
    pulse_length    full width at half maximum of the pulse, in seconds
    rise_time       rise time of the pulse, in seconds; determines the distance noise of weak echoes
    wavelength      in nanometres
    visibility      visibility in fog, in metres: the attenuation is ln(20) / visibility (default: the world's fog;
                    infinite: no fog)
    overlap         pairs (distance in metres, share of the light that reaches the receiver), by ascending distance
    signal_gain     counts of the field `signal` for a white target at normal incidence at 1 m
    waveform        True: the field `waveform`
    near_ir_samples light paths per point for the field `near_ir` (default: 0, without this field)
    near_ir_gain    counts of near infrared light in packets for a radiance of 1 W/(m² sr)
    max_bounces     interfaces of mirrors and glass that a ray follows (default: 2)
    noise           False: no noise and no rounding; echoes are found if their probability is at least 1/2
    seed            selects the random numbers
    =============== ============================================================================================

    Numbers that were not found in the manufacturer's documents are not set: without `range_10`, every echo
    within `max_range` is detected; without `beam_divergence`, `beam_samples` must be 1.

    Raises `LidarError` for an unknown device, an unsupported rate, and impossible settings.
    """

    __slots__ = ("_description", "_settings", "_track", "_up")

    def __init__(
        self,
        device: str,
        *,
        rate: float | None = None,
        force_rate: bool = False,
        up: Literal["z", "y"] = "z",
        **settings: Any,
    ) -> None:
        self._start(device_description(device), up)
        self._set({"rate": rate, "force_rate": force_rate, **settings})

    def _start(self, description: dict[str, Any], up: str) -> None:
        check_family(description)
        if up not in ("z", "y"):
            raise LidarError(f'up is {up!r}; expected "z" or "y"', code="unknown_name")
        self._description, self._up = description, up
        self._settings: dict[str, Any] = {}
        self._track = Track(np.zeros(1), rotation_of(0.0, 0.0, 0.0, up)[None], np.zeros((1, 3)))

    @classmethod
    def _described(cls, description: dict[str, Any], settings: Mapping[str, Any], up: str = "z") -> Self:
        lidar = cls.__new__(cls)
        lidar._start(description, up)
        lidar._set(settings)
        return lidar

    @classmethod
    def of(
        cls,
        directions: npt.ArrayLike,
        *,
        times: npt.ArrayLike | None = None,
        rings: npt.ArrayLike | None = None,
        origins: npt.ArrayLike | None = None,
        rate: float = 10.0,
        name: str = "pattern",
        **settings: Any,
    ) -> Self:
        """Returns a lidar with any pattern: `directions` [n, 3] in sensor axes, of any length.

        `rate` is in frames per second, `name` is the lidar's name, and `settings` are those of `Lidar`. `times` [n] are
        seconds from the frame's start (default: 0), in ascending order; `rings` [n] are integers (default: 0);
        `origins` [n, 3] are the starting points of the beams (default: the sensor's origin). Raises `LidarError`, with
        the row, for a number that is not finite, a zero direction, or a time that is less than the previous one. Raises
        `MemoryError` for more than 67,108,864 directions.
        """
        if isinstance(directions, Sized):
            check_count(len(directions))  # before a copy is allocated
        ways = floats("directions", directions, ("n", 3), error=LidarError)
        count = len(ways)
        moments = np.zeros(count) if times is None else floats("times", times, ("n",), error=LidarError)
        starts = None if origins is None else floats("origins", origins, ("n", 3), error=LidarError)
        numbers = None if rings is None else np.asarray(rings)
        for label, array in (("times", moments), ("rings", numbers), ("origins", starts)):
            if array is not None and len(array) != count:
                raise LidarError(
                    f"{label} has {len(array)} rows for {count} directions; expected one row for each direction",
                    code="wrong_shape",
                )
        for label, array in (("directions", ways), ("times", moments), ("origins", starts)):
            if array is not None and not np.isfinite(array).all():
                row = int(np.flatnonzero(~np.isfinite(array).reshape(count, -1).all(axis=1))[0])
                raise LidarError(
                    f"{label}[{row}] is {array[row].tolist()}; expected finite numbers", code="out_of_range"
                )
        late = np.flatnonzero(np.diff(moments) < 0.0)
        if len(late):
            row = int(late[0]) + 1
            raise LidarError(
                f"times[{row}] is {moments[row]}, less than times[{row - 1}] = {moments[row - 1]}",
                code="unordered_times",
            )
        zero = np.flatnonzero(~(np.abs(ways).max(axis=1, initial=0.0) > 0.0))
        if len(zero):
            raise LidarError(f"directions[{zero[0]}] is zero; expected a direction", code="out_of_range")
        if numbers is not None and numbers.dtype.kind not in "iu":
            raise LidarError(f"rings must be integers, not of dtype {numbers.dtype}", code="wrong_type")
        if (
            numbers is not None
            and len(numbers)
            and max(abs(int(numbers.min())), int(numbers.max())) > MAX_RING
        ):
            raise LidarError(
                f"rings are {numbers.min()} to {numbers.max()}; expected numbers within +-{MAX_RING}",
                code="out_of_range",
            )
        table: dict[str, Any] = {"directions": ways.tolist(), "times": moments.tolist()}
        if numbers is not None:
            table["rings"] = numbers.tolist()
        if starts is not None:
            table["origins"] = starts.tolist()
        description = {"name": name, "title": name, "family": "table", "table": table, "max_returns": 15}
        return cls._described(description, {"rate": rate, **settings})

    @classmethod
    def with_mirror(
        cls, kind: str, *, rate: float | None = None, name: str | None = None, **numbers: Any
    ) -> Self:
        """Returns a scanner with a moving mirror; the middle of the scan is the sensor's x axis.

        `kind` is the kind of mirror, with these `numbers`:

        ============== ===========================================================================================
        polygon        `facets`, `line_rate` (lines per second), `field_of_view` (degrees): lines from right to left
        oscillating    `frequency` (hertz), `field_of_view`: the mirror swings as a sine, to the left first
        conical        `frequency`, `tilt` (degrees, of the mirror's normal from its axis, which is at 45 degrees to
                       the laser): ovals around the x axis
        survey         `elevations` and `azimuths` as (from, to, step) in degrees: upward lines, one after another
                       counterclockwise; `pause`: the time between lines, as a share of a line (default: 0)
        ============== ===========================================================================================

        Each kind requires `pulse_rate` in hertz. Other keywords are settings of the lidar. `name` is the
        lidar's name. `rate` is the number of frames per second (default: 10; for a survey, a frame is the
        whole grid). The mirror's motion continues from frame to frame. For a scanner that looks down, place
        it with `pitch=90`.

        Raises `LidarError` for unknown, missing and impossible numbers, and `MemoryError` for too many pulses.
        """
        settings = {
            key: numbers.pop(key) for key in list(numbers) if key in SETTING_CHECKS or key == "force_rate"
        }
        table = mirror_table(kind, numbers)
        title = name or f"{kind} mirror"
        description = {
            "name": title,
            "title": title,
            "family": "mirror",
            "mirror": table,
            "max_returns": 15,
            "rate": frame_rate(table),
        }
        return cls._described(description, {"rate": rate, **settings})

    # Settings ---------------------------------------------------------------------------------------------

    def replace(self, **settings: Any) -> Self:
        """Returns the lidar with new settings; None restores the device's own setting.

        The class documentation lists the settings.
        """
        return self._copy(settings=settings)

    def _copy(self, *, settings: Mapping[str, Any] | None = None, track: Track | None = None) -> Self:
        lidar = type(self).__new__(type(self))
        lidar._description, lidar._up = self._description, self._up
        lidar._settings = dict(self._settings)
        lidar._track = self._track if track is None else track
        if settings:
            lidar._set(settings)
        return lidar

    def _set(self, settings: Mapping[str, Any]) -> None:
        given = settings.get("force_rate", self._settings.get("force_rate", False))
        force = flag("force_rate", given, error=LidarError)
        for name, value in settings.items():
            if name != "force_rate" and name not in SETTING_CHECKS:
                raise LidarError(
                    nearest("lidar setting", name, [*SETTING_CHECKS, "force_rate"]), code="unknown_name"
                )
            self._settings.pop(name, None)
            if value is not None and name != "force_rate":
                self._settings[name] = SETTING_CHECKS[name](name, value)
        if force:
            self._settings["force_rate"] = True
        self._check(settings, force)

    def _check(self, given: Mapping[str, Any], force: bool) -> None:
        if self._description["family"] == "ouster":
            self._check_mode(given, force)
        rates = self._description.get("rates")
        if rates and not force and not rates[0] <= self.rate <= rates[1]:
            raise LidarError(
                f"{self.name}: rate is {self.rate:g}; supported: {rates[0]:g} to {rates[1]:g} Hz; "
                "to scan at any rate, pass force_rate=True (--force-rate)",
                code="unsupported_rate",
            )
        offered = self._description.get("returns")
        if offered and self.returns not in offered and "returns" in self._settings and self.returns != "all":
            raise LidarError(
                f"{self.name}: returns is {self.returns!r}; supported: {', '.join(offered)}, all",
                code="unknown_name",
            )
        if self.beam_samples > 1 and max(self.beam_divergence + self.beam_width) == 0.0:
            raise LidarError(
                f"{self.name}: beam_samples={self.beam_samples} requires the beam's size, which is not known for this "
                "device; pass beam_divergence=(horizontal, vertical) in radians",
                code="missing_value",
            )
        if self._value("waveform") and float(self._value("pulse_length", 4e-9)) == 0.0:
            raise LidarError("waveform requires a pulse_length above 0, got 0", code="conflicting_values")
        if self.min_range > self.max_range:
            raise LidarError(
                f"min_range {self.min_range:g} exceeds max_range {self.max_range:g}",
                code="conflicting_values",
            )

    def _check_mode(self, given: Mapping[str, Any], force: bool) -> None:
        """Chooses an Ouster's mode for a rate, or its rate for a mode.

        Raises `LidarError` for an unknown mode. Unless `force` is True, also raises `LidarError` if the mode
        and the rate contradict each other, and for an unsupported rate.
        """
        modes = {mode: float(mode.split("x")[1]) for mode in self._description["modes"]}
        default = self._description.get("mode", "1024x10")
        mode, rate = self._settings.get("mode", default), self._settings.get("rate")
        if mode not in modes:
            raise LidarError(
                f"{self.name}: mode is {mode!r}; supported: {', '.join(modes)}", code="unknown_name"
            )
        if rate is None or (given.get("mode") is not None and given.get("rate") is None and not force):
            rate = modes[mode]
        elif rate != modes[mode] and not force:
            if given.get("mode") is not None:
                raise LidarError(
                    f"{self.name}: mode {mode!r} requires {modes[mode]:g} Hz, but rate is {rate:g}; "
                    "to scan at any rate, pass force_rate=True (--force-rate)",
                    code="conflicting_values",
                )
            fitting = [name for name, hertz in modes.items() if hertz == rate]
            if not fitting:
                raise LidarError(
                    f"{self.name}: rate is {rate:g}; supported: 10 and 20 Hz; "
                    "to scan at any rate, pass force_rate=True (--force-rate)",
                    code="unsupported_rate",
                )
            mode = fitting[-1]
        self._settings["mode"], self._settings["rate"] = mode, rate

    def _value(self, name: str, default: Any = None) -> Any:
        return self._settings.get(name, self._description.get(name, default))

    @property
    def name(self) -> str:
        """The device's name."""
        return str(self._description["name"])

    @property
    def title(self) -> str:
        """The device's manufacturer and model."""
        return str(self._description.get("title", self.name))

    @property
    def sources(self) -> list[str]:
        """The documents and programs that are the sources of the device's numbers."""
        return list(self._description.get("sources", []))

    @property
    def family(self) -> str:
        """The kind of pattern, such as "velodyne".

        The kinds are "velodyne", "ouster", "hesai", "risley", "line", "golden", "mirror" and "table".
        """
        return str(self._description["family"])

    @property
    def is_generic(self) -> bool:
        """True if the angles are the model's nominal angles.

        Individual units differ noticeably from the nominal angles.
        """
        return bool(self._description.get("generic", False))

    @property
    def rate(self) -> float:
        """Frames per second."""
        return float(self._value("rate", 10.0))

    @property
    def returns(self) -> Returns:
        """The echoes of a pulse that are reported."""
        chosen: Returns = self._settings.get("returns") or self._value("default_returns", "strongest")
        return chosen

    @property
    def max_returns(self) -> int:
        """The largest number of echoes of a pulse, for returns="all"."""
        return int(self._value("max_returns", 15))

    @property
    def beam_samples(self) -> int:
        """The number of rays per pulse."""
        return int(self._value("beam_samples", 1))

    @property
    def beam_width(self) -> tuple[float, float]:
        """Horizontal and vertical width of the beam at its origin, at 1/e², in metres."""
        width: tuple[float, float] = tuple(self._value("beam_width", (0.0, 0.0)))
        return width

    @property
    def beam_divergence(self) -> tuple[float, float]:
        """Horizontal and vertical full divergence at 1/e², in radians."""
        own = self._description.get("beam_divergence")
        if own is None and "beam_divergence_fwhm" in self._description:
            own = [math.radians(angle) * FWHM_TO_FULL for angle in self._description["beam_divergence_fwhm"]]
        divergence: tuple[float, float] = tuple(self._settings.get("beam_divergence", own or (0.0, 0.0)))
        return divergence

    @property
    def pulse_extent(self) -> float:
        """The pulse's full width at half maximum, in metres of distance.

        This is half the distance that light travels in `pulse_length`.
        """
        return float(self._value("pulse_length", 4e-9)) * LIGHT_SPEED / 2.0

    @property
    def min_range(self) -> float:
        """The smallest reported distance, in metres."""
        return float(self._value("min_range", 0.0))

    @property
    def max_range(self) -> float:
        """The largest reported distance, in metres."""
        return float(self._value("max_range", math.inf))

    @property
    def settings(self) -> dict[str, Any]:
        """All effective settings by name; None for a value that is not specified."""
        found = {name: self._value(name) for name in SETTING_CHECKS}
        found.update(
            rate=self.rate,
            returns=self.returns,
            beam_samples=self.beam_samples,
            beam_width=self.beam_width,
            beam_divergence=self.beam_divergence,
            min_range=self.min_range,
            max_range=self.max_range,
            max_bounces=int(self._value("max_bounces", 2)),
            noise=bool(self._value("noise", True)),
            seed=int(self._value("seed", 0)),
            range_noise=float(self._value("range_noise", 0.0)),
            azimuth_noise=float(self._value("azimuth_noise", 0.0)),
            step=float(self._value("step", 0.0)),
            pulse_length=float(self._value("pulse_length", 4e-9)),
            rise_time=float(self._value("rise_time", 1e-9)),
            wavelength=float(self._value("wavelength", 905.0)),
            signal_gain=float(self._value("signal_gain", 5e5)),
            near_ir_gain=float(self._value("near_ir_gain", 1.0)),
            near_ir_samples=int(self._value("near_ir_samples", 0)),
            waveform=bool(self._value("waveform", False)),
        )
        return found

    @property
    def firing_cycle(self) -> float:
        """Time in seconds between a Velodyne's firing cycles; raises `LidarError` for other devices."""
        if self.family != "velodyne":
            raise LidarError(
                f"{self.name}: only Velodyne devices have firing cycles; packets require a Velodyne or Ouster device",
                code="wrong_device",
            )
        return float(self._description["velodyne"]["cycle"])

    @property
    def metadata(self) -> dict[str, Any]:
        """The metadata of an Ouster in its mode, of JSON types.

        The metadata have the form of the files of `load_lidar` and ouster-sdk.

        Raises `LidarError` for other devices.
        """
        if self.family != "ouster":
            raise LidarError(f"{self.name}: only Ouster's devices have metadata", code="wrong_device")
        mode = str(self._settings["mode"])
        shifts = self.pixel_shifts(int(mode.split("x")[0]))
        return ouster_metadata(ouster_unit(self._description["ouster"]), self.name, mode, self.rate, shifts)

    @property
    def assumed(self) -> list[str]:
        """The names of the settings for which general defaults apply.

        Neither the device's documents nor the caller specify these settings.
        """
        known = {
            *self._settings,
            *self._description,
            "max_bounces",
            "noise",
            "seed",
            "visibility",
            "azimuth_noise",
            "overlap",
            "waveform",
            "near_ir_samples",
        }
        found = [
            name
            for name in SETTING_CHECKS
            if name not in known and name not in ("mode", "returns", "beam_samples")
        ]
        if "beam_divergence_fwhm" in self._description and "beam_divergence" in found:
            found.remove("beam_divergence")
        return found

    def pattern(self, frame: int = 0) -> Pattern:
        """Returns the pulses of frame number `frame`: times, directions and origins in sensor axes."""
        return make_pattern({**self._description, **self._mode()}, self.rate, frame)

    def pixel_shifts(self, columns: int) -> list[int]:
        """Returns the shift of each row of an Ouster's image, in columns.

        The shifts come from the metadata, or are computed from the azimuths if the metadata contain none.
        """
        table = self._description["ouster"]
        listed = table.get("pixel_shift_by_row")
        if listed:
            scale = columns / table.get("pixel_shift_columns", columns)
            return [round(shift * scale) for shift in listed]
        return [round(angle / 360.0 * columns) for angle in table["beam_azimuth_angles"]]

    def _mode(self) -> dict[str, Any]:
        return {"mode": self._settings["mode"]} if "mode" in self._settings else {}

    # Pose -------------------------------------------------------------------------------------------------

    def placed(
        self, location: npt.ArrayLike, roll: float = 0.0, pitch: float = 0.0, yaw: float = 0.0
    ) -> Self:
        """Returns the lidar at `location` [3], rotated by `roll`, `pitch` and `yaw` in degrees.

        The angles are as in `Camera.from_pose`. With all angles 0, the lidar looks along +x of a z-up world
        (along -z if `up` is "y"). Positive yaw turns left.
        """
        angles = [
            real(name, v, error=LidarError) for name, v in (("roll", roll), ("pitch", pitch), ("yaw", yaw))
        ]
        place = floats("location", location, (3,), error=LidarError)
        return self._at(rotation_of(angles[0], angles[1], angles[2], self._up), place)

    def at_pose(self, R: npt.ArrayLike, C: npt.ArrayLike) -> Self:
        """Returns the lidar at another pose.

        `R` is sensor_from_world [3, 3], and `C` is the lidar's position [3] in the world.
        """
        turn = floats("R", R, (3, 3), error=LidarError)
        if not np.abs(product(turn, turn.T) - np.eye(3)).max() < 1e-6 or not np.linalg.det(turn) > 0.0:
            raise LidarError(
                f"R must be a rotation matrix sensor_from_world, not {turn.tolist()}", code="not_a_rotation"
            )
        return self._at(turn.T, floats("C", C, (3,), error=LidarError))

    def _at(self, world_from_sensor: Floats, place: Floats) -> Self:
        if not np.isfinite(place).all():
            raise LidarError(f"the position must be finite, not {place.tolist()}", code="out_of_range")
        return self._copy(track=Track(np.zeros(1), world_from_sensor[None], place[None]))

    def moving(self, to: Self | Sequence[tuple[float, Self]]) -> Self:
        """Returns the lidar moving during its frame, from its own pose to the pose of `to`.

        The lidar reaches the pose of `to` when the frame ends. `to` may also be a list of (seconds, lidar) in
        ascending order; seconds count from the frame's start. Positions are interpolated linearly, rotations
        along the shortest arc.

        Raises `LidarError` for other arguments, an empty list, and times that do not ascend.
        """
        steps = [(0.0, self), (1.0 / self.rate, to)] if isinstance(to, Lidar) else to
        if not _are_steps(steps):
            raise LidarError(
                f"moving requires a lidar or a list of (seconds, lidar) with at least one entry, got {to!r}",
                code="wrong_type",
            )
        times = np.array([real("seconds", time, error=LidarError) for time, _ in steps])
        if (np.diff(times) <= 0.0).any():
            raise LidarError(f"moving: times must ascend, got {times.tolist()}", code="unordered_times")
        poses = [lidar._track for _, lidar in steps]
        turns = np.stack([pose.rotations[0] for pose in poses])
        return self._copy(track=Track(times, turns, np.stack([pose.positions[0] for pose in poses])))

    def on_track(self, track: Track) -> Self:
        """Returns the lidar moving along the poses world_from_sensor of a track.

        The track's times count from the frame's start.
        """
        return self._copy(track=track)

    def moving_by(self, first: Floats, second: Floats, seconds: float) -> Self:
        """Returns the lidar moving from its pose in the same way as a given body.

        The body moves from the pose `first` [4, 4] to the pose `second` [4, 4] in `seconds`. The lidar has the same
        motion in its own axes.
        """
        back = first[:3, :3].T
        turn, shift = product(back, second[:3, :3]), product(back, second[:3, 3] - first[:3, 3])
        own = self.pose
        end = self._at(product(own[:3, :3], turn), own[:3, 3] + product(own[:3, :3], shift))
        return self.moving([(0.0, self), (seconds, end)])

    @property
    def track(self) -> Track:
        """The poses world_from_sensor during the frame."""
        return self._track

    @property
    def is_moving(self) -> bool:
        """True if the pose changes during the frame."""
        return len(self._track.times) > 1

    @property
    def pose(self) -> Floats:
        """The pose world_from_sensor, float64 [4, 4].

        For a moving lidar, this is the pose at the middle of the frame.
        """
        turns, places = self._track.at(np.array([0.5 / self.rate]))
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = turns[0], places[0]
        return matrix

    @property
    def times(self) -> Floats:
        """The times of the pulses of frame 0, float64 [n], in seconds from the frame's start."""
        return self.pattern().times

    @property
    def up(self) -> str:
        """The world's up axis, for `placed`."""
        return self._up

    def sample(
        self, world: World, *, frame: int = 0, threads: int | None = None
    ) -> dict[str, npt.NDArray[Any]]:
        """Returns the fields of `raycam.scan` by name; the arguments are as in `raycam.scan`."""
        from .scanning import scan

        return {
            name: np.asarray(array) for name, array in scan(world, self, frame=frame, threads=threads).items()
        }

    # Description ------------------------------------------------------------------------------------------

    def to_dict(self) -> dict[str, Any]:
        """Returns a description of JSON types, from which `from_dict` restores the lidar exactly."""
        return {
            "device": json.loads(json.dumps(self._description)),
            "settings": json.loads(json.dumps(self._settings)),
            "up": self._up,
            "track": {
                "times": self._track.times.tolist(),
                "rotations": self._track.rotations.tolist(),
                "positions": self._track.positions.tolist(),
            },
        }

    @classmethod
    def from_dict(cls, description: Mapping[str, Any]) -> Self:
        """Returns the lidar that `to_dict` described."""
        lidar = cls._described(dict(description["device"]), description["settings"], description["up"])
        track = description["track"]
        lidar._track = Track(*(np.array(track[name]) for name in ("times", "rotations", "positions")))
        return lidar

    def __eq__(self, other: object) -> bool:
        """True if both lidars have the same device, settings and poses."""
        return self.to_dict() == other.to_dict() if isinstance(other, Lidar) else NotImplemented

    def __hash__(self) -> int:
        """Equal lidars have equal hashes."""
        return hash(json.dumps(self.to_dict(), sort_keys=True))

    def __reduce__(self) -> tuple[Callable[..., Any], tuple[Any, ...]]:
        """Pickles the description."""
        return type(self).from_dict, (self.to_dict(),)

    def __repr__(self) -> str:
        """Shows device, rate and pulses."""
        return f"<raycam.Lidar {self.title}: {self.rate:g} Hz, {len(self.pattern())} pulses per frame>"


def _are_steps(steps: object) -> TypeGuard[Sequence[tuple[float, Lidar]]]:
    """True for a list of pairs (seconds, lidar) with at least one entry; the seconds are not checked."""
    return (
        isinstance(steps, Sequence)
        and len(steps) > 0
        and all(isinstance(s, Sequence) and len(s) == 2 and isinstance(s[1], Lidar) for s in steps)
    )
