"""Ouster's metadata files. Source: ouster-sdk, `sensor_info.cpp`, and its test files."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np

from ...arguments import product
from ...errors import LidarError, Notice
from ...notices import warn
from .reading import base_description, finite, read_text

__all__ = ["read_ouster"]

DEVICES = {
    "os0": {128: "os0-128"},
    "os1": {16: "os1-16", 32: "os1-32", 64: "os1-64", 128: "os1-128"},
    "os2": {128: "os2-128"},
}
"""The devices of each kind by their number of rows."""
PREFIXES = {"OS-0": "os0", "OS-1": "os1", "OS-2": "os2", "OS0": "os0", "OS1": "os1", "OS2": "os2"}
SECTIONS = (
    "sensor_info",
    "beam_intrinsics",
    "lidar_intrinsics",
    "lidar_data_format",
    "data_format",
    "config_params",
)
DEFAULT_LIDAR_TO_SENSOR = (-1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 36.18, 0.0, 0.0, 0.0, 1.0)
DEFAULT_ORIGINS_MM = {"OS-0-": 27.67, "OS-1-": 15.806, "OS-2-": 13.762}
"""lidar_origin_to_beam_origin_mm for files without this value, by the beginning of prod_line."""
FIRST_ORIGIN_MM = 12.163
"""lidar_origin_to_beam_origin_mm for devices of the first generation, whose files have no prod_line."""
MAX_OFFSET_MM = 1e5
"""The largest offset between a unit's coordinate systems, in millimetres."""
MAX_SHIFT = 1e4
"""The largest shift of a row, in columns."""
ROTATION_TOLERANCE = 1e-3
"""The largest deviation of a rotation from an orthonormal matrix; files contain rounded numbers."""
FIRST_SHIFTS = (18, 12, 6, 0)
"""pixel_shift_by_row of devices of 64 rows at 1024 columns, repeated, for files without this value."""


def read_ouster(path: Path, device: str | None) -> dict[str, Any]:
    """Returns the description of the unit in a metadata file."""
    try:
        document = json.loads(read_text(path))
    except ValueError as fault:
        raise LidarError(f"{path}: not a JSON file: {fault}", code="syntax") from None
    except RecursionError:
        raise LidarError(f"{path}: the JSON file is nested too deeply", code="syntax") from None
    if not isinstance(document, dict):
        raise LidarError(f"{path}: expected a JSON object with Ouster's metadata", code="syntax")
    keys: dict[str, Any] = dict(document)
    for section in SECTIONS:
        if isinstance(document.get(section), dict):
            keys.update(document[section])
    altitudes = _angles(path, keys, "beam_altitude_angles", 90.0)
    azimuths = _angles(path, keys, "beam_azimuth_angles", 360.0)
    if len(altitudes) != len(azimuths):
        raise LidarError(
            f"{path}: {len(altitudes)} beam_altitude_angles and {len(azimuths)} beam_azimuth_angles; "
            "expected equal numbers",
            code="wrong_shape",
        )
    kind = _kind(keys)
    if device is None and kind is None and "prod_line" in keys:
        _report_product(path, keys["prod_line"])
    kind = kind or "os1"
    similar = DEVICES[kind][128] if len(altitudes) in DEVICES["os1"] else None
    description = base_description(path, device, "ouster", len(altitudes), DEVICES[kind], similar)
    if device is None and len(altitudes) not in DEVICES[kind]:
        description["title"] = f"Ouster {kind.upper()}-{len(altitudes)}, {path.name}"
    mode = keys.get("lidar_mode") or _mode_of_format(keys)
    if isinstance(mode, str) and mode in description["modes"]:
        description["mode"] = mode
    elif mode is not None:
        raise LidarError(
            f"{path}: lidar_mode is {mode!r}; supported: {', '.join(description['modes'])}",
            code="unknown_name",
        )
    table: dict[str, Any] = {
        "beam_altitude_angles": altitudes,
        "beam_azimuth_angles": azimuths,
        "beam_to_lidar_transform": _beam_to_lidar(path, keys),
        "lidar_to_sensor_transform": _matrix(
            path, keys, "lidar_to_sensor_transform", DEFAULT_LIDAR_TO_SENSOR
        ),
    }
    shifts = keys.get("pixel_shift_by_row")
    if shifts is None and len(altitudes) == 64:
        table["pixel_shift_by_row"], table["pixel_shift_columns"] = list(FIRST_SHIFTS) * 16, 1024
    if shifts is not None:
        values = _numbers(path, "pixel_shift_by_row", shifts, MAX_SHIFT)
        if len(values) != len(altitudes):
            raise LidarError(
                f"{path}: pixel_shift_by_row has {len(values)} values; expected one for each of {len(altitudes)} rows",
                code="wrong_shape",
            )
        table["pixel_shift_by_row"] = [int(value) for value in values]
        table["pixel_shift_columns"] = int(description.get("mode", "1024x10").split("x")[0])
    description["ouster"] = table
    return description


