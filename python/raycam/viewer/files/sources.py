"""Worlds to view: files, folders, archives (.zip), and several models in one world."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..._core import file_extensions
from ...errors import Notice, SettingsError
from ...io.archive import MAX_DEPTH, unpack
from ...notices import warn
from ...world import World
from ...world.sources import has_up_axis, is_model_file

__all__ = [
    "ARCHIVE",
    "IMAGES",
    "Opening",
    "combine_models",
    "find_world",
    "first_world",
]

ARCHIVE = ".zip"
MAX_ARCHIVE_FILES = 10_000
MAX_ARCHIVE_BYTES = 4 * 2**30
"""Limits of an archive on disk, unpacked."""
MAX_LISTED_FILES = 10_000
"""Maximum number of files in a folder that are searched for worlds."""
Y_UP = (".glb", ".gltf", ".vrm", ".obj")
"""Endings of model files whose up axis is y."""
UPRIGHT = np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])
"""Rotates a model that is y up in a world that is z up."""
LISTED_NAMES = 3
IMAGES = (".png", ".jpg", ".jpeg", ".webp")
"""The extensions of images that replace textures."""


class Opening(NamedTuple):
    """The files that a view shows."""

    paths: tuple[Path, ...]
    """The world, or several models."""
    folder: Path | None
    """The folder that contains all files that the world may read; None for the world file's folder."""
    title: str
    source: Path | None
    """The world's file; None for a world in an archive and for several models."""

    @property
    def is_model(self) -> bool:
        """True unless the world comes from a world file."""
        return all(map(is_model_file, self.paths))

    @classmethod
    def find(cls, given: Sequence[str | os.PathLike[str]], unpacked: Path) -> Opening:
        """Finds the worlds in files, folders and archives.

        Archives are unpacked to the folder `unpacked`. Raises the errors of `find_world`.
        """
        found = [find_world(each, unpacked / str(number)) for number, each in enumerate(given)]
        name = Path(given[0]).resolve().name
        if len(found) > 1:
            paths = tuple(path for path, _ in found)
            return cls(paths, None, f"{name} and {len(found) - 1} more", None)
        ((path, folder),) = found
        is_packed = Path(given[0]).suffix.lower() == ARCHIVE and Path(given[0]).is_file()
        return cls((path,), folder, name, None if is_packed else path)

    def check_watch(self) -> None:
        """Raises `SettingsError` if the files cannot be watched for changes."""
        if self.source is None:
            raise SettingsError(
                "watch requires one world, in a file or a folder; archives and several models cannot be watched",
                code="conflicting_values",
            )

    def load(self, load: Callable[[Path, Path | None], World]) -> World:
        """Loads the world by `load(path, folder)`, or combines the models."""
        if len(self.paths) > 1:
            return combine_models(self.paths)
        return load(self.paths[0], self.folder)


def world_suffixes() -> tuple[str, ...]:
    """The endings of worlds and models, with the dot; the first ending is preferred."""
    return tuple(f".{each}" for each in file_extensions()[0])


def known_suffixes() -> tuple[str, ...]:
    """The endings of worlds, models and the files that they use."""
    worlds, companions = file_extensions()
    return tuple(f".{each}" for each in (*worlds, *companions))


def first_world(names: Iterable[str]) -> str | None:
    """Returns the preferred world or model among file names, or None.

    Files in upper folders come first; in folders of the same depth, world files come before models.
    """
    suffixes = world_suffixes()

    def rank(name: str) -> tuple[int, int, str]:
        return (name.count("/"), suffixes.index(Path(name).suffix.lower()), name)

    return min((each for each in names if each.lower().endswith(suffixes)), key=rank, default=None)


