"""Helpers for readers of calibrations: numbers with file and line, and the device of a file."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from ...errors import LidarError
from ...io.text_files import decode_text
from ..device import device_description

__all__ = ["base_description", "finite", "read_text"]


def read_text(path: Path) -> str:
    """Returns the text of a file; raises `LidarError` if it is neither UTF-8 nor UTF-16."""
    try:
        return decode_text(path.read_bytes())
    except UnicodeDecodeError as fault:
        raise LidarError(
            f"{path}: not a text file (byte {fault.start} is not UTF-8)", code="not_text"
        ) from None


def finite(text: object, where: str, limit: float = math.inf) -> float:
    """Returns `text` as a number from -`limit` to `limit`.

    Raises `LidarError`, with `where` (file, line and key), for other texts.
    """
    try:
        value = float(text)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        raise LidarError(f"{where}: expected a number, got {text!r}", code="wrong_type") from None
    except OverflowError:
        value = math.inf
    if not math.isfinite(value):
        raise LidarError(f"{where}: expected a finite number, got {text!r:.40}", code="out_of_range")
    if abs(value) > limit:
        raise LidarError(f"{where} is {value:g}; expected a number within +-{limit:g}", code="out_of_range")
    return value


def base_description(
    path: Path,
    device: str | None,
    family: str,
    lasers: int,
    by_lasers: dict[int, str],
    similar: str | None = None,
) -> dict[str, Any]:
    """Returns the device description for a calibration with `lasers` lasers.

    The description is not marked as generic. `by_lasers` has the device for each number of lasers; `similar` is the
    device for all other numbers.

    Raises `LidarError` if `device` has another family or number of lasers, or if no device has this number and
    `similar` is None.
    """
    name = device or by_lasers.get(lasers) or similar
    if name is None:
        counts = ", ".join(str(count) for count in sorted(by_lasers))
        raise LidarError(
            f"{path}: the file has {lasers} lasers; known {family} devices have {counts}", code="wrong_device"
        )
    description = device_description(name)
    if description["family"] != family:
        raise LidarError(
            f"{path}: this calibration requires a device of the family {family}, got {name}",
            code="wrong_device",
        )
    own = laser_count(description)
    if own != lasers and (device is not None or name != similar):
        raise LidarError(
            f"{path}: this calibration has {lasers} lasers, but {name} has {own}", code="wrong_device"
        )
    description.pop("generic", None)
    description["title"] = f"{description['title']}, {path.name}"
    return description


def laser_count(description: dict[str, Any]) -> int:
    """Returns the number of lasers of a device."""
    table = description[description["family"]]
    for name in ("beam_altitude_angles", "elevations", "lasers"):
        if name in table:
            return len(table[name])
    return 1
