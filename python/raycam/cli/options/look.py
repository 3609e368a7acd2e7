"""Options of a model's look: light, ground, background, and the camera's side."""

from __future__ import annotations

import argparse
import os
from typing import TYPE_CHECKING, Any

from ...errors import SettingsError
from .framing import add_framing, is_framed
from .messages import print_notice
from .rendering import HDRI_OPTIONS

if TYPE_CHECKING:
    from ...camera import Camera
    from ...world import World

__all__ = ["add_look", "apply_look"]

HDRI_GROUND_ALBEDO = 0.4
"""Albedo of the floor of `--ground` with `--hdri`: dark enough for shadows under a bright sky to be visible."""


def add_look(command: argparse.ArgumentParser) -> None:
    """Adds the options that `apply_look` and `find_camera` read."""
    group = command.add_argument_group(
        "look",
        "a model without lights and cameras is rendered in a studio, and a model with only suns or lamps in the "
        "studio's room, unless one of these options is given",
    )
    add_framing(group)
    group.add_argument("--hdri", metavar="FILE", help="light from an environment image: .hdr or .exr")
    group.add_argument(
        "--hdri-rotation",
        metavar="DEGREES",
        type=float,
        help="angle in degrees by which the environment is rotated counterclockwise, seen from above (default: 0)",
    )
    group.add_argument(
        "--sun",
        metavar=("AZIMUTH", "ELEVATION"),
        nargs=2,
        type=float,
        help="light from a sun and a pale sky: azimuth, from the front to the right, and elevation in degrees",
    )
    group.add_argument(
        "--studio",
        action=argparse.BooleanOptionalAction,
        help="use the studio, even if the world has lights or cameras; --no-studio: use only the world's lights",
    )
    group.add_argument(
        "--ground",
        metavar="COLOR|shadow",
        nargs="?",
        const="",
        help="add a floor that receives shadows; shadow: show only the shadows, over --background",
    )
    group.add_argument(
        "--background",
        metavar="COLOR|FILE",
        help="background: transparent, a colour (white, #e8eef4), or a .png or .jpg image, which is used pixel by "
        "pixel if it has the camera's size",
    )
    group.add_argument(
        "--background-camera",
        metavar="FILE[:NAME]",
        help="camera that took the photo of --background, if it differs from --camera; the photo is warped",
    )
    group.add_argument(
        "--orientation",
        metavar="NAME",
        help="use of the EXIF orientation of the --background photo: auto (default; rotates the photo only if it "
        "does not fit the camera otherwise), apply (always rotates it) or ignore (never rotates it)",
    )


def apply_look(
    world: World,
    camera: Camera,
    options: argparse.Namespace,
    settings: dict[str, Any],
    *,
    shaded: bool = True,
    truth_of_world: bool = True,
) -> tuple[World, dict[str, Any]]:
    """Returns the world with the lights and the ground of the options, and the render options.

    Without such options, a world without lights is placed in the studio if a framing camera shows it and the image is
    `shaded`, because depth and ids require no light. A model with suns or lamps only is placed in the studio without
    its key light. If `truth_of_world` is False, the studio has no floor, because the floor would appear in the ground
    truth.
    """
    from ...render import STUDIO_NOTICE, exposure_of_lights, is_unlit, lacks_surroundings, studio_options
    from ...world.sources import is_model_file
    from ...world.studio import CLAY, add_clay, lacks_materials

    transparent = bool(settings.get("transparent_background"))
    _check_lights(options, settings)
    lit_by_options = bool(options.hdri or options.sun or options.studio)
    asked = world.render_settings | settings
    in_studio = bool(options.studio)
    studio: dict[str, Any] = {}
    if shaded and not lit_by_options and options.studio is None and is_framed(world, options):
        if is_unlit(world, camera, asked):
            in_studio = True
            print_notice(STUDIO_NOTICE)
        elif is_model_file(options.world) and lacks_surroundings(world, asked):
            in_studio, studio = True, {"key": False, "exposure": exposure_of_lights(world, camera)}
            settings = {"exposure": studio["exposure"]} | settings
            print_notice(_added_room(world, studio["exposure"]))
    if lit_by_options and world.lights:
        count = len(world.lights)
        print_notice(
            f"the world has {count} {'light' if count == 1 else 'lights'}; the options' lights are added"
        )
    if not in_studio and not lit_by_options and options.ground is None:
        return world, settings
    if in_studio:
        floor = not transparent and options.ground is None and truth_of_world
        is_clay = is_model_file(options.world) and lacks_materials(world)
        world = world.in_studio(camera, ground=floor, **studio)
        if is_clay:
            add_clay(world)
            print_notice(f"the model has no materials: it is shown in grey (albedo {CLAY})")
        settings = studio_options(world.render_settings | settings)
    else:
        world = world.with_cameras({})
    _add_lights(world, options)
    if options.ground is not None:
        world.add_ground(**_ground(options))
        world = world.copy()  # a requested ground belongs to the ground truth
    if options.hdri is not None:
        own: dict[str, Any] = dict(HDRI_OPTIONS)
        if "noise_threshold" in settings or "time_limit" in settings:
            del own["samples"]
        settings = own | world.render_settings | settings
    return world, settings


def _ground(options: argparse.Namespace) -> dict[str, Any]:
    """The object keys of the floor that `--ground` adds."""
    if options.ground == "shadow":
        return {"shadow_catcher": True}
    color = options.ground or (HDRI_GROUND_ALBEDO if options.hdri is not None else None)
    return {"color": color}


def _added_room(world: World, exposure: float) -> str:
    """The notice about a model in the studio's room, whose lights are those of its file."""
    count = len(world.lights)
    lights = "1 light" if count == 1 else f"{count} lights"
    exposed = f" (exposure {exposure:g} stops)" if exposure else ""
    return (
        f"the model has {lights} but no surroundings: the studio's room and floor are added{exposed}; "
        "--no-studio uses only the model's lights"
    )


def _add_lights(world: World, options: argparse.Namespace) -> None:
    """Adds the lights of `--hdri` and `--sun`."""
    from ...data import bundled
    from ...world.studio import add_sun

    if options.hdri is not None:
        found = bundled(options.hdri) or options.hdri
        world.add_light(type="environment", image=os.path.abspath(found), yaw=options.hdri_rotation or 0.0)
    if options.sun is not None:
        add_sun(world, *options.sun, sky=options.hdri is None and not options.studio)


def _check_lights(options: argparse.Namespace, settings: dict[str, Any]) -> None:
    """Raises `SettingsError` for light options that have no effect."""
    if options.hdri_rotation is not None and options.hdri is None:
        raise SettingsError("--hdri-rotation requires --hdri FILE", code="missing_value")
    unlit = settings.get("integrator") in ("flat", "ao", "reference")
    for name in ("hdri", "sun", "studio"):
        if unlit and getattr(options, name):
            raise SettingsError(
                f"--{name} has no effect with --integrator {settings['integrator']}, which does not compute light",
                code="conflicting_values",
            )
