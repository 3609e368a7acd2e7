"""Ouster's spinning devices: all lasers of a column fire together.

Source: Ouster Firmware User Manual, "Lidar Range to XYZ"; `XYZLut` of ouster-sdk 1.0.1.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..arguments import lengths
from ..elementary import cos, sin
from .pattern import Pattern, check_count, grid_pattern

__all__ = ["OusterUnit", "ouster_metadata", "ouster_pattern"]


@dataclass(frozen=True)
class OusterUnit:
    """The calibration of one unit, in degrees and millimetres.

    The attributes have the names of Ouster's metadata.
    """

    beam_altitude_angles: tuple[float, ...]
    """The elevation of each row in degrees."""
    beam_azimuth_angles: tuple[float, ...]
    """The azimuth of each row relative to the encoder."""
    beam_to_lidar_transform: tuple[float, ...]
    """The row-major matrix [16], whose x translation is the distance of the beams' origin from the axis."""
    lidar_to_sensor_transform: tuple[float, ...]
    """The row-major matrix [16]."""
    pixel_shift_by_row: tuple[int, ...]
    """The columns by which rows are shifted to form an image."""


def ouster_pattern(unit: OusterUnit, columns: int, rate: float) -> Pattern:
    """Returns the pulses of one turn in sensor axes.

    The device adds the distance between the lidar's origin and the beam's origin to distances from the beam's origin.
    """
    rows = len(unit.beam_altitude_angles)
    check_count(rows * columns)
    encoder = [2.0 * math.pi * (1.0 - column / columns) for column in range(columns)]
    azimuth = [-math.radians(angle) for angle in unit.beam_azimuth_angles]
    altitude = [math.radians(angle) for angle in unit.beam_altitude_angles]
    cos_e, sin_e = cos(encoder)[:, None], sin(encoder)[:, None]
    cos_b, sin_b = cos(azimuth), sin(azimuth)
    cos_p, sin_p = cos(altitude), sin(altitude)
    cos_eb, sin_eb = cos_e * cos_b - sin_e * sin_b, sin_e * cos_b + cos_e * sin_b
    flat = np.broadcast_to(sin_p, cos_eb.shape)
    directions = np.stack([cos_eb * cos_p, sin_eb * cos_p, flat], axis=-1)
    beam = np.array(unit.beam_to_lidar_transform).reshape(4, 4)
    sensor = np.array(unit.lidar_to_sensor_transform).reshape(4, 4)
    offset = float(lengths(beam[:3, 3])) / 1000.0
    across, up = beam[0, 3] / 1000.0, beam[2, 3] / 1000.0
    origins = np.stack([across * cos_e, across * sin_e, np.full_like(cos_e, up)], axis=-1)
    turn, shift = sensor[:3, :3], sensor[:3, 3] / 1000.0
    times = np.broadcast_to(np.arange(columns)[:, None] / (columns * rate), cos_eb.shape)
    return grid_pattern(
        times,
        _turned(turn, directions),
        np.broadcast_to(_turned(turn, origins) + shift, directions.shape),
        np.arange(rows),
        offset,
    )


def ouster_metadata(
    unit: OusterUnit, name: str, mode: str, rate: float, shifts: Sequence[int]
) -> dict[str, Any]:
    """Returns the metadata of a unit in a mode.

    The metadata have the nested form of firmware 2.2 and later, without an IMU.
    """
    columns, rows = int(mode.split("x")[0]), len(unit.beam_altitude_angles)
    beam = list(unit.beam_to_lidar_transform)
    return {
        "beam_intrinsics": {
            "beam_altitude_angles": list(unit.beam_altitude_angles),
            "beam_azimuth_angles": list(unit.beam_azimuth_angles),
            "beam_to_lidar_transform": beam,
            "lidar_origin_to_beam_origin_mm": float(lengths(beam[3:12:4])),
        },
        "lidar_intrinsics": {"lidar_to_sensor_transform": list(unit.lidar_to_sensor_transform)},
        "imu_intrinsics": {"imu_to_sensor_transform": np.eye(4).reshape(-1).tolist()},
        "lidar_data_format": {
            "column_window": [0, columns - 1],
            "columns_per_frame": columns,
            "columns_per_packet": 16,
            "fps": rate,
            "pixel_shift_by_row": list(shifts),
            "pixels_per_column": rows,
            "udp_profile_imu": "LEGACY",
            "udp_profile_lidar": "LEGACY",
        },
        "config_params": {"lidar_mode": mode, "udp_port_lidar": 7502, "udp_port_imu": 7503},
        "sensor_info": {
            "build_date": "",
            "build_rev": "",
            "image_rev": "",
            "initialization_id": 0,
            "prod_line": name.upper().replace("OS", "OS-", 1),
            "prod_pn": "",
            "prod_sn": "0",
            "status": "RUNNING",
        },
        "calibration_status": {},
        "user_data": "",
    }


def _turned(turn: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """Returns the rotated vectors [..., 3], without BLAS."""
    x, y, z = vectors[..., 0, None], vectors[..., 1, None], vectors[..., 2, None]
    turned: np.ndarray = x * turn[:, 0] + y * turn[:, 1] + z * turn[:, 2]
    return turned
