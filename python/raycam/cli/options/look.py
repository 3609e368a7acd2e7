"""Options of looks: light, ground, background, and the side that a model is seen from."""

from __future__ import annotations

import argparse
import os
from typing import TYPE_CHECKING, Any

from ...errors import SettingsError
from .._options import print_notice
from .framing import is_framed, side

if TYPE_CHECKING:
    from ...camera import Camera
    from ...world import World

__all__ = ["add_look", "dressed"]

SUN, SKY = 2.6, 0.4
"""The irradiance of the sun of `--sun`, and the radiance of its pale sky."""
HDRI_FLOOR = 0.4
"""The reflectance of the floor of `--ground` under `--hdri`: skies are bright, and a shadow is to be seen on it."""
SURROUND = {"environment", "sky", "daylight"}
"""Types of light that come from all around."""
HDRI_SETTINGS = {"integrator": "path", "max_depth": 4, "samples": 32, "view": "pbr_neutral"}
"""Settings of pictures by `--hdri`, of those that nobody gives."""


def add_look(command: argparse.ArgumentParser) -> None:
    """Adds the options of `dressed`, and those by which `view` frames a world."""
    group = command.add_argument_group(
        "look", "a model without lights and cameras stands in a studio unless these say otherwise"
    )
    group.add_argument(
        "--view-from",
        metavar="SIDE",
        type=side,
        help="front, back, left, right, top, bottom, iso, or X,Y,Z: from the middle to the camera; beside --camera, "
        "its lens is put where the world fits",
    )
    group.add_argument("--zoom", metavar="N", type=float, help="larger: 1 fills nine tenths of the picture")
    group.add_argument("--fov", metavar="DEGREES", type=float, help="vertical field of view (default 45)")
    group.add_argument(
        "--up",
        choices=("y", "z"),
        help="the model's up axis (default: as its file says; OBJ y, other meshes z)",
    )
    group.add_argument("--hdri", metavar="FILE", help="light from an image all around: .hdr or .exr")
    group.add_argument(
        "--hdri-rotation", metavar="DEGREES", type=float, help="turn it to the left, seen from above"
    )
    group.add_argument(
        "--sun",
        metavar=("AZIMUTH", "ELEVATION"),
        nargs=2,
        type=float,
        help="a sun with a pale sky; degrees to the right of the front, and above the horizon",
    )
    group.add_argument(
        "--studio", action="store_true", help="the studio, also for worlds with lights or cameras"
    )
    group.add_argument(
        "--ground",
        metavar="COLOR|shadow",
        nargs="?",
        const="",
        help="a floor under it, for shadows to fall on; shadow: its shadows alone, over --background",
    )
    group.add_argument(
        "--background",
        metavar="COLOR|FILE",
        help="transparent, a colour (white, #e8eef4), or a .png or .jpg picture to lay it over: one of the camera's "
        "size is used pixel by pixel",
    )
    group.add_argument(
        "--background-camera",
        metavar="FILE[:NAME]",
        help="the camera that took --background, where that is another one: the photograph is warped",
    )


def dressed(
    world: World,
    camera: Camera,
    options: argparse.Namespace,
    settings: dict[str, Any],
    *,
    shaded: bool = True,
    truth_of_world: bool = True,
) -> tuple[World, dict[str, Any]]:
    """The world with the lights and the ground of the options, and the settings of rendering.

    Without such options, a world that nothing lights and that no camera of its own shows stands in the studio, if the
    picture is `shaded`: depth and ids need no light. If not `truth_of_world`, the studio has no floor: its ground truth
    would be in the way.
    """
    from ...render import STUDIO_NOTICE, is_unlit, studio_settings

    transparent = bool(settings.get("transparent_background"))
    _check_lights(options, settings)
    lit_by_options = bool(options.hdri or options.sun or options.studio)
    asked = world.render_settings | settings
    in_studio = options.studio
    if shaded and not lit_by_options and is_framed(world, options) and is_unlit(world, camera, asked):
        in_studio = True
        print_notice(STUDIO_NOTICE)
    if lit_by_options and world.lights:
        count = len(world.lights)
        print_notice(f"the lights of the options are added to {count} of the world")
    if shaded and not in_studio and not lit_by_options:
        _tell_of_lights(world, options)
    if not in_studio and not lit_by_options and options.ground is None:
        return world, settings
    if in_studio:
        floor = not transparent and options.ground is None and truth_of_world
        world = world.in_studio(camera, ground=floor)
        settings = studio_settings(world.render_settings | settings)
    else:
        world = world.with_cameras({})
    _add_lights(world, options)
    if options.ground is not None:
        world.add_ground(**_ground(options))
        world = world.copy()  # a requested ground belongs to the ground truth
    if options.hdri is not None:
        own = dict(HDRI_SETTINGS)
        if "noise_threshold" in settings or "time_limit" in settings:
            del own["samples"]
        settings = own | world.render_settings | settings
    return world, settings


def _ground(options: argparse.Namespace) -> dict[str, Any]:
    """The keys of the floor of `--ground`."""
    if options.ground == "shadow":
        return {"shadow_catcher": True}
    color = options.ground or (HDRI_FLOOR if options.hdri is not None else None)
    return {"color": color}


def _tell_of_lights(world: World, options: argparse.Namespace) -> None:
    """Prints a notice where a model's few lights alone light it: metals have nothing to reflect then."""
    kinds = {light["type"] for light in world.lights}
    is_model = not os.fspath(options.world).endswith(".toml")
    if is_model and kinds and not kinds & SURROUND and is_framed(world, options):
        count = len(world.lights)
        lights = "1 light" if count == 1 else f"{count} lights"
        print_notice(f"lit by the {lights} of its file alone; --studio puts it into the studio as well")


def _add_lights(world: World, options: argparse.Namespace) -> None:
    """Adds the lights of `--hdri` and `--sun`."""
    import math

    from ...data import bundled
    from ...world.framing import axes_of

    if options.hdri is not None:
        found = bundled(options.hdri) or options.hdri
        world.add_light(type="environment", image=os.path.abspath(found), yaw=options.hdri_rotation or 0.0)
    if options.sun is not None:
        azimuth, elevation = (math.radians(angle) for angle in options.sun)
        right, front, upward = axes_of(world.up)
        level = math.cos(azimuth) * front + math.sin(azimuth) * right
        to_sun = math.cos(elevation) * level + math.sin(elevation) * upward
        world.add_light(type="sun", direction=(-to_sun).tolist(), irradiance=SUN, angular_diameter=0.53)
        if options.hdri is None and not options.studio:
            world.add_light(type="sky", radiance=SKY)


def _check_lights(options: argparse.Namespace, settings: dict[str, Any]) -> None:
    """Raises `SettingsError` for options of light that have no effect."""
    if options.hdri_rotation is not None and options.hdri is None:
        raise SettingsError("--hdri-rotation turns the image of --hdri FILE, which is missing")
    unlit = settings.get("integrator") in ("flat", "ao", "reference")
    for name in ("hdri", "sun", "studio"):
        if unlit and getattr(options, name):
            raise SettingsError(
                f"--{name} is light, which --integrator {settings['integrator']} does not show"
            )
