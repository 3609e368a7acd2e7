"""Options that place the camera so that the world fits the image."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any

from ...errors import SettingsError, nearest
from .cameras import select_camera
from .messages import print_notice
from .worlds import parse_animation

if TYPE_CHECKING:
    from ...camera import Camera
    from ...world import World

__all__ = ["add_framing", "find_camera", "find_orbit_camera", "is_framed", "reject_options"]

DEFAULT_SIZE = (640, 480)
"""Image size in pixels of cameras that frame a world."""


def add_framing(group: argparse._ArgumentGroup) -> None:
    """Adds `--view-from`, `--zoom`, `--fov` and `--up`."""
    group.add_argument(
        "--view-from",
        metavar="SIDE",
        type=parse_side,
        help="view from front, back, left, right, top, bottom, iso, or X,Y,Z (vector from the centre to the camera); "
        "with --camera: keep its lens, but move it so that the world fits",
    )
    group.add_argument(
        "--zoom",
        metavar="N",
        type=float,
        help="scale of the subject in the image (default: 1, which fills 90 %% of the image)",
    )
    group.add_argument(
        "--fov", metavar="DEGREES", type=float, help="vertical field of view in degrees (default: 45)"
    )
    group.add_argument(
        "--up",
        choices=("y", "z"),
        help="up axis of the model (default: as specified in the file; OBJ: y, other meshes: z)",
    )


def is_framed(world: World, options: argparse.Namespace) -> bool:
    """True if the camera is placed so that the world fits.

    Otherwise, the camera is at its pose from the world file or from a calibration.
    """
    is_placed = any(getattr(options, name, None) is not None for name in ("view_from", "zoom"))
    if getattr(options, "camera", None) is not None:
        return is_placed
    return is_placed or getattr(options, "fov", None) is not None or world._first_camera is None


def find_camera(world: World, options: argparse.Namespace, *, moving: bool = False) -> Camera:
    """Returns the camera of `--camera` and `--size`, placed by `--view-from` and `--zoom`.

    If `moving`, the world fits during its whole motion.
    """
    from ...render.arguments import UNPOSED, is_unposed_within
    from ...world.framing import framing_camera, moments_of

    if is_framed(world, options):
        moments = moments_of(world, parse_animation(world, options.animation)) if moving else []
        return framing_camera(world, **_framing(world, options), moments=moments)
    camera = _select_camera(world, options)
    if options.camera is not None and is_unposed_within(world, camera):
        print_notice(f"{UNPOSED}; use --view-from SIDE to place it so that the world fits")
    return camera


def find_orbit_camera(world: World, options: argparse.Namespace) -> Camera:
    """Returns the camera that frames a turning world.

    The world turns around the upright axis through its centre.
    """
    from ...world.framing import framing_camera

    return framing_camera(world, **_framing(world, options), turning=True)


def reject_options(options: argparse.Namespace, names: tuple[str, ...], reason: str) -> None:
    """Raises `SettingsError` if one of the options is given."""
    for name in names:
        if getattr(options, name, None) not in (None, False):
            raise SettingsError(f"--{name.replace('_', '-')}: {reason}")


def parse_side(text: str) -> Any:
    """Parses a side by name, or X,Y,Z."""
    from ...world.framing import DIRECTIONS

    if text in DIRECTIONS:
        return text
    try:
        x, y, z = (float(number) for number in text.split(","))
    except ValueError:
        message = nearest("side", text, list(DIRECTIONS))
        raise argparse.ArgumentTypeError(f"{message}; or X,Y,Z, as in 1,-2,1") from None
    return (x, y, z)


def _select_camera(world: World, options: argparse.Namespace) -> Camera:
    if options.camera is not None:
        reject_options(options, ("fov",), "cannot be combined with --camera, which has its own field of view")
    return select_camera(world, options)


def _framing(world: World, options: argparse.Namespace) -> dict[str, Any]:
    """The arguments of `World.view_from`."""
    given = {name: getattr(options, name, None) for name in ("fov", "zoom")}
    if getattr(options, "camera", None) is not None:
        given["camera"] = _select_camera(world, options)
    return {
        "size": options.size or DEFAULT_SIZE,
        "direction": getattr(options, "view_from", None) or "default",
        **{name: value for name, value in given.items() if value is not None},
    }
