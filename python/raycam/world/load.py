"""Loading of worlds from files."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

from .. import _core, usd
from ..errors import Error, SettingsError, WorldError
from ..io import memory_limits
from ..io.folders import check_folder
from ..io.text_files import decode_text
from ..notices import collected, warn_all
from ..robots import CompiledModel, FileResolver, find_root, read_robots
from .missing_files import check_exists, recipe_named
from .robot_files import is_robot
from .robot_tables import robot_lines
from .sources import (
    HEAD_BYTES,
    assumed_up_axis,
    check_scalable,
    has_up_axis,
    kind_suffix,
    path_suffix,
    read_bytes,
    scale_factor,
)
from .usd_files import load_usd
from .world import World

if TYPE_CHECKING:
    from _typeshed import SupportsRead

__all__ = ["load", "load_with_assumed_axis", "with_up_axis"]


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
    packages: Iterable[str | os.PathLike[str]] = (),
    xacro_args: Mapping[str, str] | None = None,
    geometry: Literal["visual", "collision", "both"] | None = None,
) -> World:
    """Loads a world from a world file, glTF, a mesh, USD or a robot.

    The extensions are .gltf, .glb and .vrm for glTF, .obj, .ply, .stl and .off for meshes, and .urdf, .sdf and .xml for
    robots.

    `source` is a path, the bytes of a file, or a binary file object such as `io.BytesIO` or a download, which is read
    to its end. The content determines the file type of bytes and of files without a known extension; if it is
    ambiguous, `kind`, an extension such as "glb", determines it. Bytes open no other files: textures must be in the
    file.

    Mesh files do not specify their unit: `scale` multiplies their coordinates, or `units` names the unit, for example
    "mm", which multiplies them by 0.001.

    USD (.usd .usda .usdc .usdz) requires the `raycam[usd]` extra; it is read in a separate process.

    Vertices are used exactly as given, never rotated or scaled. The parts of a mesh file become objects.
    `World.notices` lists parts that were skipped or repaired; each is also issued as a warning, a `raycam.Notice`.
    `variant` is the name of a material variant of a glTF file. For USD it is "NAME", "SET=NAME" or "/PRIM{SET=NAME}",
    several separated by commas; "NAME" applies to all prims with that variant. `World.variants` lists the names.

    `texture_memory` limits the memory of material images, in bytes or as "512 MiB" (see `World`). Without it, images
    may have 2^27 pixels in total; with it, 2^27 each and 2^33 in total.

    `folder` restricts which files are read: images, materials, buffers, layers and meshes must be in it (default: the
    file's folder). Symbolic links are followed within it. A part whose file is outside is omitted with a notice; if the
    part is essential, an error is raised. The path `source` itself may be a link to anywhere; files that it refers to
    are then searched next to the link and next to its target.

    `time` is the time in seconds at which a USD file is read (default: the first time of each value); for other
    formats, use `World.at`.

    `up` is the model's up axis, for files that do not specify it or specify a wrong one. It rotates the view, the sky
    and the ground, not the vertices. By default, OBJ, PLY, STL and OFF files are z up, although most OBJ files are y
    up.

    A robot (.urdf) is placed at the origin with its joints at zero, or at the limit nearest to zero;
    `World.add_robot` has more arguments. An .xml file is MJCF, URDF or SDF, as its root element states; MJCF requires
    the `raycam[mujoco]` extra, and its lights are loaded, too. `packages` are folders in which `package://NAME` of
    robots is searched, `xacro_args` are the arguments of a xacro file, and `geometry` selects the robot's shapes
    (default: "visual").

    Raises `SettingsError` for a `source` outside `folder`, an unknown `kind`, a `variant` that is not a string and a
    `scale` of files other than meshes, `FileNotFoundError` and other `OSError`s, `FormatError` for a malformed file,
    and `WorldError` or `CameraError` for an invalid description, each with file, line and key.
    """
    if not isinstance(variant, str | None):
        raise SettingsError(
            f"variant must be a string, got {type(variant).__name__}; pass a variant's name, or 'SET=NAME' for USD",
            code="wrong_type",
        )
    options = _Options(variant, texture_memory, time, up, scale_factor(scale, units), xacro_args, geometry)
    if not isinstance(source, str | os.PathLike):
        data = read_bytes(source)
        return _load_bytes(data, kind_suffix(kind, data), options)
    if kind is not None:
        raise SettingsError(
            f"kind={kind!r} requires bytes or a file object; {os.fspath(source)} is a path",
            code="conflicting_values",
        )
    return _load_path(source, folder, packages, options)


def load_with_assumed_axis(
    path: str | os.PathLike[str], *, up: Literal["z", "y"] | None = None, **options: Any
) -> World:
    """Loads a file like `load`, but assumes y up for OBJ files if `up` is None."""
    assumed = None if up else assumed_up_axis(path)
    world = load(path, up=up or assumed, **options)
    if assumed is not None:
        world._is_up_assumed = True  # `load` takes this axis for the caller's choice
    return world


class _Options(NamedTuple):
    """Arguments of `load` that apply to paths and bytes."""

    variant: str | None
    texture_memory: int | str | None
    time: float | None
    up: Literal["z", "y"] | None
    scale: float | None
    """Factor of a mesh file's coordinates."""
    xacro_args: Mapping[str, str] | None
    geometry: str | None
    """Shapes that a robot shows."""


def _load_path(
    path: str | os.PathLike[str],
    folder: str | os.PathLike[str] | None,
    packages: Iterable[str | os.PathLike[str]],
    options: _Options,
) -> World:
    """The world of a file."""
    check_exists(path)
    suffix = path_suffix(path)
    if options.xacro_args and suffix != ".xacro":
        raise SettingsError(
            f"{os.fspath(path)}: xacro_args requires an .xacro file", code="conflicting_values"
        )
    _check_geometry(os.fspath(path), options)
    if options.scale is not None:
        with open(path, "rb") as file:
            check_scalable(os.fspath(path), suffix, file.read(HEAD_BYTES))
    if suffix in usd.SUFFIXES:
        if Path(path).suffix.lower() != suffix:
            return _load_bytes(Path(path).read_bytes(), suffix, options)
        core, variants = load_usd(path, options.texture_memory, folder, options.time, options.variant)
        return _finished(World._of(core, variants), path, options._replace(variant=None))
    if is_robot(path):
        return _load_robot(path, folder, packages, options)
    _check_time(path, options.time)
    if folder is not None:
        check_folder(path, folder)
    with recipe_named(path):
        found = _with_robots(path, folder, options.texture_memory)
        limit = memory_limits.parse_size("texture_memory", options.texture_memory)
        world = found or World._of(_core.World.load(os.fspath(path), folder, limit))
    return _finished(world, path, options)


def _load_bytes(data: bytes, suffix: str, options: _Options) -> World:
    """The world in the bytes of a file with this ending."""
    name = f"bytes{suffix}"
    if options.scale is not None:
        check_scalable(name, suffix, data[:HEAD_BYTES])
    if suffix in usd.SUFFIXES or is_robot(name):
        from tempfile import TemporaryDirectory  # imported here, so that `import raycam` is fast

        # The readers of these formats require a file.
        with TemporaryDirectory(prefix="raycam-") as folder:
            path = Path(folder, name)
            path.write_bytes(data)
            return _load_path(path, None, (), options)
    _check_time(name, options.time)
    _check_geometry(name, options)
    limit = memory_limits.parse_size("texture_memory", options.texture_memory)
    return _finished(World._of(_core.World.load_bytes(data, name, limit)), name, options)


def _check_geometry(name: str, options: _Options) -> None:
    if options.geometry is not None and not is_robot(name):
        raise SettingsError(
            f"{name}: geometry= (--geometry) requires a robot file, such as .urdf; in a world, pass geometry= to "
            "World.add_robot",
            code="conflicting_values",
        )


def _check_time(path: str | os.PathLike[str], time: float | None) -> None:
    if time is not None:
        raise SettingsError(
            f"{os.fspath(path)}: time= requires a USD file; for other files, use world.at(time)",
            code="conflicting_values",
        )


def _finished(world: World, path: str | os.PathLike[str], options: _Options) -> World:
    """The world with its scale, up axis and variant; warns of its notices."""
    if options.scale is not None:
        world._core.scale_objects(options.scale)
    if options.up is not None and options.up != world.up:
        _check_up(options.up, path)
        world = with_up_axis(world, options.up)
    if options.variant is not None:
        with collected():
            world = world.with_variant(options.variant)
    world._is_up_assumed = options.up is None and not has_up_axis(path)
    warn_all(world.notices)
    world._check_sensors(os.fspath(path))
    return world


def _with_robots(
    path: str | os.PathLike[str], folder: str | os.PathLike[str] | None, texture_memory: int | str | None
) -> World | None:
    """The world of a world file with `[[robot]]`; None for any other file.

    Raises the errors of `World.from_dict` with the file's path, and `SettingsError` for a wider `folder`.
    """
    if Path(path).suffix.lower() != ".toml":
        return None
    text = decode_text(Path(path).read_bytes(), "replace")
    lines = robot_lines(text)
    if not lines:
        return None
    import tomllib  # imported here, so that `import raycam` is fast

    home = Path(path).parent
    if folder is not None and os.path.realpath(folder) != os.path.realpath(home):
        raise SettingsError(
            f"{os.fspath(path)}: folder= is not supported for world files with robots",
            code="unsupported_feature",
        )
    try:
        description = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise WorldError(f"{os.fspath(path)}: {error}", code="syntax") from None
    try:
        with collected() as notices:
            world = World._described(description, home, texture_memory, lines)
    except Error as error:
        raise type(error)(f"{os.fspath(path)}: {error}", code=error.code) from None
    # Notices about joint values, keyframes and calibrations are not among the world's notices.
    warn_all(notice for notice in notices if notice not in world.notices)
    return world


def _load_robot(
    path: str | os.PathLike[str],
    folder: str | os.PathLike[str] | None,
    packages: Iterable[str | os.PathLike[str]],
    options: _Options,
) -> World:
    """Returns the world of a robot file.

    Raises `SettingsError` for arguments that robots do not support.
    """
    for name, value in (("variant", options.variant), ("time", options.time)):
        if value is not None:
            raise SettingsError(
                f"{os.fspath(path)}: {name}= is not supported for robots", code="unsupported_feature"
            )
    if options.up == "y":
        raise SettingsError(
            f"{os.fspath(path)}: up='y' is not supported for robots; add the robot to a y-up world with "
            "World('y').add_robot",
            code="unsupported_feature",
        )
    if folder is not None:
        check_folder(path, folder)
    world = World(
        folder=find_root(Path(os.path.abspath(path)).parent) if folder is None else folder,
        texture_memory=options.texture_memory,
    )
    files = FileResolver(Path(path), folder, packages)
    how = {"placement": {}, "geometry": options.geometry or "visual", "category": "link", "missing": "error"}
    for model in read_robots(path, files, options.xacro_args):
        name = model.description.name
        number = 2
        while name in world.robots:
            name, number = f"{model.description.name}-{number}", number + 1
        world._add_model(model, files, name=name, **how)
        for light in model.lights:
            world.add_light(light.type, **light.keys)
        if model.mujoco is not None:
            _add_mujoco_lights(world, model.mujoco)
    return world


def _add_mujoco_lights(world: World, compiled: CompiledModel) -> None:
    """Adds the lights of an MJCF file, with their notices."""
    from ..interop.mujoco.parts import add_model_lights

    notices = add_model_lights(world, compiled.model)
    world._core.set_notices([*world._core.notices, *notices])
    warn_all(notices)


def _check_up(up: str, path: str | os.PathLike[str]) -> None:
    """Raises `SettingsError` for an unknown axis, and for the path of a world file.

    `up` cannot be used with a world file, because a world file specifies its own axis.
    """
    if up not in ("z", "y"):
        raise SettingsError(f"up is {up!r}; expected 'z' or 'y'", code="invalid_value")
    if Path(path).suffix.lower() == ".toml":
        raise SettingsError(
            f'{os.fspath(path)}: a world file specifies its up axis; write up = "{up}" at its top',
            code="conflicting_values",
        )


def with_up_axis(world: World, up: str) -> World:
    """Returns a copy of the world with another up axis, "z" or "y".

    The copy's vertices are not rotated.
    """
    head, old, rest = world.to_bytes().partition(b"\xa2up\xa1")
    turned = World._of(_core.world_from_bytes(head + old + up.encode() + rest[1:], world.texture_memory, ""))
    turned._folder, turned._stage_variants = world._folder, world._stage_variants
    turned._robots = {name: robot._copy() for name, robot in world._robots.items()}
    return turned
