"""Loading of worlds from files."""

from __future__ import annotations

import os
from pathlib import Path

from .. import _core, usd
from ..errors import SettingsError
from ..io import memory_limits
from ..notices import collected, warn_all
from . import World
from .usd_files import load_usd, usd_named

__all__ = ["load"]


def load(
    path: str | os.PathLike[str],
    *,
    variant: str | None = None,
    texture_memory: int | str | None = None,
    folder: str | os.PathLike[str] | None = None,
    time: float | None = None,
) -> World:
    """Loads a world file (.toml), glTF (.gltf .glb), a mesh (.obj .ply .stl .off) or USD.

    USD (.usd .usda .usdc .usdz) needs the `raycam[usd]` extra; it is read in a separate process.

    Vertices are used exactly as given, never rotated or scaled. The parts of a mesh file become objects. Files named in
    a file are read only from the folder of that file. `World.notices` lists parts that were skipped or repaired, and
    each is warned as a `raycam.Notice`.
    `variant` is the name of a material variant of a glTF file.

    `texture_memory` bounds the memory of the images of materials, in bytes or as "512 MiB" (see `World`). Without it,
    images may have 2^27 pixels in total; with it, 2^27 each and 2^33 in total.

    `folder` is the folder from which the layers and images of a USD file are read (default: the folder of the file).
    What lies outside is left out with a notice. `time` is the time in seconds at which a USD file is read (default: the
    first time of each value); other files move by `World.at`.

    Raises `FileNotFoundError` and other `OSError`s, `FormatError` for a malformed file, and `WorldError` or
    `CameraError` for an invalid description, each with file, line and key.
    """
    if Path(path).suffix.lower() in usd.SUFFIXES:
        world = World._of(load_usd(path, texture_memory, folder, time))
    elif folder is not None or time is not None:
        raise SettingsError(
            f"{os.fspath(path)}: folder= and time= are for USD files; other files name only files beside them, and move"
            " by world.at(time)"
        )
    else:
        limit = memory_limits.parse_size("texture_memory", texture_memory)
        with usd_named():
            world = World._of(_core.World.load(os.fspath(path), limit))
    if variant is not None:
        with collected():
            world = world.with_variant(variant)
    warn_all(world.notices)
    return world
