"""The sensors of a world that are not cameras, at a time."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

from .. import _core
from ..camera import Camera
from ..rig import Rig
from ..sensors import Sensor
from ..sensors.sensor import read_mounted_sensors

__all__ = ["sensors_of"]


def sensors_of(
    core: _core.World, rigs: Iterable[Rig], rig_at: Callable[[Rig, float], Rig] | None, time: float | None
) -> dict[str, Sensor]:
    """Returns the sensors of a world in world coordinates, by name.

    The sensors of its `rigs` are called rig/name. At a `time`, rigs are where `rig_at` places them (None: they are at
    rest), and lidars move during their frame. Without a time, the world is static.
    """
    found = read_mounted_sensors(_core.world_sensors(core), core.up, time)
    for rig in rigs:
        for name, sensor in _sensors_at(rig, rig_at, time).items():
            found[f"{rig.name}/{name}"] = sensor
    return found


def _sensors_at(
    rig: Rig, rig_at: Callable[[Rig, float], Rig] | None, time: float | None
) -> dict[str, Sensor]:
    """The sensors of a rig at a time; a sensor with `moving_by` moves during its frame."""
    if time is None or rig_at is None:
        return _others(rig)
    found = _others(rig_at(rig, time))
    for name, sensor in found.items():
        moving: Any = sensor
        if hasattr(moving, "moving_by") and hasattr(moving, "rate"):
            duration = 1.0 / moving.rate
            later = _others(rig_at(rig, time + duration))[name]
            found[name] = moving.moving_by(sensor.pose, later.pose, duration)
    return found


def _others(rig: Rig) -> dict[str, Sensor]:
    """The sensors of a rig that are not cameras."""
    return {name: sensor for name, sensor in rig.sensors.items() if not isinstance(sensor, Camera)}
