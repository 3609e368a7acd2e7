"""The equations of Velodyne's ROS driver, `rawdata.cpp` of ros-drivers/velodyne."""

from __future__ import annotations

import math

from raycam.lidar.velodyne import Laser


def driver_point(laser: Laser, azimuth: float, raw: float) -> list[float]:
    """The point that the equations of `rawdata.cpp` give.

    The arguments are an azimuth in radians and a raw distance in metres.
    """
    d = raw + laser.dist_correction
    a = azimuth - laser.rot_correction
    cos_v, sin_v = math.cos(laser.vert_correction), math.sin(laser.vert_correction)
    up, side = laser.vert_offset_correction, laser.horiz_offset_correction
    flat = d * cos_v - up * sin_v
    x, y = flat * math.sin(a) - side * math.cos(a), flat * math.cos(a) + side * math.sin(a)
    more_x = more_y = 0.0
    if laser.dist_correction_x is not None and laser.dist_correction_y is not None:
        far, near_x, near_y = laser.dist_correction, laser.dist_correction_x, laser.dist_correction_y
        more_x = (far - near_x) * (abs(x) - 2.4) / (25.04 - 2.4) + near_x - far
        more_y = (far - near_y) * (abs(y) - 1.93) / (25.04 - 1.93) + near_y - far
    flat_x = (d + more_x) * cos_v - up * sin_v
    flat_y = (d + more_y) * cos_v - up * sin_v
    right = flat_x * math.sin(a) - side * math.cos(a)
    ahead = flat_y * math.cos(a) + side * math.sin(a)
    return [ahead, -right, (d + more_y) * sin_v + up * cos_v]
