"""Rendering: a world and a camera become a frame."""

from __future__ import annotations

from .render import (
    DEFAULT_CHANNELS,
    FILTERS,
    INTEGRATORS,
    OPTIONS,
    SHADED,
    STUDIO_NOTICE,
    Region,
    channel_names,
    is_unlit,
    render,
    studio_settings,
)

__all__ = [
    "DEFAULT_CHANNELS",
    "FILTERS",
    "INTEGRATORS",
    "OPTIONS",
    "SHADED",
    "STUDIO_NOTICE",
    "Region",
    "channel_names",
    "is_unlit",
    "render",
    "studio_settings",
]
