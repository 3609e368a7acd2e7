"""Loading of worlds from files."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Literal

from .. import _core, usd
from ..errors import Error, SettingsError, WorldError
from ..io import memory_limits
from ..io.folders import check_folder
from ..notices import collected, warn_all
from ..robots import find_root
from .missing_files import check_exists, recipe_named
from .robot_files import is_robot
from .robot_tables import robot_lines
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
    packages: Iterable[str | os.PathLike[str]] = (),
    xacro_args: Mapping[str, str] | None = None,
) -> World:
    """Loads a world file (.toml), glTF (.gltf .glb), a mesh (.obj .ply .stl .off), USD or a robot (.urdf .xacro).

    USD (.usd .usda .usdc .usdz) requires the `raycam[usd]` extra; it is read in a separate process.

    Vertices are used exactly as given, never rotated or scaled. The parts of a mesh file become objects.
    `World.notices` lists parts that were skipped or repaired, and each is warned as a `raycam.Notice`. `variant` is
    the name of a material variant of a glTF file. For USD it is "NAME", "SET=NAME" or "/PRIM{SET=NAME}", several
    separated by commas; "NAME" applies to all prims with that variant. `World.variants` lists the names.

    `texture_memory` limits the memory of material images, in bytes or as "512 MiB" (see `World`). Without it, images
    may have 2^27 pixels in total; with it, 2^27 each and 2^33 in total.

    `folder` restricts which files are read: images, materials, buffers, layers and meshes must be in it (default: the
    file's folder). Symbolic links are followed within it. A part whose file is outside is omitted with a notice; an
    essential part raises an error. `path` itself may be a link to anywhere; files that it refers to are then searched
    next to the link and next to its target.

    `time` is the time in seconds at which a USD file is read (default: the first time of each value); for other
    formats, use `World.at`.

    `up` is the model's up axis, if the file does not specify it or is wrong. It rotates the view, the sky and the
    ground, not the vertices. By default, OBJ, PLY, STL and OFF files are z up, although most OBJ files are y up.

    A robot (.urdf) is placed at the origin with its joints at zero, or at the limit nearest to zero;
    `World.add_robot` has more arguments. `packages` are folders in which `package://NAME` of robots is searched,
    `xacro_args` are the arguments of a xacro file.

    Raises `SettingsError` for a `path` outside `folder`, `FileNotFoundError` and other `OSError`s, `FormatError` for a
    malformed file, and `WorldError` or `CameraError` for an invalid description, each with file, line and key.
    """
    if not isinstance(path, str | os.PathLike):
        raise SettingsError(
            f"path must be the path of a world or model, not {type(path).__name__}", code="wrong_type"
        )
    check_exists(path)
    if xacro_args and Path(path).suffix.lower() != ".xacro":
        raise SettingsError(f"{os.fspath(path)}: xacro_args are for .xacro files", code="conflicting_values")
    if Path(path).suffix.lower() in usd.SUFFIXES:
        core, variants = load_usd(path, texture_memory, folder, time, variant)
        world, variant = World._of(core, variants), None
    elif is_robot(path):
        return _load_robot(path, variant, texture_memory, folder, time, up, packages, xacro_args)
    elif time is not None:
        raise SettingsError(
            f"{os.fspath(path)}: time= is for USD files; other files move by world.at(time)",
            code="conflicting_values",
        )
    else:
        if folder is not None:
            check_folder(path, folder)
        with recipe_named(path):
            found = _with_robots(path, folder, texture_memory)
            limit = memory_limits.parse_size("texture_memory", texture_memory)
            world = found or World._of(_core.World.load(os.fspath(path), folder, limit))
    if up is not None and up != world.up:
        world = _turned(world, up, path)
    if variant is not None:
        with collected():
            world = world.with_variant(variant)
    warn_all(world.notices)
    return world


def _with_robots(
    path: str | os.PathLike[str], folder: str | os.PathLike[str] | None, texture_memory: int | str | None
) -> World | None:
    """The world of a world file with `[[robot]]`; None for any other file.

    Raises the errors of `World.from_dict` with the file's path, and `SettingsError` for a wider `folder`.
    """
    if Path(path).suffix.lower() != ".toml":
        return None
    text = Path(path).read_bytes().decode("utf-8", "replace")
    lines = robot_lines(text)
    if not lines:
        return None
    import tomllib  # imported here: `import raycam` does not wait for it

    home = Path(path).parent
    if folder is not None and os.path.realpath(folder) != os.path.realpath(home):
        raise SettingsError(f"{os.fspath(path)}: folder= is not supported for world files with robots")
    try:
        description = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise WorldError(f"{os.fspath(path)}: {error}") from None
    try:
        with collected():
            return World._described(description, home, texture_memory, lines)
    except Error as error:
        raise type(error)(f"{os.fspath(path)}: {error}", code=error.code) from None


def _load_robot(
    path: str | os.PathLike[str],
    variant: str | None,
    texture_memory: int | str | None,
    folder: str | os.PathLike[str] | None,
    time: float | None,
    up: Literal["z", "y"] | None,
    packages: Iterable[str | os.PathLike[str]],
    xacro_args: Mapping[str, str] | None,
) -> World:
    """The world of a robot file; raises `SettingsError` for arguments that robots do not support."""
    for name, value in (("variant", variant), ("time", time)):
        if value is not None:
            raise SettingsError(f"{os.fspath(path)}: {name}= is not supported for robots")
    if up == "y":
        raise SettingsError(
            f"{os.fspath(path)}: robots are z up; add one to a y-up world with World('y').add_robot"
        )
    if folder is not None:
        check_folder(path, folder)
    world = World(
        folder=find_root(Path(os.path.abspath(path)).parent) if folder is None else folder,
        texture_memory=texture_memory,
    )
    world.add_robot(path, folder=folder, packages=packages, xacro_args=xacro_args)
    return world


def _turned(world: World, up: str, path: str | os.PathLike[str]) -> World:
    """The same world with another up axis; raises `SettingsError` for a world file, which says it itself."""
    if up not in ("z", "y"):
        raise SettingsError(f"up is {up!r}; expected 'z' or 'y'", code="invalid_value")
    if Path(path).suffix.lower() == ".toml":
        raise SettingsError(
            f'{os.fspath(path)}: a world file specifies its up axis; write up = "{up}" at its top',
            code="conflicting_values",
        )
    head, old, rest = world.to_bytes().partition(b"\xa2up\xa1")
    return World._of(_core.world_from_bytes(head + old + up.encode() + rest[1:], world.texture_memory, ""))
