"""Bundled data to try raycam with: it is part of the package and needs no download.

world = raycam.data.spot()
raycam.render(world).save("spot.png")
"""

from __future__ import annotations

import os
from importlib import resources
from pathlib import Path

from ..calibration import load_cameras
from ..camera import Camera
from ..errors import SettingsError, nearest
from ..world import World
from ..world.load import load

__all__ = ["NAMES", "camera", "fisheye", "path", "sky", "spot"]

NAMES = (
    "spot.toml",
    "spot.glb",
    "spot/cow.obj",
    "spot/cow.mtl",
    "spot/cow_texture.png",
    "camera.yaml",
    "fisheye.yaml",
    "sky.hdr",
    "CREDITS.md",
)
"""The files, by their names in the data folder. CREDITS.md lists their authors and licences."""


def spot() -> World:
    """Returns the documentation's world: the cow Spot and solids on a floor.

    Spot is by Keenan Crane (CC0). The world is z up and has a camera.

    Each call returns a new world, which may be changed.
    """
    return load(path("spot.toml"))


def camera() -> Camera:
    """Returns the camera of `camera.yaml`.

    The camera has 640 x 480 pixels and the lens model "opencv", and is pointed at Spot.
    """
    return next(iter(load_cameras(path("camera.yaml")).values()))


def fisheye() -> Camera:
    """Returns the camera of `fisheye.yaml`.

    The camera has 640 x 480 pixels and the lens model "fisheye", and is pointed at Spot.
    """
    return next(iter(load_cameras(path("fisheye.yaml")).values()))


def sky() -> Path:
    """Returns the path of `sky.hdr`, an image for environment lights.

    The image has 256 x 128 pixels and shows a clear afternoon over level ground.
    """
    return path("sky.hdr")


def path(name: str = "spot/cow.obj") -> Path:
    """Returns the path of a bundled file, one of `NAMES`.

    Raises `SettingsError` with the most similar name for other names.
    """
    if name not in NAMES:
        raise SettingsError(nearest("file of raycam.data", name, list(NAMES)), code="unknown_name")
    return Path(str(resources.files("raycam") / "assets")) / name


def bundled(name: str | os.PathLike[str]) -> Path | None:
    """Returns the bundled file for a name such as "spot.toml".

    Returns None if no bundled file has this name, or if a file exists at the path `name`.
    """
    given = os.fspath(name)
    if os.path.exists(given) or given not in NAMES:
        return None
    return path(given)
