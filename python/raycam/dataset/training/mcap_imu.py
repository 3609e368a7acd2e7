"""`sensor_msgs/Imu` of a rig's body in MCAP bags, from the poses of the rig."""

from __future__ import annotations

import base64
from collections.abc import Callable, Iterator

import numpy as np

from ...arguments import real
from ...errors import SettingsError
from ..imu import LEAST_POSES, BodyMotion, specific_force
from ..plan import Plan, Record
from .cdr import BODY, Cdr, body_of, quaternion

__all__ = ["IMU_DEFINITION", "check_imu", "imu_records"]

TOPIC, KIND = "/imu", "sensor_msgs/msg/Imu"
IMU_DEFINITION = {
    KIND: "std_msgs/Header header\ngeometry_msgs/Quaternion orientation\nfloat64[9] orientation_covariance\n"
    "geometry_msgs/Vector3 angular_velocity\nfloat64[9] angular_velocity_covariance\n"
    "geometry_msgs/Vector3 linear_acceleration\nfloat64[9] linear_acceleration_covariance\n"
}
"""The message definition without its nested types."""
MAX_RATE = 1e5
BLOCK = 4096
"""Number of messages computed at a time."""


def check_imu(plan: Plan) -> None:
    """Raises `SettingsError` for an invalid rate, and for poses that do not determine a motion."""
    rate = real("imu", plan.options["imu"], 0, MAX_RATE, what="a number of messages per second")
    if rate and len(plan.rigs) < LEAST_POSES:
        raise SettingsError(
            f"imu requires a rig with at least {LEAST_POSES} poses; got {len(plan.rigs)}",
            code="missing_value",
        )


def imu_records(plan: Plan, stamp_of: Callable[[Plan, int], int]) -> Iterator[Record]:
    """Yields records of one IMU message each, from the first to the last pose.

    The result is empty if the option `imu` is 0. `stamp_of` returns a view's time stamp in nanoseconds.
    Angular velocity and specific force (acceleration minus gravity) are in the axes of base_link, without
    noise. Covariances of 0 mean that the covariances are unknown.
    """
    rate = float(plan.options["imu"])
    if not rate:
        return
    stamps = np.array([stamp_of(plan, pose[0]) for pose in plan.rigs], np.int64)
    bodies = [body_of(plan, pose) for pose in plan.rigs]
    turns = np.array([quaternion(R.T) for R, _ in bodies])
    motion = BodyMotion.of((stamps - stamps[0]) / 1e9, turns, np.array([C for _, C in bodies]))
    count = int(motion.times[-1] * rate + 1e-6) + 1
    up = plan.world.up
    for first in range(0, count, BLOCK):
        moments = np.arange(first, min(count, first + BLOCK)) / rate
        orientations, _, accelerations, spins = motion.at(moments)
        forces = specific_force(orientations, accelerations, up)
        for moment, turn, spin, force in zip(moments, orientations, spins, forces, strict=True):
            stamp = int(stamps[0]) + round(float(moment) * 1e9)
            message = Cdr().add_header(stamp, BODY)
            for values in (turn, spin, force):
                message.add_numbers("d", *values.tolist(), *[0.0] * 9)
            data = base64.b64encode(message.to_bytes()).decode()
            yield {"stamp": stamp, "messages": [(TOPIC, KIND, data)]}