def find_world(path: str | os.PathLike[str], unpacked: Path) -> tuple[Path, Path | None]:
    """Returns the world of a file, folder or archive, and the folder whose files it may read.

    The folder is None for a single file, which may read the files in its own folder. Archives are unpacked to the
    folder `unpacked`. A notice names the chosen world if a folder or an archive contains several suitable worlds.
    Raises `SettingsError` for an image and for a folder or archive without a world, and `FileNotFoundError` for a
    missing file.
    """
    given = Path(path)
    if given.suffix.lower() in IMAGES:
        raise SettingsError(
            f"{given}: expected a world or a model, got an image; to show photographs behind their cameras, use "
            "--cameras FILE --photos DIR (cameras= and photos= in Python)",
            code="wrong_type",
        )
    if given.is_file() and given.suffix.lower() == ARCHIVE:
        unpack(given, unpacked, _check_archive(given), known_suffixes())
        return _world_in(given, unpacked), unpacked
    if given.is_dir():
        return _world_in(given, given), given
    return given, None


def _world_in(given: Path, folder: Path) -> Path:
    names = [each.relative_to(folder).as_posix() for each in _files_in(folder)]
    name = first_world(names)
    if name is None:
        raise SettingsError(
            f"{given}: no world found; supported: {', '.join(world_suffixes())}", code="missing_value"
        )
    rivals = [each for each in names if each.lower().endswith(world_suffixes()) and each != name]
    rivals = [each for each in rivals if each.count("/") == name.count("/")]
    if rivals and not name.endswith(".toml"):
        listed = ", ".join(rivals[:LISTED_NAMES]) + (
            f" and {len(rivals) - LISTED_NAMES} more" if len(rivals) > LISTED_NAMES else ""
        )
        warn(
            Notice(
                f"{given}: showing {name}; other worlds: {listed}; to show another world, pass its path (unpack an "
                "archive first)",
                "chosen_world",
            )
        )
    return folder / name


def _files_in(folder: Path) -> list[Path]:
    """Returns the known files of a folder and its subfolders, without hidden files and folders.

    Archives from macOS contain a hidden file `._NAME` for each file. At most `MAX_LISTED_FILES` files are returned,
    from at most `MAX_DEPTH` levels of subfolders.
    """
    found: list[Path] = []
    for place, folders, files in os.walk(folder):
        depth = len(Path(place).relative_to(folder).parts)
        folders[:] = sorted(each for each in folders if not each.startswith(".") and depth < MAX_DEPTH)
        shown = (each for each in sorted(files) if not each.startswith("."))
        found += [Path(place, each) for each in shown if each.lower().endswith(known_suffixes())]
        if len(found) > MAX_LISTED_FILES:
            break
    return found[:MAX_LISTED_FILES]


def _check_archive(archive: Path) -> Callable[[str, int], None]:
    """Returns a function that counts the files of an archive on disk.

    The function raises `SettingsError` beyond the limits.
    """
    counts = [0, 0]

    def check(name: str, size: int) -> None:
        counts[0], counts[1] = counts[0] + 1, counts[1] + size
        if counts[0] > MAX_ARCHIVE_FILES or counts[1] > MAX_ARCHIVE_BYTES:
            raise SettingsError(
                f"{archive}: the archive is too large; the limit is {MAX_ARCHIVE_FILES} files and "
                f"{MAX_ARCHIVE_BYTES >> 30} GiB unpacked; unpack it and view the folder",
                code="too_large",
            )

    return check


def combine_models(paths: Sequence[Path], folder: Path | None = None) -> World:
    """Returns one world with several models, each at its own coordinates, named after its file.

    The world is y up if all models are; otherwise, models that are y up are rotated. `folder` is the folder whose files
    the models may read (default: all). Raises `SettingsError` for world files, and the errors of `World.add_object`.
    """
    for path in paths:
        if path.suffix.lower() in (".toml", ".urdf", ".xacro", ".sdf", ".xml"):
            raise SettingsError(
                f"{path.name}: world and robot files cannot be combined with other files; view this file alone",
                code="conflicting_values",
            )
    is_y_up = all(path.suffix.lower() in Y_UP for path in paths)
    world = World("y" if is_y_up else "z", folder=folder)
    names: set[str] = set()
    for path in paths:
        name, count = path.stem, 1
        while name in names:
            count += 1
            name = f"{path.stem} {count}"
        names.add(name)
        turned = {"matrix": UPRIGHT.tolist()} if path.suffix.lower() == ".obj" and not is_y_up else {}
        world.add_object(mesh=path if folder is None else path.relative_to(folder), name=name, **turned)
    world._is_up_assumed = not any(map(has_up_axis, paths))
    return world
