"""Bundled data, to try things out on: it comes with the package and needs no download.

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
"""The files, by their names from the folder of the data. CREDITS.md has their authors and licences."""


def spot() -> World:
    """The world of the documentation: Spot, a cow by Keenan Crane (CC0), among solids on a floor, z up, with a camera.

    A new world at each call, to be changed at will.
    """
    return load(path("spot.toml"))


def camera() -> Camera:
    """A camera of 640 x 480 pixels with a lens of OpenCV's model that looks at Spot: the calibration `camera.yaml`."""
    return next(iter(load_cameras(path("camera.yaml")).values()))


def fisheye() -> Camera:
    """A fisheye camera of 640 x 480 pixels that looks at Spot: the calibration `fisheye.yaml`."""
    return next(iter(load_cameras(path("fisheye.yaml")).values()))


def sky() -> Path:
    """The path of `sky.hdr`, 256 x 128 pixels: a clear afternoon over level ground, for lights of type environment."""
    return path("sky.hdr")


def path(name: str = "spot/cow.obj") -> Path:
    """The path of a bundled file, one of `NAMES`; raises `SettingsError` with the nearest name for another."""
    if name not in NAMES:
        raise SettingsError(nearest("file of raycam.data", name, list(NAMES)), code="unknown_name")
    return Path(str(resources.files("raycam") / "assets")) / name


def bundled(name: str | os.PathLike[str]) -> Path | None:
    """The bundled file that a name means where no such file is: "spot.toml" or "spot/cow.obj"; None for others."""
    given = os.fspath(name)
    if os.path.exists(given) or given not in NAMES:
        return None
    return path(given)