def _report_product(path: Path, line: object) -> None:
    """Issues a notice about an unknown product line."""
    text = (
        f"{path}: unknown prod_line {line!r}; the values of an OS1 are used for ranges, noise and other settings "
        "that the file does not contain; pass these settings, or a device as the second argument of load_lidar"
    )
    warn(Notice(text, "assumed_device"))


def _kind(keys: dict[str, Any]) -> str | None:
    """Returns the kind of device, such as "os1", for a product line such as "OS-1-128".

    The result is None for other product lines.
    """
    line = str(keys.get("prod_line", "")).upper()
    return next((kind for prefix, kind in PREFIXES.items() if line.startswith(prefix)), None)


def _mode_of_format(keys: dict[str, Any]) -> str | None:
    """Returns the mode of a file without `lidar_mode`.

    The mode follows from the columns and the frames per second of the file's data format.
    """
    columns, rate = keys.get("columns_per_frame"), keys.get("fps", 10)
    return None if columns is None else f"{columns}x{rate}"


def _angles(path: Path, keys: dict[str, Any], name: str, limit: float) -> list[float]:
    if name not in keys:
        raise LidarError(f"{path}: key {name} is missing; expected Ouster's metadata", code="missing_value")
    angles = _numbers(path, name, keys[name])
    for row, angle in enumerate(angles):
        if abs(angle) > limit:
            raise LidarError(
                f"{path}: {name}[{row}] is {angle}; expected degrees within +-{limit:g}", code="out_of_range"
            )
    if not any(angles):
        raise LidarError(f"{path}: all {name} are 0; the file contains no calibration", code="missing_value")
    return angles


def _numbers(path: Path, name: str, values: object, limit: float = math.inf) -> list[float]:
    if isinstance(values, list) and values and all(isinstance(row, list) for row in values):
        values = [value for row in values for value in row]  # newer files nest matrices
    if not isinstance(values, list) or not values:
        raise LidarError(f"{path}: {name} must be a list of numbers", code="wrong_type")
    return [finite(value, f"{path}: {name}[{row}]", limit) for row, value in enumerate(values)]


def _matrix(path: Path, keys: dict[str, Any], name: str, default: tuple[float, ...]) -> list[float]:
    values = _numbers(path, name, keys[name], MAX_OFFSET_MM) if keys.get(name) else list(default)
    if len(values) != 16:
        raise LidarError(f"{path}: {name} has {len(values)} numbers; expected 16", code="wrong_shape")
    turn = np.reshape(values, (4, 4))[:3, :3]
    if not np.allclose(product(turn, turn.T), np.eye(3), rtol=0.0, atol=ROTATION_TOLERANCE):
        raise LidarError(
            f"{path}: the upper left 3 x 3 block of {name} must be a rotation, got {turn.tolist()}",
            code="not_a_rotation",
        )
    return values


def _beam_to_lidar(path: Path, keys: dict[str, Any]) -> list[float]:
    if keys.get("beam_to_lidar_transform"):
        return _matrix(path, keys, "beam_to_lidar_transform", ())
    line = str(keys.get("prod_line", ""))
    default = next(
        (mm for start, mm in DEFAULT_ORIGINS_MM.items() if line.startswith(start)), FIRST_ORIGIN_MM
    )
    origin = keys.get("lidar_origin_to_beam_origin_mm", default)
    offset = finite(origin, f"{path}: lidar_origin_to_beam_origin_mm", MAX_OFFSET_MM)
    return [1.0, 0.0, 0.0, offset, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0]
