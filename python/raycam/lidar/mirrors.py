"""Scanners that deflect the beam with a moving mirror.

A mirror with the unit normal n deflects the beam b to the direction d = b - 2 (b · n) n. The middle of the
scan is the x axis.

Source: law of reflection; forms of mirrors: Wehr and Lohr (1999), "Airborne laser scanning - an introduction
and overview", ISPRS Journal 54, section 4.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from ..arguments import Floats, floats, one_of, real, whole
from ..elementary import cos, sin
from ..errors import LidarError, nearest
from .pattern import Pattern, check_count, free_pattern, grid_pattern

__all__ = ["MIRRORS", "frame_rate", "mirror_pattern", "mirror_table"]

BEAM = np.array([0.0, -1.0, 0.0])
"""Direction of the laser in front of a polygon or an oscillating mirror, perpendicular to the mirror's axis z."""
CONE_BEAM = np.array([0.0, 0.0, -1.0])
"""Direction of the laser in front of a conical mirror, at 45 degrees to the mirror's axis."""
CONE_AXIS = np.array([1.0, 0.0, 1.0]) / math.sqrt(2.0)


LIMITS: dict[str, dict[str, tuple[float, float]]] = {
    "polygon": {"line_rate": (1e-6, 1e6), "field_of_view": (1e-6, 360.0)},
    "oscillating": {"frequency": (1e-6, 1e6), "field_of_view": (1e-6, 180.0)},
    "conical": {"frequency": (1e-6, 1e6), "tilt": (0.0, 40.0)},
    "survey": {},
}
"""For each kind of mirror, the limits of its numbers in hertz or degrees; `facets`, the grid and `pulse_rate` are
checked separately."""


def mirror_table(kind: str, numbers: dict[str, Any]) -> dict[str, Any]:
    """Checks and returns the numbers of a mirror.

    Raises `LidarError` for unknown, missing and impossible numbers.
    """
    one_of("kind", kind, list(LIMITS), error=LidarError)
    others = {"polygon": ["facets"], "survey": ["elevations", "azimuths", "pause"]}.get(kind, [])
    expected = ["pulse_rate", *LIMITS[kind], *others]
    for name in numbers:
        if name not in expected:
            raise LidarError(nearest(f"setting of the mirror {kind!r}", name, expected), code="unknown_name")
    missing = [name for name in expected if name not in numbers and name != "pause"]
    if missing:
        raise LidarError(f"the mirror {kind!r} requires {', '.join(missing)}", code="missing_value")
    table: dict[str, Any] = {
        "kind": kind,
        "pulse_rate": real(
            "pulse_rate", numbers["pulse_rate"], 1e-3, 1e9, what="a frequency in Hz", error=LidarError
        ),
    }
    for name, (low, high) in LIMITS[kind].items():
        table[name] = real(name, numbers[name], low, high, error=LidarError)
    if kind == "polygon":
        table["facets"] = whole("facets", numbers["facets"], 2, 1000, error=LidarError)
        widest = 720.0 / table["facets"]
        if table["field_of_view"] > widest:
            raise LidarError(
                f"field_of_view is {table['field_of_view']:g}; a polygon of {table['facets']} facets scans at most "
                f"{widest:g} degrees",
                code="out_of_range",
            )
    if kind == "survey":
        table["elevations"] = _check_grid("elevations", numbers["elevations"], -90.0, 90.0)
        table["azimuths"] = _check_grid("azimuths", numbers["azimuths"], -360.0, 360.0)
        table["pause"] = real("pause", numbers.get("pause", 0.0), 0.0, 100.0, error=LidarError)
    return table


def _check_grid(name: str, value: Any, low: float, high: float) -> list[float]:
    """Returns (from, to, step) in degrees; raises `LidarError` for other values."""
    first, last, step = floats(name, value, (3,), error=LidarError).tolist()
    if not (low <= first <= last <= high and math.isfinite(step) and step > 0.0):
        raise LidarError(
            f"{name} must be (from, to, step) in degrees, from {low:g} to {high:g} and ascending, not "
            f"{[first, last, step]}",
            code="out_of_range",
        )
    check_count(math.floor((last - first) / step + 1e-9) + 1)
    return [first, last, step]


def frame_rate(table: dict[str, Any]) -> float:
    """Returns the default number of frames per second.

    The default is 10, or one whole grid per frame for a survey.
    """
    if table["kind"] != "survey":
        return 10.0
    rows, columns = (len(axis) for axis in survey_grid(table))
    return float(table["pulse_rate"] / (rows * columns * (1.0 + table["pause"])))


def mirror_pattern(table: dict[str, Any], rate: float, frame: int) -> Pattern:
    """Returns the pulses of frame number `frame`.

    The mirror's motion continues from frame to frame.
    """
    return MIRRORS[table["kind"]](table, rate, frame)


def reflect(beam: Floats, normals: Floats) -> Floats:
    """Returns the directions [n, 3] of `beam` [3] after mirrors with unit normals [n, 3]."""
    along = beam[0] * normals[:, 0] + beam[1] * normals[:, 1] + beam[2] * normals[:, 2]
    reflected: Floats = beam - 2.0 * along[:, None] * normals
    return reflected


