"""Watching a world's files: after a change, the view loads the world again."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable
from pathlib import Path
from urllib.parse import quote

from ...errors import Notice
from ...notices import warn

__all__ = ["Watcher", "used_files"]

INTERVAL_S = 0.25
"""Time between two checks of the files; a change is complete if the files are the same in two checks."""
MAX_FILES = 2000
"""Maximum number of files in a watched folder; the world's files are searched for the names of these files."""
MAX_SEARCHED_BYTES = 64 * 2**20
"""Larger files are not searched for names of other files."""

Stamp = tuple[int, int] | None
"""Time of change in nanoseconds and size of a file; None for a missing file."""


def used_files(path: Path) -> list[Path]:
    """Returns the file of a world, and the files that it uses, directly or indirectly.

    A file is used if it is in the folder of the world and its name occurs in a file that is used.
    """
    nearby = _nearby(path.parent)
    found, waiting = {path}, [path]
    while waiting:
        text = _content(waiting.pop())
        for each in nearby:
            name = each.name
            if each not in found and (name.encode() in text or quote(name).encode() in text):
                found.add(each)
                waiting.append(each)
    return sorted(found)


def _nearby(folder: Path) -> list[Path]:
    """The files of a folder and its subfolders, without hidden files."""
    found: list[Path] = []
    for place, folders, files in os.walk(folder):
        folders[:] = sorted(each for each in folders if not each.startswith("."))
        found += [Path(place, each) for each in sorted(files) if not each.startswith(".")]
        if len(found) > MAX_FILES:
            warn(
                Notice(
                    f"{folder}: contains more than {MAX_FILES} files; changes to some textures may not be detected",
                    "watch_limit",
                )
            )
            break
    return found[:MAX_FILES]


def _content(path: Path) -> bytes:
    try:
        with path.open("rb") as file:
            return file.read(MAX_SEARCHED_BYTES)
    except OSError:
        return b""


def _stamp(path: Path) -> Stamp:
    try:
        found = path.stat()
    except OSError:
        return None
    return found.st_mtime_ns, found.st_size


class Watcher(threading.Thread):
    """Calls `changed` after each change of a world's files, as soon as the files are complete."""

    def __init__(self, path: str | os.PathLike[str], changed: Callable[[], None]) -> None:
        super().__init__(name="raycam watch", daemon=True)
        self._path = Path(path).absolute()
        self._changed = changed
        self._ending = threading.Event()
        self._known = self._stamps()

    def _stamps(self) -> dict[Path, Stamp]:
        return {each: _stamp(each) for each in used_files(self._path)}

    def run(self) -> None:
        """Checks the files for changes until `end` is called."""
        latest = self._known
        while not self._ending.wait(INTERVAL_S):
            before, latest = latest, {each: _stamp(each) for each in latest}
            is_complete = latest == before and latest[self._path] is not None
            if is_complete and latest != self._known:
                latest = self._known = self._stamps()
                self._changed()

    def end(self) -> None:
        """Stops watching."""
        self._ending.set()
        if self.is_alive() and threading.current_thread() is not self:
            self.join()
