"""Lidars of data sets: their motion between the poses of a rig, and their scans."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..arguments import Floats
from ..camera import Camera
from ..errors import SettingsError
from ..lidar import Lidar, Scan, scan
from ..rig import Rig
from ..sensors import Sensor
from ..world import World
from .plan import Plan, View

__all__ = ["check_rigs", "lidars_of", "other_sensors", "pose_of", "scan_lidar", "world_sensors"]


def check_rigs(plan: Plan, format: str) -> None:
    """Raises `SettingsError` unless all views belong to rigs, as `format` requires."""
    if plan.rigs and sum(len(frame) for frame in plan.rigs) == len(plan.shots):
        return
    own = [
        name
        for name, rig in plan.world.rigs.items()
        if any(isinstance(sensor, Lidar) for sensor in rig.sensors.values())
    ]
    remedy = 'cameras=raycam.Rig({"front": camera, "top": lidar})'
    if own:
        remedy = f'cameras=world.rigs["{own[0]}"], or --rig {own[0]} on the command line'
    raise SettingsError(
        f"{format} requires views that all belong to a rig with a lidar; pass {remedy}", code="missing_value"
    )


def other_sensors(rigs: Sequence[object], number: int, times: Sequence[float | None]) -> dict[str, Sensor]:
    """Returns the sensors of the rig at pose `number` that are not cameras, by name.

    `rigs` is one rig at all of its poses, at `times` in seconds. Lidars move from the pose to the next pose. After the
    last pose, the rig continues its previous motion.
    """
    rig = rigs[number]
    assert isinstance(rig, Rig)
    found = {name: one for name, one in rig.sensors.items() if not isinstance(one, Camera)}
    pair = (number, number + 1) if number + 1 < len(rigs) else (number - 1, number)
    first, second = rigs[pair[0]], rigs[pair[1]] if pair[0] >= 0 else None
    start, end = times[pair[0]], times[pair[1]]
    if not isinstance(first, Rig) or not isinstance(second, Rig) or first.name != second.name:
        return found
    if start is None or end is None or end <= start:
        return found
    for name, lidar in found.items():
        before, after = first.sensors.get(name), second.sensors.get(name)
        if not (isinstance(lidar, Lidar) and isinstance(before, Lidar) and isinstance(after, Lidar)):
            continue
        if not lidar.is_moving and not np.array_equal(before.pose, after.pose):
            found[name] = lidar.moving_by(before.pose, after.pose, end - start)
    return found


def world_sensors(world: World, times: Sequence[float | None], number: int) -> dict[str, Sensor]:
    """Returns the world's sensors by name, at the time of a view.

    Returns no sensors if an earlier view has the same time.
    """
    time = times[number]
    if not world.has_sensors or time in times[:number]:
        return {}
    return dict((world if time is None else world.at(time)).sensors)


def lidars_of(view: View) -> dict[str, Lidar]:
    """Returns the lidars that are sampled with a view, by name."""
    return {name: sensor for name, sensor in view.sensors.items() if isinstance(sensor, Lidar)}


def pose_of(lidar: Lidar) -> Floats:
    """Returns the pose world_from_sensor at the start of the lidar's frame, float64 [4, 4]."""
    turns, places = lidar.track.at(np.zeros(1))
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = turns[0], places[0]
    return matrix


def scan_lidar(plan: Plan, number: int, lidar: Lidar) -> Scan:
    """Returns the scan of a lidar at the time of a view; the view's number selects the noise."""
    return scan(plan.world_of(plan.shots[number]), lidar, frame=number, threads=plan.threads)
