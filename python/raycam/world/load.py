"""Loading of worlds from files."""

from __future__ import annotations

import os
import re
import tempfile
from pathlib import Path

from .. import _core, usd
from ..errors import FormatError
from ..io import memory_limits
from . import World

__all__ = ["load"]


def load(
    path: str | os.PathLike[str],
    *,
    variant: str | None = None,
    texture_memory: int | str | None = None,
) -> World:
    """Loads a world file (.toml), glTF (.gltf .glb), a mesh (.obj .ply .stl .off) or USD.

    USD (.usd .usda .usdc .usdz) needs the `raycam[usd]` extra; it is read in a separate process.

    Vertices are used exactly as given, never rotated or scaled. The parts of a mesh file become objects. Files named in
    a file are read only from the folder of that file. `World.notices` lists parts that were skipped or repaired.
    `variant` is the name of a material variant of a glTF file.

    `texture_memory` bounds the memory of the images of materials, in bytes or as "512 MiB" (see `World`). Without it,
    images may have 2^27 pixels in total; with it, 2^27 each and 2^33 in total.

    Raises `FileNotFoundError` and other `OSError`s, `FormatError` for a malformed file, and `WorldError` or
    `CameraError` for an invalid description, each with file, line and key.
    """
    if Path(path).suffix.lower() in usd.SUFFIXES:
        world = _load_usd(path, texture_memory)
    else:
        world = World._of(
            _core.World.load(os.fspath(path), memory_limits.parse_size("texture_memory", texture_memory))
        )
    return world if variant is None else world.with_variant(variant)


def _load_usd(path: str | os.PathLike[str], texture_memory: int | str | None) -> World:
    """Loads a USD file."""
    with tempfile.TemporaryDirectory(prefix="raycam-usd-") as folder:
        description = usd.read(path, Path(folder))
        said, files = description.pop("notices"), description.pop("files")
        try:
            world = World.from_dict(description, folder=folder, texture_memory=texture_memory)
        except FormatError as error:
            raise FormatError(_of_usd(str(error), path, folder, files)) from None
        notices = [_of_usd(notice, path, folder, files) for notice in world.notices]
        world._core.set_notices([*notices, *(f"{os.fspath(path)}: {notice}" for notice in said)])
    return world


def _of_usd(text: str, path: str | os.PathLike[str], folder: str, files: dict[str, str]) -> str:
    """Replaces the names of temporary files in a message by those of the USD file and its images."""
    shown, made = os.fspath(path), re.compile(re.escape(folder + os.sep) + r"([^/\\:]+)(:\d+)?")
    text = made.sub(lambda found: files.get(found[1], shown), text)
    return text if text.startswith(shown) else f"{shown}: {text}"
