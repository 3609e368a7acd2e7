"""The protocol of sensors, and their description for workers in other processes."""

from __future__ import annotations

import importlib
import json
import sys
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Protocol, Self, runtime_checkable

import numpy as np
import numpy.typing as npt

from ..arguments import Floats
from ..errors import Notice, SettingsError
from ..notices import warn

if TYPE_CHECKING:
    from ..world import World

__all__ = ["Sensor", "describe_sensor", "read_mounted_sensors", "read_sensor", "sample_sensor", "sensor_row"]

LIDAR = "lidar"
"""The kind of a sensor that a `[[lidar]]` table of a world file describes."""

Pose = tuple[Sequence[Sequence[float]], Sequence[float]]
SensorData = tuple[str, str, str, Pose | None, dict[str, tuple[str, bytes]]]
"""Name, kind, settings as JSON, pose (R, C) on the parent, and files (name, contents) by key of a world's sensor."""

Arrays = dict[str, npt.NDArray[Any]]

RESERVED_NAMES = ("world_from_sensor", "times")
"""Names of arrays that `sample_sensor` adds."""


@runtime_checkable
class Sensor(Protocol):
    """A device that measures a world and returns named arrays. `Camera` is a sensor.

    Rigs (`Rig.sensors`), worlds (`World.sensors`), videos (`VideoPlan.sample`) and data sets
    (`raycam.dataset.write`) accept any object with these members. A sensor is immutable; `at_pose` returns a copy.
    """

    @property
    def pose(self) -> Floats:
        """The pose world_from_sensor, float64 [4, 4].

        For a moving sensor, it is the pose at the middle of the measurement.
        """

    @property
    def times(self) -> Floats:
        """The times of the samples, float64 [n], in seconds relative to the world's time.

        If all samples are taken at the same time, the result is [0.0].
        """

    def at_pose(self, R: npt.ArrayLike, C: npt.ArrayLike) -> Self:
        """Returns the same sensor at another pose.

        `R` is sensor_from_world [3, 3], `C` the sensor's position [3] in the world.
        """

    def sample(self, world: World, *, frame: int = 0, threads: int | None = None) -> Arrays:
        """Measures `world`; returns the arrays by name.

        `frame` selects the random numbers of noise: the same call returns the same bytes for any number of `threads`
        (default: all threads that the process may use).
        """

    def to_dict(self) -> dict[str, Any]:
        """Returns a description of JSON types.

        The class method `from_dict` restores the sensor exactly from this description.
        """


def describe_sensor(sensor: Sensor) -> dict[str, Any]:
    """Returns the sensor's type and description as JSON types, for `read_sensor`.

    Raises `SettingsError` for a class that another process cannot import or that has no `from_dict`.
    """
    kind = type(sensor)
    name = f"{kind.__module__}:{kind.__qualname__}"
    if kind.__module__ == "__main__" or "<locals>" in kind.__qualname__ or not hasattr(kind, "from_dict"):
        raise SettingsError(
            f"sensor class {name} cannot be restored by a worker; define it in a module that can be imported, with a "
            "class method from_dict",
            code="unimportable_class",
        )
    return {"type": name, "description": sensor.to_dict()}


def read_sensor(table: Mapping[str, Any]) -> Sensor:
    """Returns the sensor that `describe_sensor` described.

    Raises `SettingsError` if its class cannot be imported.
    """
    module, _, name = str(table["type"]).partition(":")
    try:
        kind: Any = importlib.import_module(module)
        for part in name.split("."):
            kind = getattr(kind, part)
        sensor: object = kind.from_dict(table["description"])
    except (ImportError, AttributeError) as fault:
        raise SettingsError(
            f"sensor class {table['type']!r} cannot be imported here: {fault}", code="unimportable_class"
        ) from None
    return require_sensor(name, sensor)


def sensor_row(name: str, sensor: Sensor) -> tuple[str, str, str]:
    """Returns name, class and description of a sensor, as worlds store it.

    Raises the errors of `describe_sensor`.
    """
    table = describe_sensor(sensor)
    return name, table["type"], json.dumps(table["description"])


def read_mounted_sensors(
    rows: Sequence[SensorData], up: str, time: float | None = None, *, imports: bool = False
) -> dict[str, Sensor]:
    """Returns the sensors of a world or of a rig by name, at a `time` in seconds.

    Sensors are in the axes of their parent. A class that has not been imported is imported only with `imports`, because
    world files may come from anybody; otherwise the sensor is omitted with a notice. Raises `LidarError` for invalid
    settings of a lidar.
    """
    from ..lidar.world_table import read_lidar_table

    found: dict[str, Sensor] = {}
    for name, kind, settings, pose, files in rows:
        if kind == LIDAR:
            assert pose is not None
            found[name] = read_lidar_table(name, json.loads(settings), pose, files, up, time)
            continue
        module = kind.partition(":")[0]
        if not imports and module not in sys.modules:
            message = f"sensor {name!r} is skipped: its class {kind} is not imported; import {module} first"
            warn(Notice(message, "ignored_element"))
            continue
        sensor = read_sensor({"type": kind, "description": json.loads(settings)})
        found[name] = sensor if pose is None else sensor.at_pose(*pose)
    return found


def require_sensor(name: str, sensor: object) -> Sensor:
    """Returns `sensor` if it implements the protocol.

    Raises `SettingsError`, with the missing members, for other objects.
    """
    if isinstance(sensor, Sensor):
        return sensor
    members = ("pose", "times", "at_pose", "sample", "to_dict")
    missing = [member for member in members if not hasattr(type(sensor), member)]
    raise SettingsError(
        f"{name} is a {type(sensor).__name__}, which is not a sensor; missing members: {', '.join(missing)}",
        code="wrong_type",
    )


def sample_sensor(sensor: Sensor, world: World, *, frame: int = 0, threads: int | None = None) -> Arrays:
    """Returns the arrays of `Sensor.sample`, with the sensor's pose and times in addition.

    "world_from_sensor" is `Sensor.pose`, "times" is `Sensor.times`. Raises `SettingsError` if the sensor does not
    return a dict from names to arrays.
    """
    arrays = sensor.sample(world, frame=frame, threads=threads)
    if not isinstance(arrays, Mapping) or not all(
        isinstance(name, str) and isinstance(array, np.ndarray) for name, array in arrays.items()
    ):
        raise SettingsError(
            f"{type(sensor).__name__}.sample must return a dict from names to NumPy arrays", code="wrong_type"
        )
    for name in RESERVED_NAMES:
        if name in arrays:
            raise SettingsError(
                f"{type(sensor).__name__}.sample returns an array with the reserved name {name!r}; use another name",
                code="duplicate_name",
            )
    return {**arrays, "world_from_sensor": np.array(sensor.pose), "times": np.array(sensor.times)}
