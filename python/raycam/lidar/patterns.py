"""Pulse patterns from device descriptions, with one function for each device family."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from ..elementary import cos, sin, tan
from ..errors import LidarError
from .hesai import hesai_pattern
from .mirrors import mirror_pattern
from .ouster import OusterUnit, ouster_pattern
from .pattern import Pattern, check_count, free_pattern, grid_pattern
from .risley import Prism, risley_pattern
from .velodyne import Laser, velodyne_pattern

__all__ = ["FAMILIES", "make_pattern"]

GOLDEN_TURN = (math.sqrt(5.0) - 1.0) / 2.0


def make_pattern(description: dict[str, Any], rate: float, frame: int) -> Pattern:
    """Returns the pattern of frame number `frame` of a device at `rate` frames per second."""
    return FAMILIES[description["family"]](description, rate, frame)


def velodyne_lasers(table: dict[str, Any]) -> list[Laser]:
    """Returns the lasers of a Velodyne's description.

    The table contains either `lasers`, a list of corrections, or columns of angles in degrees.
    """
    if "lasers" in table:
        return [Laser(**laser) for laser in table["lasers"]]
    elevations = table["elevations"]
    turns = table.get("rot_corrections", [0.0] * len(elevations))
    # All beams of a device intersect at its focal point, at this distance from the axis.
    focal = table.get("focal_distance", 0.0)
    heights = table.get("heights") or [float(-focal * tan(math.radians(angle))) for angle in elevations]
    return [
        Laser(math.radians(elevation), math.radians(turn), height=height)
        for elevation, turn, height in zip(elevations, turns, heights, strict=True)
    ]


def ouster_unit(table: dict[str, Any]) -> OusterUnit:
    """Returns the calibration in the description of an Ouster."""
    angles = table["beam_azimuth_angles"]
    shifts = table.get("pixel_shift_by_row")
    return OusterUnit(
        tuple(table["beam_altitude_angles"]),
        tuple(angles),
        tuple(table["beam_to_lidar_transform"]),
        tuple(table["lidar_to_sensor_transform"]),
        tuple(shifts) if shifts is not None else (),
    )


def _velodyne(description: dict[str, Any], rate: float, frame: int) -> Pattern:
    table = description["velodyne"]
    return velodyne_pattern(velodyne_lasers(table), table["offsets"], table["cycle"], rate)


def _ouster(description: dict[str, Any], rate: float, frame: int) -> Pattern:
    columns = int(str(description["mode"]).split("x")[0])
    return ouster_pattern(ouster_unit(description["ouster"]), columns, rate)


def _hesai(description: dict[str, Any], rate: float, frame: int) -> Pattern:
    table = description["hesai"]
    columns = round(table["points_per_second"] / rate)
    return hesai_pattern(table["elevations"], table["azimuths"], table["fire_times"], columns, rate)


def _risley(description: dict[str, Any], rate: float, frame: int) -> Pattern:
    table = description["risley"]
    columns = (table[name] for name in ("wedges", "frequencies", "indices", "flat_first"))
    prisms = [Prism(*values) for values in zip(*columns, strict=True)]
    return risley_pattern(prisms, table["pulse_rate"], rate, frame)


def _golden(description: dict[str, Any], rate: float, frame: int) -> Pattern:
    """Returns a pattern that covers the field of view evenly.

    The azimuth advances in golden-ratio steps, the elevation's sine in equal steps.
    """
    table = description["golden"]
    count = round(table["pulse_rate"] / rate)
    check_count(count)
    index = np.arange(count)
    low, high = (math.radians(angle) for angle in table["azimuths"])
    turn = np.fmod((index + frame * count) * GOLDEN_TURN, 1.0)
    azimuth = low + (high - low) * turn
    bottom, top = sin(np.radians(table["elevations"]))
    up = bottom + (top - bottom) * (index + 0.5) / count
    flat = np.sqrt(1.0 - up * up)
    directions = np.stack([flat * cos(azimuth), flat * sin(azimuth), up], axis=1)
    return free_pattern(directions, index / table["pulse_rate"])


def _line(description: dict[str, Any], rate: float, frame: int) -> Pattern:
    """Returns the pattern of a planar scanner, whose mirror turns counterclockwise in steps."""
    table = description["line"]
    steps = np.arange(table["first_step"], table["last_step"] + 1)
    azimuths = 2.0 * math.pi * (steps - table["front_step"]) / table["steps_per_turn"]
    directions = np.stack([cos(azimuths), sin(azimuths), np.zeros(len(steps))], axis=1)[:, None]
    times = (steps - table["first_step"]) / (table["steps_per_turn"] * rate)
    return grid_pattern(times[:, None], directions, np.zeros(3), [0])


def _mirror(description: dict[str, Any], rate: float, frame: int) -> Pattern:
    return mirror_pattern(description["mirror"], rate, frame)


def _table(description: dict[str, Any], rate: float, frame: int) -> Pattern:
    table = description["table"]
    times = np.array(table["times"], dtype=float)
    check_count(len(times))
    rings = table.get("rings")
    origins = table.get("origins")
    return free_pattern(
        np.array(table["directions"], dtype=float).reshape(-1, 3),
        times,
        None if rings is None else np.array(rings, np.int32),
        None if origins is None else np.array(origins, dtype=float).reshape(-1, 3),
    )


FAMILIES: dict[str, Callable[[dict[str, Any], float, int], Pattern]] = {
    "velodyne": _velodyne,
    "ouster": _ouster,
    "hesai": _hesai,
    "risley": _risley,
    "golden": _golden,
    "mirror": _mirror,
    "line": _line,
    "table": _table,
}
"""The function that makes the pattern of a family: (description, rate, frame) -> pattern."""


def check_family(description: dict[str, Any]) -> None:
    """Raises `LidarError` if the family is unknown, or if its table is missing."""
    family = description.get("family")
    if family not in FAMILIES or family not in description:
        raise LidarError(
            f"unknown lidar family {family!r}; options: {', '.join(FAMILIES)}", code="unknown_name"
        )
