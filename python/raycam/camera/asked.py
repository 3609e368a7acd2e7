"""Worlds and cameras as people name them: objects, paths and names."""

from __future__ import annotations

import errno
import os
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from ..errors import Notice, SettingsError, WorldError
from ..notices import warn

if TYPE_CHECKING:
    from ..world import World
    from . import Camera

__all__ = ["OPENERS", "UNPOSED", "camera_of", "is_unposed_within", "world_of"]

OPENERS: dict[str, Callable[..., Any]] = {}
"""The functions `load` and `load_cameras`, which stand above this module: the package puts them here."""


SIDES = ("front", "back", "left", "right", "top", "bottom", "iso")
"""Words of `World.view_from` that people give as a camera."""

CALIBRATION_ENDINGS = (".yaml", ".yml", ".json", ".xml", ".txt", ".npz", ".csv", ".ini", ".toml", ".bin")

UNPOSED = "the camera is at the origin, amid the world, as a calibration without a pose leaves it"
"""The notice of a camera for which `is_unposed_within`."""


def is_unposed_within(world: World, camera: Camera) -> bool:
    """True if the camera is at the origin, unrotated, and the origin is within the bounds of the world."""
    bounds = world.bounds
    if bounds is None or camera.is_parallel or camera.C.any() or (camera.R != IDENTITY).any():
        return False
    return bool(((bounds[0] <= 0) & (bounds[1] >= 0)).all())


IDENTITY = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]


def world_of(world: Any) -> World:
    """The world itself, or the one in the file of this path; raises `SettingsError` for anything else."""
    if hasattr(world, "_core") and hasattr(world, "default_camera"):
        found: World = world
        return found
    if isinstance(world, str | os.PathLike):
        loaded: World = OPENERS["load"](world)
        return loaded
    if hasattr(world, "world") and hasattr(world, "seed"):
        raise SettingsError(
            "this is a recipe, which makes many worlds: give one of them, recipe.world(0), or all of them to"
            " raycam.dataset.write"
        )
    raise SettingsError(
        f"world must be a raycam.World or the path of a world file, not {type(world).__name__}"
    )


def camera_of(world: World, camera: Any) -> Camera:
    """The camera itself, the world's camera of this name, or the first one of a calibration file.

    None is the world's first camera, or one that frames the whole world. Raises `SettingsError` for anything else,
    `WorldError` with the nearest known name, and the errors of `load_cameras`.
    """
    if camera is None:
        return world.default_camera()
    if hasattr(camera, "_core") and hasattr(camera, "project"):
        found: Camera = camera
        return found
    name = camera if isinstance(camera, str) else None
    if name in world.cameras:
        return world.camera(name)
    if isinstance(camera, os.PathLike) or (name is not None and os.path.exists(name)):
        first: Camera = next(iter(OPENERS["load_cameras"](camera).values()))
        if is_unposed_within(world, first):
            hint = "camera.at_pose(R, C) or world.view_from('front', camera=camera) puts it elsewhere"
            warn(Notice(f"{UNPOSED}; {hint}", "unposed_camera"))
        return first
    if name is not None:
        _refuse_other_words(name)
        return world.camera(name)
    if hasattr(camera, "values"):
        raise SettingsError(
            f"camera is a {type(camera).__name__} of {len(camera)} cameras: choose one of {', '.join(camera)}, as in"
            f" cameras[{next(iter(camera), '')!r}]"
        )
    raise SettingsError(
        "camera must be a raycam.Camera, the name of a camera of the world or the path of a calibration,"
        f" not {type(camera).__name__}"
    )


def only_camera(camera: Any, hint: str = "") -> Camera:
    """The camera itself; raises `SettingsError` for anything else, where no world can name one."""
    if hasattr(camera, "_core") and hasattr(camera, "project"):
        found: Camera = camera
        return found
    raise SettingsError(f"camera must be a raycam.Camera, not {type(camera).__name__}{hint}")


def _refuse_other_words(name: str) -> None:
    """Raises `WorldError` for the word of a side, and `FileNotFoundError` for the name of a file of cameras."""
    if name in SIDES:
        raise WorldError(
            f"the world has no camera {name!r}; world.view_from({name!r}) is one that sees all of it from there"
        )
    if os.path.splitext(name)[1].lower() in CALIBRATION_ENDINGS:
        raise FileNotFoundError(errno.ENOENT, "No such file, and the world has no camera of this name", name)
