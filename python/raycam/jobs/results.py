"""The result files of a job in its folder.

Paths are strings here, as in all code that runs for each frame: pathlib interns the parts of every name forever.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
from collections.abc import Iterable, Mapping
from pathlib import Path

from ..errors import JobError
from ..io import atomic_files
from .journal import Stamp, digest

__all__ = ["STATE", "ResultStore"]

STATE = ".raycam"
"""The folder of the job's state, within the job's folder."""
ASSEMBLED = "joined.json"
"""The file in `STATE` that records files assembled from all frames."""


class ResultStore:
    """Result files in a folder, by names relative to the folder, with `/` between folders.

    Raises `JobError` for a name outside the folder, or inside `STATE`.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = os.fspath(folder)

    def store(self, made: Mapping[str, bytes | Iterable[bytes]], scratch: Path) -> dict[str, Stamp]:
        """Writes the files of a frame and returns their stamps; raises `OSError` from the disk."""
        stamps = {}
        for name, data in made.items():
            path = self._path(name)
            if not os.path.isdir(os.path.dirname(path)):
                atomic_files.make_folder(Path(path).parent)
            atomic_files.write(path, data, scratch)
            stamps[name] = digest([data] if isinstance(data, bytes) else data)
        return stamps

    def has(self, name: str, size: int) -> bool:
        """True if a file exists with this size in bytes."""
        try:
            return os.stat(self._path(name)).st_size == size
        except FileNotFoundError:
            return False

    def read(self, name: str, stamp: Stamp) -> bytes:
        """Reads a file; raises `JobError` if it is missing or differs from its stamp."""
        path = self._path(name)
        try:
            with open(path, "rb") as file:
                data = file.read()
        except FileNotFoundError:
            raise JobError(
                f"{path}: the result was created, but is missing now; run the job's command again",
                code="damaged_job",
            ) from None
        _compare(path, stamp, digest([data]))
        return data

    def check(self, name: str, stamp: Stamp) -> None:
        """Raises the errors of `read`, without holding the whole file in memory."""
        path = self._path(name)
        try:
            found = _fingerprint(path)
        except FileNotFoundError:
            raise JobError(
                f"{path}: the result was created, but is missing now; run the job's command again",
                code="damaged_job",
            ) from None
        _compare(path, stamp, found)

    def mark_assembled(self, names: Iterable[str], scratch: Path) -> None:
        """Records the stamps of files that are assembled from all frames.

        These files are index files, or a video next to the folder.
        """
        stamps = {name: _fingerprint(self._assembled_path(name)) for name in names}
        atomic_files.write(os.path.join(self._folder, STATE, ASSEMBLED), json.dumps(stamps).encode(), scratch)

    def assembled(self) -> dict[str, Stamp]:
        """The stamps that `mark_assembled` recorded; raises `JobError` if the record is damaged."""
        path = os.path.join(self._folder, STATE, ASSEMBLED)
        try:
            with open(path, "rb") as file:
                found = json.load(file)
            joined = {str(name): (int(size), str(sha)) for name, (size, sha) in found.items()}
            for name in joined:
                self._assembled_path(name)  # raises JobError for a path outside the folder
            return joined
        except FileNotFoundError:
            return {}
        except (ValueError, TypeError, AttributeError, JobError):
            raise JobError(
                f"{path}: the list of results is damaged; remove this file and run the job's command again",
                code="damaged_job",
            ) from None

    def check_assembled(self) -> dict[str, str]:
        """Returns a message for each assembled file that differs from its stamp.

        The method renames these files to `.damaged`. Missing files and a damaged list of stamps also have a
        message.
        """
        wrong = {}
        try:
            joined = self.assembled()
        except JobError as fault:
            return {f"{STATE}/{ASSEMBLED}": str(fault)}
        for name, stamp in joined.items():
            path = self._assembled_path(name)
            try:
                _compare(path, stamp, _fingerprint(path))
            except FileNotFoundError:
                wrong[name] = f"{path}: the result was created, but is missing now"
            except JobError as fault:
                wrong[name] = str(fault)
                with contextlib.suppress(OSError):
                    os.replace(path, path + ".damaged")
        return wrong

    def quarantine(self, name: str) -> None:
        """Appends `.damaged` to the name of a damaged file, if possible."""
        path = self._path(name)
        with contextlib.suppress(OSError):
            os.replace(path, path + ".damaged")

    def remove(self, names: Iterable[str]) -> None:
        """Removes files, and their folders if they become empty."""
        folders: set[str] = set()
        for name in names:
            path = _safe_name(name)
            with contextlib.suppress(FileNotFoundError):
                os.unlink(os.path.join(self._folder, path))
            while path := os.path.dirname(path):
                folders.add(path)
        # Inner folders, which have longer paths, are removed first.
        for folder in sorted(folders, key=len, reverse=True):
            with contextlib.suppress(OSError):
                os.rmdir(os.path.join(self._folder, folder))

    def _path(self, name: str) -> str:
        return os.path.join(self._folder, _safe_name(name))

    def _assembled_path(self, name: str) -> str:
        """The path of an assembled file: in the folder, or "../NAME" next to the folder."""
        beside = name.removeprefix("../")
        if beside == name or "/" in beside:
            return self._path(name)
        return os.path.normpath(os.path.join(self._folder, os.pardir, _safe_name(beside)))


def _compare(path: str, stamp: Stamp, found: Stamp) -> None:
    if found != stamp:
        raise JobError(
            f"{path}: the result was created with {stamp[0]} bytes and SHA-256 {stamp[1][:12]}, but now has "
            f"{found[0]} bytes and SHA-256 {found[1][:12]}; run the job's command again",
            code="damaged_job",
        )


def _fingerprint(path: str) -> Stamp:
    """Returns the stamp (size and SHA-256) of a file, which is read in pieces."""
    with open(path, "rb") as file:
        return os.fstat(file.fileno()).st_size, hashlib.file_digest(file, "sha256").hexdigest()


def _safe_name(name: str) -> str:
    """Checks the name of a result, and returns the name with this system's separators."""
    parts = [part for part in name.split("/") if part not in ("", ".")]
    if not parts or name.startswith("/") or ".." in parts or parts[0] == STATE:
        raise JobError(
            f"{name!r} is not a valid file name for a job; expected a path inside the job's folder",
            code="invalid_value",
        )
    return os.path.join(*parts)
