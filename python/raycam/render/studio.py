"""The studio of worlds without lights and cameras: when it is used, and with which options."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from .request import image_request, unlit
from .sight import LIT_INTEGRATORS

if TYPE_CHECKING:
    from ..camera import Camera
    from ..world import World

__all__ = ["STUDIO_NOTICE", "STUDIO_OPTIONS", "has_default_light", "is_unlit", "studio_options"]

STUDIO_OPTIONS = {"integrator": "path", "max_depth": 6, "samples": 8, "view": "pbr_neutral"}
"""Defaults of the options of images in the studio."""
STUDIO_NOTICE = (
    "the world has no lights and no camera: it is rendered in the studio, from the front right above, with "
    'integrator="path" and max_depth=6; add lights or a camera to replace it'
)


def studio_options(given: Mapping[str, Any]) -> dict[str, Any]:
    """Returns the given options, and the studio's defaults of the others."""
    defaults = dict(STUDIO_OPTIONS)
    if "noise_threshold" in given or "time_limit" in given:
        del defaults["samples"]
    return {**defaults, **given}


def is_unlit(world: World, camera: Camera, options: Mapping[str, Any]) -> bool:
    """True if the integrator shows light, and the world has neither lights nor surfaces that emit light."""
    if world.lights or options.get("integrator", "path") not in LIT_INTEGRATORS:
        return False
    request, _, _ = image_request(
        world,
        {},
        names=["color"],
        surface="first",
        frame=0,
        transparent_background=False,
        region=(0, 0, 1, 1),
    )
    world.prepare()
    request = {**unlit(request, ["color"]), "integrator": "direct", "filter": "box", "seed": 0, "threads": 1}
    _, _, notices = world._core.render(camera._core, request, None)
    return has_default_light(notices)


def has_default_light(notices: Sequence[str]) -> bool:
    """True if an image with these notices is lit by default lights."""
    return any(notice.startswith("the world has no lights") for notice in notices)
