"""Writes lidar scans as ROS 2 messages.

The messages are PointCloud2 with the fields of the manufacturers' drivers.

Sources: ROS 2 `sensor_msgs`; velodyne_pointcloud (`PointXYZIRT`), ouster-ros (`ouster_ros::Point`),
livox_ros_driver2 (`LivoxPointXyzrtlt`).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from ...arguments import product
from ...lidar import Scan
from ...lidar.intensity import near_ir_counts
from ..lidars import lidars_of, pose_of, scan_lidar
from ..plan import Plan
from .cdr import BODY, WORLD, Cdr, body_of, transform

__all__ = ["lidar_messages"]

DATATYPES = {"i1": 1, "u1": 2, "i2": 3, "u2": 4, "i4": 5, "u4": 6, "f4": 7, "f8": 8}
"""The constants of `sensor_msgs/PointField`, by NumPy's names of types."""

Field = tuple[str, str, Callable[[Scan, int], npt.NDArray[Any]]]
"""Name, type, and the values of a scan with a time stamp in nanoseconds."""

VELODYNE: list[Field] = [
    ("intensity", "f4", lambda scan, stamp: scan["intensity"]),
    ("ring", "u2", lambda scan, stamp: scan["ring"]),
    ("time", "f4", lambda scan, stamp: scan["time"]),
]
OUSTER: list[Field] = [
    ("intensity", "f4", lambda scan, stamp: scan["signal"]),
    ("t", "u4", lambda scan, stamp: np.rint(scan["time"] * 1e9)),
    ("reflectivity", "u2", lambda scan, stamp: scan["intensity"]),
    ("ring", "u2", lambda scan, stamp: scan["ring"]),
    ("ambient", "u2", lambda scan, stamp: _ambient(scan)),
    ("range", "u4", lambda scan, stamp: np.rint(scan["distance"] * 1000.0)),
]
"""In the driver, `intensity` is the signal, `reflectivity` the calibrated 8-bit number."""
LIVOX: list[Field] = [
    ("intensity", "f4", lambda scan, stamp: scan["intensity"]),
    ("tag", "u1", lambda scan, stamp: np.zeros(scan.count)),
    ("line", "u1", lambda scan, stamp: scan["ring"]),
    ("timestamp", "f8", lambda scan, stamp: stamp + scan["time"] * 1e9),
]
FIELDS = {"ouster": OUSTER, "risley": LIVOX, "golden": LIVOX}
"""The fields of a family, besides x, y and z (default: those of Velodyne's driver)."""
TRUTH: list[Field] = [
    ("instance", "i4", lambda scan, stamp: scan["instance"]),
    ("category", "i4", lambda scan, stamp: scan["category"]),
]
"""Fields that follow the driver's fields."""


def lidar_messages(plan: Plan, number: int, stamp: int) -> list[tuple[str, str, bytes]]:
    """Returns topics, types and messages of the lidars that are sampled with a view.

    The points are on /NAME/points in the frame NAME, as sent by the driver: each in the sensor axes at its own time.
    The frame NAME is fixed on base_link, or moves in world if the lidar does not belong to a rig.
    """
    found = []
    for name, lidar in lidars_of(plan.shots[number]).items():
        pose = next((frame for frame in plan.rigs if number in frame), None)
        cloud = point_cloud(scan_lidar(plan, number, lidar), stamp, name)
        found.append((f"/{name}/points", "sensor_msgs/msg/PointCloud2", cloud))
        if pose is None:
            own = pose_of(lidar)
            moved = transform(stamp, WORLD, name, own[:3, :3], own[:3, 3])
            found.append(("/tf", "tf2_msgs/msg/TFMessage", moved))
        elif pose is plan.rigs[0]:
            R, C = body_of(plan, pose)
            world_from_sensor = pose_of(lidar)
            turn, place = product(R, world_from_sensor[:3, :3]), product(R, world_from_sensor[:3, 3] - C)
            fixed = transform(stamp, BODY, name, turn, place)
            found.append(("/tf_static", "tf2_msgs/msg/TFMessage", fixed))
    return found


def _ambient(scan: Scan) -> npt.NDArray[np.uint16]:
    """Returns the counts of near infrared light; 0 if the lidar's setting near_ir_samples is 0."""
    if "near_ir" not in scan:
        return np.zeros(scan.count, np.uint16)
    return near_ir_counts(scan["near_ir"], scan.lidar.settings["near_ir_gain"])


def point_cloud(scan: Scan, stamp: int, frame: str) -> bytes:
    """Returns a scan as the bytes of a `sensor_msgs/PointCloud2`.

    The message has one row of points without padding, little endian.
    """
    fields = [*FIELDS.get(scan.lidar.family, VELODYNE), *TRUTH]
    kinds = [("x", "<f4"), ("y", "<f4"), ("z", "<f4"), *((name, f"<{kind}") for name, kind, _ in fields)]
    records = np.empty(scan.count, kinds)
    for index, axis in enumerate("xyz"):
        records[axis] = scan["position"][:, index]
    for name, _, values in fields:
        records[name] = values(scan, stamp)
    message = Cdr().add_header(stamp, frame).add_numbers("I", 1, scan.count).add_numbers("I", len(kinds))
    offset = 0
    for name, kind in kinds:
        message.add_text(name).add_numbers("I", offset).add_numbers("B", DATATYPES[kind[1:]])
        message.add_numbers("I", 1)
        offset += np.dtype(kind).itemsize
    message.add_numbers("B", 0).add_numbers("I", offset, offset * scan.count).add_bytes(records.tobytes())
    return message.add_numbers("B", 1).to_bytes()