def _clock(table: dict[str, Any], rate: float, frame: int) -> tuple[Floats, Floats]:
    """Returns the pulses' times since the frame's start, and since the start of frame 0."""
    count = round(table["pulse_rate"] / rate)
    check_count(count)
    pulses = np.arange(count)
    return pulses / table["pulse_rate"], (pulses + frame * count) / table["pulse_rate"]


def _turned_facets(angles: Floats) -> Floats:
    """Returns the directions of the beam after a mirror that is turned about z.

    The mirror is turned by `angles` [n] in radians from 45 degrees. A mirror that turns by an angle turns the
    beam by twice the angle.
    """
    turns = 0.25 * math.pi + angles
    normals = np.stack([cos(turns), sin(turns), np.zeros(len(turns))], axis=1)
    return reflect(BEAM, normals)


def _polygon(table: dict[str, Any], rate: float, frame: int) -> Pattern:
    """Returns the pattern of a rotating polygon: parallel lines in the x-y plane.

    All lines have the same direction, from right to left. Only pulses within the field of view are emitted.
    Each line is a ring; rings are counted from 0 in each frame.
    """
    moments, clock = _clock(table, rate, frame)
    phase = clock * table["line_rate"]
    # Each facet turns by 2 pi / facets during a line.
    facet = 2.0 * math.pi / table["facets"]
    angles = (np.fmod(phase, 1.0) - 0.5) * facet
    inside = np.flatnonzero(np.abs(2.0 * angles) <= math.radians(table["field_of_view"]) / 2.0)
    lines = np.floor(phase[inside]).astype(np.int64)
    first = math.floor(phase[0]) if len(phase) else 0
    return free_pattern(_turned_facets(angles[inside]), moments[inside], (lines - first).astype(np.int32))


def _oscillating(table: dict[str, Any], rate: float, frame: int) -> Pattern:
    """Returns the pattern of an oscillating mirror: a zigzag in the x-y plane.

    The mirror's angle is a sine of time, and the beam first moves to the left. Each half period is a ring.
    """
    moments, clock = _clock(table, rate, frame)
    phase = clock * table["frequency"]
    swings = sin(2.0 * math.pi * np.fmod(phase, 1.0))
    angles = math.radians(table["field_of_view"]) / 4.0 * swings
    half_turns = np.floor(2.0 * phase).astype(np.int64)
    first = int(half_turns[0]) if len(half_turns) else 0
    return free_pattern(_turned_facets(angles), moments, (half_turns - first).astype(np.int32))


def _conical(table: dict[str, Any], rate: float, frame: int) -> Pattern:
    """Returns the pattern of a Palmer scanner: ovals around the x axis.

    The mirror's normal is tilted from the mirror's axis of rotation.
    """
    moments, clock = _clock(table, rate, frame)
    turns = np.fmod(clock * table["frequency"], 1.0)
    angles = 2.0 * math.pi * turns
    tilt = math.radians(table["tilt"])
    across, along = np.array([0.0, 1.0, 0.0]), np.cross(CONE_AXIS, [0.0, 1.0, 0.0])
    around = cos(angles)[:, None] * across + sin(angles)[:, None] * along
    normals = cos(tilt) * CONE_AXIS + sin(tilt) * around
    rings = np.floor(clock * table["frequency"]).astype(np.int64)
    first = int(rings[0]) if len(rings) else 0
    return free_pattern(reflect(CONE_BEAM, normals), moments, (rings - first).astype(np.int32))


def survey_grid(table: dict[str, Any]) -> tuple[Floats, Floats]:
    """Returns the elevations [rows] and azimuths [columns] of a survey in degrees.

    The last value of each range is included if it is a whole number of steps from the first value.
    """
    axes = []
    for name in ("elevations", "azimuths"):
        first, last, step = table[name]
        axes.append(first + step * np.arange(math.floor((last - first) / step + 1e-9) + 1))
    return axes[0], axes[1]


def _survey(table: dict[str, Any], rate: float, frame: int) -> Pattern:
    """Returns the pattern of a scanner on a tripod: a grid of vertical lines.

    A polygon scans a vertical line upwards, while the head turns counterclockwise by a step. Each frame is
    the whole grid. Within a line, the azimuth advances with time.
    """
    elevations, azimuths = survey_grid(table)
    check_count(len(elevations) * len(azimuths))
    line = len(elevations) / table["pulse_rate"] * (1.0 + table["pause"])
    within = np.arange(len(elevations)) / table["pulse_rate"]
    times = np.arange(len(azimuths))[:, None] * line + within
    turns = azimuths[:, None] + table["azimuths"][2] * (within / line)
    up = np.broadcast_to(np.radians(elevations), times.shape)
    flat, height = cos(up), sin(up)
    angles = np.radians(turns)
    directions = np.stack([flat * cos(angles), flat * sin(angles), height], axis=-1)
    rings = np.arange(len(elevations))
    return grid_pattern(times, directions, np.zeros(3), rings)


MIRRORS: dict[str, Callable[[dict[str, Any], float, int], Pattern]] = {
    "polygon": _polygon,
    "oscillating": _oscillating,
    "conical": _conical,
    "survey": _survey,
}
"""The function that makes the pattern of a kind of mirror: (table, rate, frame) -> pattern."""
