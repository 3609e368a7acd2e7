"""A lidar's settings and pattern as text."""

from __future__ import annotations

import math

import numpy as np

from .lidar import Lidar
from .settings import SETTINGS

__all__ = ["describe_lidar"]

UNITS = {name: unit for name, (_, _, unit) in SETTINGS.items()} | {
    "rate": "Hz",
    "beam_width": "metres",
    "beam_divergence": "radians",
}


def describe_lidar(lidar: Lidar) -> str:
    """Returns the device's pattern, settings and sources of numbers, with one entry per line."""
    pattern = lidar.pattern()
    up = np.degrees(np.arcsin(np.clip(pattern.directions[:, 2], -1.0, 1.0)))
    rows, columns = pattern.shape
    lines = [
        f"{lidar.name}: {lidar.title}",
        f"pulses per frame: {len(pattern)}" + (f" ({rows} lasers, {columns} columns)" if rows else ""),
        f"elevations: {up.min():.2f} to {up.max():.2f} degrees" + (" (generic)" if lidar.is_generic else ""),
    ]
    for name, value in lidar.settings.items():
        text = _text(name, value)
        is_assumed = name in lidar.assumed and text not in ("unknown", "no limit")
        lines.append(f"{name}: {text}{' (assumed)' if is_assumed else ''}")
    lines += [f"source: {source}" for source in lidar.sources]
    return "\n".join(lines)


def _text(name: str, value: object) -> str:
    """Returns a setting's value with its unit.

    The result is "unknown" if the manufacturer's documents do not confirm the value.
    """
    if name == "visibility" and value is None:
        return "the world's fog"
    if name == "overlap":
        pairs = value if isinstance(value, list) else []
        return ", ".join(f"{share:g} at {at:g} m" for at, share in pairs) or "1 at all distances"
    if name == "mode" and value is None:
        return "not used by this device"
    if value is None or (name in ("beam_divergence", "beam_width") and value == (0.0, 0.0)):
        return "unknown"
    if isinstance(value, float) and math.isinf(value):
        return "no limit"
    if isinstance(value, tuple):
        text = " x ".join(f"{number:.4g}" for number in value)
    else:
        text = f"{value:g}" if isinstance(value, float) else str(value)
    return f"{text} {UNITS[name]}" if name in UNITS else text
