"""Rendering: a world and a camera become a frame."""

from __future__ import annotations

from .options import FILTERS, INTEGRATORS, RENDER_OPTIONS, VIEWS, RenderOption, RenderOptions
from .render import render
from .request import DEFAULT_CHANNELS, Region, channel_names, is_shaded
from .studio import STUDIO_NOTICE, exposure_of_lights, is_unlit, lacks_surroundings, studio_options

__all__ = [
    "DEFAULT_CHANNELS",
    "FILTERS",
    "INTEGRATORS",
    "RENDER_OPTIONS",
    "STUDIO_NOTICE",
    "VIEWS",
    "Region",
    "RenderOption",
    "RenderOptions",
    "channel_names",
    "exposure_of_lights",
    "is_shaded",
    "is_unlit",
    "lacks_surroundings",
    "render",
    "studio_options",
]
