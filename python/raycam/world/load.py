"""Loading of worlds from files."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Literal

from .. import _core, usd
from ..errors import SettingsError
from ..io import memory_limits
from ..io.folders import check_folder
from ..notices import collected, warn_all
from .missing_files import check_exists, recipe_named
from .usd_files import load_usd
from .world import World

__all__ = ["load"]


def load(
    path: str | os.PathLike[str],
    *,
    variant: str | None = None,
    texture_memory: int | str | None = None,
    folder: str | os.PathLike[str] | None = None,
    time: float | None = None,
    up: Literal["z", "y"] | None = None,
) -> World:
    """Loads a world file (.toml), glTF (.gltf .glb), a mesh (.obj .ply .stl .off) or USD.

    USD (.usd .usda .usdc .usdz) needs the `raycam[usd]` extra; it is read in a separate process.

    Vertices are used exactly as given, never rotated or scaled. The parts of a mesh file become objects.
    `World.notices` lists parts that were skipped or repaired, and each is warned as a `raycam.Notice`.
    `variant` is the name of a material variant of a glTF file. For USD it is "NAME", "SET=NAME" or "/PRIM{SET=NAME}",
    several separated by commas: all prims with that variant change. `World.variants` lists them.

    `texture_memory` bounds the memory of the images of materials, in bytes or as "512 MiB" (see `World`). Without it,
    images may have 2^27 pixels in total; with it, 2^27 each and 2^33 in total.

    `folder` is the folder within which the files that a file names may lie: images, materials, buffers, layers, meshes
    (default: the folder of the file). Symbolic links are followed within it. What lies outside is left out with a
    notice, or is an error where nothing can be shown without it. A `path` that is a link may lead anywhere: the files
    that it names are searched beside the link and beside its target.

    `time` is the time in seconds at which a USD file is read (default: the first time of each value); other files move
    by `World.at`.

    `up` is the up axis of a model whose file does not say it or is wrong: it turns the view, the sky and the ground,
    and no vertex. OBJ, PLY, STL and OFF files are taken as z up without it, though most OBJ files are y up.

    Raises `SettingsError` for a `path` outside `folder`, `FileNotFoundError` and other `OSError`s, `FormatError` for a
    malformed file, and `WorldError` or `CameraError` for an invalid description, each with file, line and key.
    """
    if not isinstance(path, str | os.PathLike):
        raise SettingsError(
            f"path must be the path of a world or model, not {type(path).__name__}", code="wrong_type"
        )
    check_exists(path)
    if Path(path).suffix.lower() in usd.SUFFIXES:
        core, variants = load_usd(path, texture_memory, folder, time, variant)
        world, variant = World._of(core, variants), None
    elif time is not None:
        raise SettingsError(
            f"{os.fspath(path)}: time= is for USD files; other files move by world.at(time)",
            code="conflicting_values",
        )
    else:
        if folder is not None:
            check_folder(path, folder)
        limit = memory_limits.parse_size("texture_memory", texture_memory)
        with recipe_named(path):
            world = World._of(_core.World.load(os.fspath(path), folder, limit))
    if up is not None and up != world.up:
        world = _turned(world, up, path)
    if variant is not None:
        with collected():
            world = world.with_variant(variant)
    warn_all(world.notices)
    return world


def _turned(world: World, up: str, path: str | os.PathLike[str]) -> World:
    """The same world with another up axis; raises `SettingsError` for a world file, which says it itself."""
    if up not in ("z", "y"):
        raise SettingsError(f"up is {up!r}; expected 'z' or 'y'", code="invalid_value")
    if Path(path).suffix.lower() == ".toml":
        raise SettingsError(
            f'{os.fspath(path)}: a world file says its up axis itself: up = "{up}" at its top',
            code="conflicting_values",
        )
    head, old, rest = world.to_bytes().partition(b"\xa2up\xa1")
    return World._of(_core.world_from_bytes(head + old + up.encode() + rest[1:], world.texture_memory, ""))
