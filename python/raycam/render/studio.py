"""The studio for worlds without lights and cameras: when it is used, and with which options."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from ..errors import Notice
from .sight import LIT_INTEGRATORS

if TYPE_CHECKING:
    from ..camera import Camera
    from ..world import World

__all__ = ["STUDIO_NOTICE", "STUDIO_OPTIONS", "is_unlit", "studio_options"]

STUDIO_OPTIONS = {"integrator": "path", "max_depth": 6, "samples": 8, "view": "pbr_neutral"}
"""Default options of images in the studio."""
STUDIO_NOTICE = Notice(
    "the world has no lights and no camera: it is rendered in the studio, viewed from the front right and "
    'from above, with integrator="path" and max_depth=6; add lights or a camera to replace the studio',
    "studio",
)


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
