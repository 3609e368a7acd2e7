"""The settings of a lidar: their names, limits, units and checks."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, Literal

import numpy as np

from ..arguments import as_number, flag, floats, real, whole
from ..errors import LidarError

__all__ = ["SETTINGS", "SETTING_CHECKS", "Returns"]

Returns = Literal["first", "last", "strongest", "dual", "all"]
RETURNS = ("first", "last", "strongest", "dual", "all")
BEAM_SAMPLES = (1, 7, 19, 37)

SETTINGS: dict[str, tuple[float, float, str]] = {
    "wavelength": (100.0, 20000.0, "nanometres"),
    "step": (0.0, 10.0, "metres"),
    "min_range": (0.0, 1e7, "metres"),
    "max_range": (0.0, math.inf, "metres"),
    "range_10": (1e-3, 1e7, "metres"),
    "range_noise": (0.0, 1e3, "metres"),
    "azimuth_noise": (0.0, 90.0, "degrees"),
    "rise_time": (0.0, 1.0, "seconds"),
    "pulse_length": (0.0, 1e-3, "seconds"),
    "visibility": (1e-3, math.inf, "metres"),
    "signal_gain": (0.0, 1e15, "counts for a white target at 1 m"),
    "near_ir_gain": (0.0, 1e9, "counts for 1 W/(m² sr)"),
}
"""Numeric settings, with their limits and units."""


def _number(name: str, value: Any) -> float:
    low, high, unit = SETTINGS[name]
    if high == math.inf and as_number(value) == math.inf:
        return math.inf
    return real(name, value, low, high, what=unit, error=LidarError)


def _pair(name: str, value: Any) -> list[float]:
    values = [value] * 2 if np.ndim(value) == 0 else list(value)
    if len(values) != 2:
        raise LidarError(
            f"{name} must be one number or (horizontal, vertical), not {value!r}", code="wrong_shape"
        )
    return [real(name, one, 0.0, 1.0, error=LidarError) for one in values]


def _overlap(name: str, value: Any) -> list[list[float]]:
    rows = floats(name, value, ("n", 2), error=LidarError)
    distances, shares = rows[:, 0], rows[:, 1]
    if not (
        len(rows) and np.isfinite(rows).all() and (np.diff(distances) > 0.0).all() and distances[0] >= 0.0
    ):
        raise LidarError(
            f"{name} must be pairs (distance, share) with ascending distances of at least 0, not {rows.tolist()}",
            code="out_of_range",
        )
    if not ((shares >= 0.0) & (shares <= 1.0)).all():
        raise LidarError(f"{name}: shares are {shares.tolist()}; expected 0 to 1", code="out_of_range")
    pairs: list[list[float]] = rows.tolist()
    return pairs


def _choice(options: Sequence[Any]) -> Callable[[str, Any], Any]:
    def check(name: str, value: Any) -> Any:
        if value not in options or isinstance(value, bool):
            raise LidarError(
                f"{name} is {value!r}; options: {', '.join(map(str, options))}", code="unknown_name"
            )
        return value

    return check


def _mode_name(name: str, value: Any) -> str:
    if not isinstance(value, str):
        raise LidarError(f'{name} must be a string such as "1024x10", not {value!r}', code="wrong_type")
    return value


SETTING_CHECKS: dict[str, Callable[[str, Any], Any]] = {
    "rate": lambda name, value: real(name, value, 1e-6, 1e7, what="a frequency in Hz", error=LidarError),
    "mode": _mode_name,
    "returns": _choice(RETURNS),
    "beam_samples": _choice(BEAM_SAMPLES),
    "beam_width": _pair,
    "beam_divergence": _pair,
    "max_bounces": lambda name, value: whole(name, value, 0, 16, error=LidarError),
    "noise": lambda name, value: flag(name, value, error=LidarError),
    "seed": lambda name, value: whole(name, value, 0, 2**63 - 1, error=LidarError),
    "overlap": _overlap,
    "waveform": lambda name, value: flag(name, value, error=LidarError),
    "near_ir_samples": lambda name, value: whole(name, value, 0, 1 << 16, error=LidarError),
    **dict.fromkeys(SETTINGS, _number),
}
"""For each setting, the function of name and value that returns the value, or raises `LidarError`."""
