"""Requests to the core: the arguments from which one image is rendered."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal

from ..arguments import flag, one_of, whole, words
from ..errors import SettingsError
from .frame import CHANNELS, PASSES, is_channel, is_pass
from .options import complete_options

if TYPE_CHECKING:
    from ..world import World

__all__ = [
    "DEFAULT_CHANNELS",
    "SHADED_CHANNELS",
    "Region",
    "Surface",
    "channel_names",
    "check_region",
    "image_request",
    "is_shaded",
    "unlit",
]

DEFAULT_CHANNELS = ("color", "depth", "instance", "triangle")
SHADED_CHANNELS = ("color", "error", *PASSES)
"""The channels that show light, except the channels of single lights."""
SURFACES = ["first", "solid"]
MAX_UINT32 = (1 << 32) - 1

Surface = Literal["first", "solid"]
Region = Sequence[int]


def image_request(
    world: World,
    options: Mapping[str, Any],
    *,
    names: list[str],
    surface: str,
    frame: int,
    transparent_background: bool,
    region: Region | None,
) -> tuple[dict[str, Any], float, str]:
    """Returns the arguments of the core's `render`, the exposure and the view transform.

    The exposure is in stops. `options` are the given options; all others come from the world's `[render]`, or are the
    defaults. Raises `SettingsError` for invalid values.
    """
    request = complete_options(world, options)
    stops, view = request.pop("exposure"), request.pop("view")
    request |= {
        "frame": whole("frame", frame, 0, MAX_UINT32),
        "channels": names,
        "surface": one_of("surface", surface, SURFACES),
        "transparent_background": flag("transparent_background", transparent_background),
        "region": None if region is None else check_region(region),
    }
    return request, stops, view


def unlit(request: Mapping[str, Any], names: list[str], samples: int = 1) -> dict[str, Any]:
    """Returns a copy of a request for other channels, which do not require light."""
    off = dict.fromkeys(("noise_threshold", "time_limit", "ambient_occlusion", "clamp", "max_depth"))
    return {**request, **off, "integrator": "flat", "channels": names, "samples": samples}


def channel_names(channels: Sequence[str] | str) -> list[str]:
    """Returns the names of channels without duplicates.

    "all" means every channel except `light:NAME`. Raises `SettingsError` for unknown names, and for an empty list.
    """
    is_all = isinstance(channels, str) and channels == "all"
    names = words("channel", list(CHANNELS) if is_all else channels, CHANNELS, also=is_channel)
    if not names:
        raise SettingsError(f"channels is empty; options: {', '.join(CHANNELS)}", code="missing_value")
    return names


def is_shaded(name: str) -> bool:
    """True for a channel that shows light."""
    return name in SHADED_CHANNELS or is_pass(name)


def check_region(value: Region) -> list[int]:
    """Returns a region as four ints; raises `SettingsError` for anything else."""
    try:
        sides = [whole("region", side, 0, MAX_UINT32) for side in value]
    except TypeError:
        sides = []
    if len(sides) != 4:
        raise SettingsError(
            f"region must be (x, y, width, height) in pixels, got {value!r}", code="wrong_shape"
        )
    return sides
