"""Options that say from where a world is seen and how well, for every command that renders."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any

from ...errors import SettingsError, nearest

if TYPE_CHECKING:
    from ...world import World

__all__ = ["add_preset", "is_framed", "preset", "reject_look", "side"]

PRESETS: dict[str, dict[str, Any]] = {
    "draft": {"samples": 4},
    "good": {"integrator": "path", "samples": 128},
    "best": {"integrator": "path", "noise_threshold": 0.004, "samples": 4096},
}
"""Settings of rendering by the names of `--preset`; what is given beside it counts."""


def add_preset(group: argparse._ArgumentGroup) -> None:
    """Adds `--preset`."""
    group.add_argument(
        "--preset",
        choices=tuple(PRESETS),
        help="draft: a glance; good: path tracing, 128 rays per pixel; best: until the noise is invisible",
    )


def preset(options: argparse.Namespace) -> dict[str, Any]:
    """The settings of `--preset`, without those that are given."""
    chosen = getattr(options, "preset", None)
    return {} if chosen is None else PRESETS[chosen]


def is_framed(world: World, options: argparse.Namespace) -> bool:
    """True if the camera stands where the world fits the picture, and not where the world or a calibration has it."""
    asked = any(getattr(options, name, None) is not None for name in ("view_from", "zoom"))
    if getattr(options, "camera", None) is not None:
        return asked
    return asked or getattr(options, "fov", None) is not None or not world.cameras


def reject_look(options: argparse.Namespace, names: tuple[str, ...], reason: str) -> None:
    """Raises `SettingsError` if one of the options is given."""
    for name in names:
        if getattr(options, name, None) not in (None, False):
            raise SettingsError(f"--{name.replace('_', '-')}: {reason}")


def side(text: str) -> Any:
    """Parses a side by name, or X,Y,Z."""
    from ...world.framing import DIRECTIONS

    if text in DIRECTIONS:
        return text
    try:
        x, y, z = (float(number) for number in text.split(","))
    except ValueError:
        message = nearest("side", text, list(DIRECTIONS))
        raise argparse.ArgumentTypeError(f"{message[:-1]}; or X,Y,Z, as in 1,-2,1)") from None
    return (x, y, z)
