"""Files of a data set with the samples of sensors that are not cameras."""

from __future__ import annotations

from ..io.npz import npz_bytes
from ..lidar import Lidar
from ..sensors import sample_sensor
from .plan import Plan

__all__ = ["sensor_files"]


def sensor_files(plan: Plan, unit: int, units: int, *, with_lidars: bool = True) -> dict[str, bytes]:
    """Returns the NPZ files of the sensors that belong to a unit of work, by file name.

    Lidars are included only if `with_lidars` is True. Views are assigned to units evenly, because some
    formats have units of several views.
    """
    files = {}
    for number, view in enumerate(plan.shots):
        if view.sensors and number * units // len(plan.shots) == unit:
            world = plan.world_of(view)
            for name, sensor in view.sensors.items():
                if isinstance(sensor, Lidar) and not with_lidars:
                    continue
                arrays = sample_sensor(sensor, world, frame=number, threads=plan.threads)
                files[f"sensors/{name}/{number:06d}.npz"] = npz_bytes(arrays)
    return files
