"""Files dropped on the page, which are stored in a private folder and opened there.

A client sends names and bytes. A name is a relative path without "..", so that the file stays in the folder; the
readers then open nothing outside of the folder. Archives (.zip) are unpacked within the same limits.
"""

from __future__ import annotations

import base64
import contextlib
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import IO

from ..._core import file_extensions
from ...errors import Error, SettingsError
from ...io.archive import check_name, unpack
from ...world import World
from ...world.load import load_with_assumed_axis
from ...world.sources import is_model_file
from .sources import ARCHIVE, IMAGES, combine_models, first_world, known_suffixes

__all__ = ["MAX_BYTES", "MAX_FILES", "Uploads", "file_types", "is_image"]

MAX_BYTES = 256 * 2**20
MAX_FILES = 200
LIGHT_IMAGES = (*IMAGES, ".hdr", ".exr")
"""The extensions of images of environments and backgrounds."""


def file_types() -> dict[str, list[str]]:
    """The extensions of `worlds` and models, and of their `companions`, without the dot."""
    worlds, companions = file_extensions()
    return {"worlds": worlds, "companions": companions}


def is_image(name: str, types: tuple[str, ...] = IMAGES) -> bool:
    """True for the name of an image of these types; the default are the types of textures."""
    return name.lower().endswith(types)


