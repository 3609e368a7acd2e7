"""Bundled data, to try things out on: it comes with the package and needs no download.

world = raycam.data.spot()
raycam.render(world).save("spot.png")
"""

from __future__ import annotations

import os
from importlib import resources
from pathlib import Path

from ..errors import SettingsError, nearest
from ..world import World
from ..world.load import load

__all__ = ["NAMES", "path", "spot"]

NAMES = ("spot.toml", "spot/cow.obj", "spot/cow.mtl", "spot/cow_texture.png", "CREDITS.md")
"""The files, by their names from the folder of the data. CREDITS.md has their authors and licences."""


def spot() -> World:
    """The world of the documentation: Spot, a cow by Keenan Crane (CC0), among solids on a floor, z up, with a camera.

    A new world at each call, to be changed at will.
    """
    return load(path("spot.toml"))


def path(name: str = "spot/cow.obj") -> Path:
    """The path of a bundled file, one of `NAMES`; raises `SettingsError` with the nearest name for another."""
    if name not in NAMES:
        raise SettingsError(nearest("file of raycam.data", name, list(NAMES)))
    return Path(str(resources.files("raycam") / "assets")) / name


def bundled(name: str | os.PathLike[str]) -> Path | None:
    """The bundled file that a name means where no such file is: "spot.toml" or "spot/cow.obj"; None for others."""
    given = os.fspath(name)
    if os.path.exists(given) or given not in NAMES:
        return None
    return path(given)
