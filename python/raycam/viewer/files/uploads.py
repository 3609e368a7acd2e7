"""Files that are dropped on the page: put together in a private folder, and opened within it.

A client gives names and bytes. A name has letters, digits, dots, dashes and blanks alone and ends as files of worlds
do, so that it is never a path; the readers then open nothing outside of the folder.
"""

from __future__ import annotations

import base64
import re
import tempfile
from pathlib import Path

from ...errors import Error, SettingsError
from ...world import World
from ...world.load import load

__all__ = ["MOST_BYTES", "Uploads"]

MOST_BYTES = 256 * 2**20
MOST_FILES = 200
NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9._ -]{0,99}")
WORLDS = (".toml", ".gltf", ".glb", ".obj", ".ply", ".stl", ".off")
COMPANIONS = (
    *(
        ".mtl",
        ".bin",
        ".png",
        ".jpg",
        ".jpeg",
        ".hdr",
        ".exr",
        ".tga",
        ".bmp",
        ".gif",
        ".webp",
        ".ktx2",
        ".tif",
    ),
    *(".tiff", ".ies"),
)


class Uploads:
    """The files of one client."""

    def __init__(self) -> None:
        self._folder: tempfile.TemporaryDirectory[str] | None = None
        self._sizes: dict[str, int] = {}
        self._got: dict[str, int] = {}
        self._opened: set[str] = set()
        """The files that were there when a world was opened last."""

    def add(self, name: str, size: int, offset: int, data: str) -> bool:
        """Adds a piece of a file; True if the file is whole. Raises `SettingsError`, and then drops the file."""
        self._check_name(name, (*WORLDS, *COMPANIONS))
        piece = base64.b64decode(data, validate=True)
        if offset == 0:
            if self._is_too_much(name, size):
                self._forget_opened()
            self._opened.discard(name)
            self._sizes[name], self._got[name] = size, 0
            if self._is_too_much(name, size):
                self._drop(name)
                raise SettingsError(
                    f"{name}: {MOST_FILES} files of {MOST_BYTES >> 20} MiB in all are the most; load larger ones with "
                    "raycam view FILE"
                )
        if self._got.get(name) != offset or self._sizes[name] != size or offset + len(piece) > size:
            self._drop(name)
            raise SettingsError(f"{name}: its pieces do not follow each other: drop it again")
        with (self._path() / name).open("wb" if offset == 0 else "ab") as file:
            file.write(piece)
        self._got[name] = offset + len(piece)
        return self._got[name] == size

    def open(self, name: str) -> World:
        """The world of a file that is whole. Raises `SettingsError` and the errors of `raycam.load`."""
        self._check_name(name, WORLDS)
        if name not in self._sizes or self._got[name] != self._sizes[name]:
            raise SettingsError(f"{name} has not been uploaded")
        try:
            world = load(self._path() / name, folder=self._path())
        except FileNotFoundError as error:
            missing = Path(str(error.filename)).name
            raise SettingsError(
                f"{name}: {missing}, which it names, was not dropped: drop all of its files together"
            ) from None
        except Error as error:
            raise type(error)(self._told(str(error))) from None
        self._opened = set(self._sizes)
        return world

    def close(self) -> None:
        """Removes the files."""
        if self._folder is not None:
            self._folder.cleanup()
            self._folder = None
        self._sizes, self._got = {}, {}

    def _told(self, text: str) -> str:
        """An error of a reader for a client, which knows the names that it gave, and no folder."""
        text = text.replace(f"{self._path()}/", "").replace(str(self._path()), "of the dropped files")
        told, is_outside, _ = text.partition("; to allow it")
        return f"{told}; a dropped world names files beside it alone" if is_outside else told

    def _is_too_much(self, name: str, size: int) -> bool:
        """True if the files with this one would be too many, or too large."""
        sizes = {**self._sizes, name: size}
        return len(sizes) > MOST_FILES or sum(sizes.values()) > MOST_BYTES

    def _forget_opened(self) -> None:
        """Removes the files of worlds that were opened before: their bytes are in memory."""
        for name in self._opened & set(self._sizes):
            self._drop(name)
        self._opened = set()

    def _path(self) -> Path:
        if self._folder is None:
            self._folder = tempfile.TemporaryDirectory(prefix="raycam-view-")
        return Path(self._folder.name)

    def _drop(self, name: str) -> None:
        self._sizes.pop(name, None)
        self._got.pop(name, None)
        if self._folder is not None:
            (self._path() / name).unlink(missing_ok=True)

    def _check_name(self, name: str, endings: tuple[str, ...]) -> None:
        if NAME.fullmatch(name) is None or not name.lower().endswith(endings) or name.endswith((" ", ".")):
            raise SettingsError(
                f"{name!r}: names have letters from A to Z, digits, dots, dashes and blanks, and end in "
                f"{', '.join(endings)}"
            )