class Uploads:
    """The files that a client has uploaded."""

    def __init__(self) -> None:
        self._folder: tempfile.TemporaryDirectory[str] | None = None
        self._sizes: dict[str, int] = {}
        self._received: dict[str, int] = {}
        self._kept: set[str] = set()
        """Images that a view refers to, which are not removed before the view is closed."""
        self._opened: set[str] = set()
        """The files that existed when a world was last opened."""
        self._worlds, companions = (tuple(f".{each}" for each in group) for group in file_extensions())
        self._known = (*self._worlds, *companions, ARCHIVE)

    def add(self, name: str, size: int, offset: int, data: str) -> bool:
        """Adds a piece of a file; returns True if the file is complete.

        Files of other types are ignored. Raises `SettingsError` for invalid pieces, and then deletes the file.
        """
        name = check_name(name)
        if not name.lower().endswith(self._known):
            return False
        piece = base64.b64decode(data, validate=True)
        if name in self._kept:
            raise SettingsError(
                f"{name}: the view uses this file; rename the new file", code="conflicting_values"
            )
        if offset == 0:
            if self._is_too_much(name, size):
                self._forget_opened()
            self._opened.discard(name)
            self._drop(name)
            self._check_room(name, size)
            self._sizes[name], self._received[name] = size, 0
        if self._received.get(name) != offset or self._sizes[name] != size or offset + len(piece) > size:
            self._drop(name)
            raise SettingsError(
                f"{name}: a piece of the upload is missing or too long; drop the file again",
                code="wrong_shape",
            )
        with self._file(name, "wb" if offset == 0 else "ab") as file:
            file.write(piece)
        self._received[name] = offset + len(piece)
        return self._received[name] == size

    def open(self, name: str, more: Sequence[str] = ()) -> tuple[World, bool]:
        """Returns the world of a complete file or archive, to which the models `more` are added.

        The second value is True unless the world comes from a world file. Raises `SettingsError` and the errors of
        `raycam.load`.
        """
        names = [self._complete(each) for each in (name, *more)]
        try:
            if more:
                world = combine_models([self._path() / each for each in names], self._path())
            else:
                path = self._path() / names[0]
                world = load_with_assumed_axis(path, folder=self._path())
        except FileNotFoundError as error:
            missing = Path(str(error.filename)).name
            raise SettingsError(
                f"{names[0]} requires {missing}, which was not uploaded; drop both files together",
                code="missing_value",
            ) from None
        except Error as error:
            raise type(error)(self._without_folder(str(error)), code=error.code) from None
        self._opened = set(self._sizes)
        return world, all(map(is_model_file, names))

    def image(self, name: str) -> str:
        """Returns the path of an image; raises `SettingsError` unless it was received completely."""
        return self._image(check_name(name), IMAGES)

    def keep_image(self, name: str) -> str:
        """Returns the path of an image of an environment or a background, which exists until the view is closed.

        Raises `SettingsError` unless it was received completely.
        """
        name = check_name(name)
        path = self._image(name, LIGHT_IMAGES)
        self._kept.add(name)
        return path

    def _image(self, name: str, types: tuple[str, ...]) -> str:
        if not is_image(name, types) or self._received.get(name, -1) != self._sizes.get(name):
            raise SettingsError(
                f"{name}: expected an uploaded image ({', '.join(types)})", code="unknown_format"
            )
        return str(self._path() / name)

    @contextlib.contextmanager
    def hidden_path(self, file: str) -> Iterator[None]:
        """Replaces a file's path by its name in the errors of readers."""
        try:
            yield
        except Error as error:
            raise type(error)(self.without_path(str(error), file), code=error.code) from None

    def without_path(self, text: str, file: str) -> str:
        """A reader's text that contains a file's name instead of its path in the private folder."""
        return self._without_folder(text.replace(file, Path(file).name))

    def _complete(self, name: str) -> str:
        """Returns the name of a world that was received completely.

        For an archive, the result is the name of the world in the archive. Raises `SettingsError` if the file
        is not a world or is incomplete.
        """
        name = check_name(name)
        if not name.lower().endswith((*self._worlds, ARCHIVE)):
            raise SettingsError(
                f"{name} is not a world; supported: {', '.join((*self._worlds, ARCHIVE))}",
                code="unknown_format",
            )
        if name not in self._sizes or self._received[name] != self._sizes[name]:
            raise SettingsError(f"{name} was not uploaded completely; drop it again", code="truncated_file")
        return self._unpack(name) if name.lower().endswith(ARCHIVE) else name

    def close(self) -> None:
        """Removes the files."""
        if self._folder is not None:
            self._folder.cleanup()
            self._folder = None
        self._sizes, self._received = {}, {}

    def _unpack(self, archive: str) -> str:
        """Unpacks the known files of an archive, and returns the name of the archive's world.

        The result is the world that is nearest to the archive's top folder.
        """
        folder = f"{archive}.files"

        def check(name: str, size: int) -> None:
            self._check_room(f"{folder}/{name}", size)
            self._sizes[f"{folder}/{name}"] = self._received[f"{folder}/{name}"] = size

        names = unpack(self._path() / archive, self._path() / folder, check, known_suffixes())
        name = first_world(names)
        if name is None:
            raise SettingsError(
                f"{archive} contains no world; supported: {', '.join(self._worlds)}", code="missing_value"
            )
        return f"{folder}/{name}"

    def _without_folder(self, text: str) -> str:
        """A reader's error without the private folder's path, which is meaningless for a client."""
        text = text.replace(f"{self._path()}/", "").replace(str(self._path()), "the dropped files")
        kept, is_outside, _ = text.partition("; to allow it")
        return f"{kept}; a dropped world can only use files dropped with it" if is_outside else kept

    def _check_room(self, name: str, size: int) -> None:
        if self._is_too_much(name, size):
            raise SettingsError(
                f"{name}: too much data; the limit is {MAX_FILES} files and {MAX_BYTES >> 20} MiB in total. Open "
                "larger worlds with raycam view FILE",
                code="too_large",
            )

    def _is_too_much(self, name: str, size: int) -> bool:
        """True if this file would exceed the limits on number and total size."""
        sizes = {**self._sizes, name: size}
        return len(sizes) > MAX_FILES or sum(sizes.values()) > MAX_BYTES

    def _forget_opened(self) -> None:
        """Removes the files of worlds that were opened before: they are in memory."""
        for name in (self._opened & set(self._sizes)) - self._kept:
            self._drop(name)
        self._opened = set()

    def _path(self) -> Path:
        if self._folder is None:
            self._folder = tempfile.TemporaryDirectory(prefix="raycam-view-")
        return Path(self._folder.name)

    def _file(self, name: str, mode: str) -> IO[bytes]:
        """Opens the file of a name, and creates its folders.

        Raises `SettingsError` if the file cannot be opened, for example because a file has the name of a
        folder.
        """
        path = self._path() / name
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            return path.open(mode)
        except OSError as error:
            self._drop(name)
            raise SettingsError(
                f"{name}: cannot store this file ({error.strerror})", code="storage"
            ) from None

    def _drop(self, name: str) -> None:
        self._sizes.pop(name, None)
        self._received.pop(name, None)
        if self._folder is not None:
            with contextlib.suppress(OSError):
                (self._path() / name).unlink(missing_ok=True)
