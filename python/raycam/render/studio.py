"""The studio for models without lights or surroundings: its use and its options."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import Notice
from ..srgb import LUMINANCE
from .request import image_request
from .sight import LIT_INTEGRATORS

if TYPE_CHECKING:
    from ..camera import Camera
    from ..world import World

__all__ = [
    "STUDIO_NOTICE",
    "STUDIO_OPTIONS",
    "exposure_of_lights",
    "is_unlit",
    "lacks_surroundings",
    "studio_options",
]

STUDIO_OPTIONS = {"integrator": "path", "max_depth": 6, "samples": 8, "view": "pbr_neutral"}
"""Default options of images in the studio."""
STUDIO_NOTICE = Notice(
    'the world has no lights: it is rendered in the studio, with integrator="path" and max_depth=6; add lights, or a '
    "camera with its own pose, to replace the studio",
    "studio",
)
SURROUNDING_LIGHTS = {"environment", "sky", "daylight"}
"""Types of lights that shine from all directions, and that metals and glass show."""
PROBE_SIDE = 96
"""The longer side in pixels of the image that measures a model's lights."""
BRIGHT_SHARE = 0.9
"""This fraction of the pixels of model and floor is at most as bright as `MAX_BRIGHTNESS`."""
MAX_BRIGHTNESS = 0.3
"""Luminance under the model's own lights above which the exposure is reduced, about that of the floor under the key
light.
"""


def studio_options(given: Mapping[str, Any]) -> dict[str, Any]:
    """Returns the given options, completed by the studio's defaults."""
    defaults = dict(STUDIO_OPTIONS)
    if "noise_threshold" in given or "time_limit" in given:
        del defaults["samples"]
    return {**defaults, **given}


def is_unlit(world: World, camera: Camera, options: Mapping[str, Any]) -> bool:
    """True if the integrator shows light, but neither lights nor surfaces of the world emit any."""
    if world.lights or options.get("integrator", "path") not in LIT_INTEGRATORS:
        return False
    world.prepare()
    return world._core.lit_by_default_lights


def lacks_surroundings(world: World, options: Mapping[str, Any]) -> bool:
    """Returns True if the integrator shows light, but no light comes from all directions.

    The world's lights are then only suns or lamps; a world without lights returns False. Metals and glass then reflect
    nothing, and the background is black.
    """
    kinds = {light["type"] for light in world.lights}
    return (
        bool(kinds)
        and not kinds & SURROUNDING_LIGHTS
        and options.get("integrator", "path") in LIT_INTEGRATORS
    )


def exposure_of_lights(world: World, camera: Camera) -> float:
    """Returns the exposure in stops, at most 0, at which the world is not overexposed.

    The exposure is measured in a small image of the world and a floor below it, lit by the world's own lights. Files
    specify lights in physical units, and some lights are as strong as sunlight.
    """
    world = world.copy()
    world.add_ground()
    scale = min(PROBE_SIDE / max(camera.size), 1.0)
    small = camera.resized((max(round(camera.size[0] * scale), 1), max(round(camera.size[1] * scale), 1)))
    request, _, _ = image_request(
        world,
        {"integrator": "direct", "samples": 1},
        names=["color", "instance"],
        surface="first",
        frame=0,
        transparent_background=False,
        region=None,
    )
    request["cancel"] = None
    world.prepare()
    planes, _, _ = world._core.render(small._core, request, None)
    luminance = planes["color"][planes["instance"] >= 0].astype(float) @ LUMINANCE
    if luminance.size == 0:
        return 0.0
    bright = float(np.sort(luminance)[int(BRIGHT_SHARE * (luminance.size - 1))])
    return min(0.0, round(math.log2(MAX_BRIGHTNESS / bright), 2)) if bright > 0 else 0.0
