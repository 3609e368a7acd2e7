"""Conversion of arguments to worlds and cameras: objects, paths of files, and names."""

from __future__ import annotations

import errno
import os
from collections.abc import Mapping
from typing import Any

from ..calibration import load_cameras
from ..camera import Camera
from ..errors import Notice, SettingsError, WorldError, with_code
from ..notices import warn
from ..world import World
from ..world.load import load

__all__ = ["SIDES", "UNPOSED", "camera_of", "is_unposed_within", "world_of"]

SIDES = ("front", "back", "left", "right", "top", "bottom", "iso")
"""Names of directions for `World.view_from`, which users may pass as a camera by mistake."""

CALIBRATION_EXTENSIONS = (".yaml", ".yml", ".json", ".xml", ".txt", ".npz", ".csv", ".ini", ".toml", ".bin")

UNPOSED = "the camera is at the origin, inside the world's bounds, as in a calibration without a pose"
"""The notice for a camera for which `is_unposed_within` returns True."""

IDENTITY = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]

REMEDIES = {
    "Recipe": "; recipe.world(0) returns one of its worlds, and raycam.dataset.write accepts all of them",
}
"""Remedies for arguments of other types, by the type's name."""


def is_unposed_within(world: World, camera: Camera) -> bool:
    """True if the camera is unrotated at the origin, and the origin is in the world's bounds."""
    bounds = world.bounds
    if bounds is None or camera.is_parallel or camera.C.any() or (camera.R != IDENTITY).any():
        return False
    return bool(((bounds[0] <= 0) & (bounds[1] >= 0)).all())


def world_of(world: Any) -> World:
    """Returns a given world, or loads a world from a path.

    Raises `SettingsError` for other objects.
    """
    if isinstance(world, World):
        return world
    if isinstance(world, str | os.PathLike):
        return load(world)
    given = type(world).__name__
    raise SettingsError(
        f"world must be a raycam.World or the path of a world file, not {given}{REMEDIES.get(given, '')}",
        code="wrong_type",
    )


def camera_of(world: World, camera: Any) -> Camera:
    """Returns a camera: as given, by its name in the world, or from a calibration file.

    The first camera of a calibration file is used. None selects `World.default_camera`: the first camera, or a camera
    that frames the whole world. Raises `SettingsError` for anything else, `WorldError` with the nearest known name, and
    the errors of `load_cameras`.
    """
    if camera is None:
        return world.default_camera()
    if isinstance(camera, Camera):
        return camera
    name = camera if isinstance(camera, str) else None
    if name in world.cameras:
        return world.camera(name)
    if isinstance(camera, os.PathLike) or (name is not None and os.path.exists(name)):
        first = next(iter(load_cameras(camera).values()))
        if is_unposed_within(world, first):
            hint = "to move it: camera.at_pose(R, C), or world.view_from('front', camera=camera)"
            warn(Notice(f"{UNPOSED}; {hint}", "unposed_camera"))
        return first
    if name is not None:
        _refuse_sides_and_files(name)
        return world.camera(name)
    if isinstance(camera, Mapping):
        names = list(camera)
        raise SettingsError(
            f"camera must be a single camera, not a {type(camera).__name__} of {len(names)} cameras; choose one, as in"
            f" cameras[{next(iter(names), '')!r}]: {', '.join(map(str, names))}",
            code="wrong_type",
        )
    raise SettingsError(
        "camera must be a raycam.Camera, the name of a camera in the world, or the path of a calibration,"
        f" not {type(camera).__name__}",
        code="wrong_type",
    )


def _refuse_sides_and_files(name: str) -> None:
    """Raises an error for the name of a side or of a missing calibration file.

    Raises `WorldError` for the name of a side, and `FileNotFoundError` for the name of a calibration file.
    """
    if name in SIDES:
        raise WorldError(
            f"the world has no camera {name!r}; world.view_from({name!r}) returns a camera that shows the world",
            code="unknown_name",
        )
    if os.path.splitext(name)[1].lower() in CALIBRATION_EXTENSIONS:
        raise with_code(
            FileNotFoundError(
                errno.ENOENT, "file not found, and the world has no camera with this name", name
            )
        )
