"""Loading of worlds from files."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from .. import _core, usd
from ..errors import SettingsError
from ..io import memory_limits
from ..io.folders import check_folder
from ..notices import collected, warn_all
from .missing_files import MODELS, check_exists, recipe_named
from .usd_files import explain_usd, load_usd
from .world import World

if TYPE_CHECKING:
    from _typeshed import SupportsRead

__all__ = ["load"]

MESH_SUFFIXES = (".obj", ".ply", ".stl", ".off")
"""The endings of mesh files, whose unit is unknown."""
METRES = {"mm": 0.001, "cm": 0.01, "dm": 0.1, "m": 1.0, "km": 1000.0, "in": 0.0254, "ft": 0.3048}
"""The lengths of units in metres."""
USD_MARKS = ((b"PXR-USDC", ".usdc"), (b"#usda", ".usda"))
"""The first bytes of USD files and their endings."""


def load(
    source: str | os.PathLike[str] | bytes | SupportsRead[bytes],
    *,
    kind: str | None = None,
    scale: float | None = None,
    units: Literal["mm", "cm", "dm", "m", "km", "in", "ft"] | None = None,
    variant: str | None = None,
    texture_memory: int | str | None = None,
    folder: str | os.PathLike[str] | None = None,
    time: float | None = None,
    up: Literal["z", "y"] | None = None,
) -> World:
    """Loads a world file (.toml), glTF (.gltf .glb .vrm), a mesh (.obj .ply .stl .off) or USD.

    `source` is a path, the bytes of a file, or a binary file object such as `io.BytesIO` or an open download, which is read
    to its end. The content determines the file type, whatever the name. `kind` is the extension, such as "glb", of bytes
    whose content does not determine it. Bytes open no other files: textures must be in the file.

    `scale` multiplies the coordinates of a mesh file, whose unit is unknown; `units` is the same as the unit's length in
    metres, such as 0.001 for "mm". Other formats are in metres, or state their unit.

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

    Raises `SettingsError` for a `source` outside `folder`, an unknown `kind`, and a `scale` of a file that is no mesh, `FileNotFoundError` and other `OSError`s, `FormatError` for a
    malformed file, and `WorldError` or `CameraError` for an invalid description, each with file, line and key.
    """
    factor = _factor(scale, units)
    if not isinstance(source, str | os.PathLike):
        return _loaded_bytes(
            source,
            kind,
            scale=scale,
            units=units,
            variant=variant,
            texture_memory=texture_memory,
            time=time,
            up=up,
        )
    path = source
    if kind is not None:
        raise SettingsError(
            f"kind={kind!r} is for bytes and file objects; the content of {os.fspath(path)} determines it"
        )
    check_exists(path)
    if factor is not None and _suffix(path) not in MESH_SUFFIXES:
        raise SettingsError(
            f"{os.fspath(path)}: scale= and units= are for mesh files ({', '.join(MESH_SUFFIXES)}); other formats state "
            "their unit; add the file to a world instead: world.add_object(mesh=..., scale=...)"
        )
    if Path(path).suffix.lower() in usd.SUFFIXES:
        core, variants = load_usd(path, texture_memory, folder, time, variant)
        world, variant = World._of(core, variants), None
    elif time is not None:
        raise SettingsError(f"{os.fspath(path)}: time= is for USD files; other files move by world.at(time)")
    else:
        if folder is not None:
            check_folder(path, folder)
        limit = memory_limits.parse_size("texture_memory", texture_memory)
        with explain_usd(), recipe_named(path):
            world = World._of(_core.World.load(os.fspath(path), folder, limit))
    return _finished(world, path, factor, up, variant)


def _factor(scale: float | None, units: str | None) -> float | None:
    """The factor of all coordinates; None for 1."""
    if scale is not None and units is not None:
        raise SettingsError(f"scale={scale!r} and units={units!r} exclude each other; expected one of them")
    if units is not None:
        if units not in METRES:
            raise SettingsError(f"units is {units!r}; options: {', '.join(METRES)}")
        return METRES[units]
    if scale is None:
        return None
    if isinstance(scale, bool) or not isinstance(scale, int | float) or not 0.0 < scale < float("inf"):
        raise SettingsError(f"scale must be a finite number greater than 0, got {scale!r}")
    return float(scale)


def _suffix(path: str | os.PathLike[str]) -> str:
    """The extension in small letters; that of the content for a name without a known one."""
    suffix = Path(path).suffix.lower()
    if suffix in MODELS:
        return suffix
    with open(path, "rb") as file:
        return ".glb" if file.read(4) == b"glTF" else ".stl"


def _loaded_bytes(source: bytes | SupportsRead[bytes], kind: str | None, **options: Any) -> World:
    """The world in bytes, or in a file object's bytes."""
    if kind is not None and (not isinstance(kind, str) or f".{kind.lower().lstrip('.')}" not in MODELS):
        raise SettingsError(f"kind is {kind!r}; options: {', '.join(each[1:] for each in MODELS)}")
    data = source.read() if hasattr(source, "read") else source
    if not isinstance(data, bytes | bytearray | memoryview):
        raise SettingsError(
            "source must be the path of a world or model, bytes or a binary file object, "
            f"not {type(data if hasattr(source, 'read') else source).__name__}"
        )
    data = bytes(data)
    usd_kind = next((each for mark, each in USD_MARKS if data.startswith(mark)), None)
    suffix = f".{kind.lower().lstrip('.')}" if kind is not None else usd_kind or ""
    if suffix in usd.SUFFIXES:
        with tempfile.TemporaryDirectory(prefix="raycam-") as folder:
            path = Path(folder, f"bytes{suffix}")
            path.write_bytes(data)
            return load(path, **options)
    if options["time"] is not None:
        raise SettingsError("time= is for USD files; other files move by world.at(time)")
    factor = _factor(options["scale"], options["units"])
    is_scene = data.startswith(b"glTF") or suffix in (".glb", ".gltf", ".toml") or data.lstrip()[:1] == b"{"
    if factor is not None and is_scene:
        raise SettingsError(f"scale= and units= are for mesh files ({', '.join(MESH_SUFFIXES)})")
    limit = memory_limits.parse_size("texture_memory", options["texture_memory"])
    world = World._of(_core.World.load_bytes(data, f"bytes{suffix}", limit))
    return _finished(world, f"bytes{suffix}", factor, options["up"], options["variant"])


def _finished(
    world: World, path: str | os.PathLike[str], factor: float | None, up: str | None, variant: str | None
) -> World:
    """The world with its scale, up axis and variant; warns its notices."""
    if factor is not None:
        world._core.scale_objects(factor)
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
        raise SettingsError(f"up is {up!r}; expected 'z' or 'y'")
    if Path(path).suffix.lower() == ".toml":
        raise SettingsError(
            f'{os.fspath(path)}: a world file says its up axis itself: up = "{up}" at its top'
        )
    head, old, rest = world.to_bytes().partition(b"\xa2up\xa1")
    return World._of(_core.world_from_bytes(head + old + up.encode() + rest[1:], world.texture_memory, ""))
