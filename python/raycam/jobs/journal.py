"""The ledger of a job: which frames are finished, and which files they made.

A text file that only grows: one JSON object a line, one line a frame,

    {"frame": 12, "files": {"frame_0012.png": [41802, "9f86d0..."]}, "seconds": 0.52, "crc32": "5f0e1a07"}
    {"frame": 13, "error": "WorldError: ...", "crc32": "c3a40e2b"}

where a file has its size in bytes and its SHA-256. A line is written after its files have their final names, and
synced: what the ledger says is on the disk. A process that is killed while it writes leaves half a line at the
end, which does not count and is cut off by the next one to write. A line that was damaged does not count either: its
frame is made again, and the line is blanked where it stands.
"""

from __future__ import annotations

import errno
import hashlib
import json
import os
import zlib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType
from typing import Any

from ..errors import JobError
from ..io.atomic_files import sync, with_path

__all__ = ["Journal", "JournalEntry", "Stamp", "digest", "erase_line", "read", "read_entry"]

Stamp = tuple[int, str]
"""Size in bytes and SHA-256 in hexadecimal of a file."""
CHECK = b',"crc32":"'
"""Before the check sum of a line, of all that is before it."""


@dataclass(frozen=True)
class JournalEntry:
    """What became of a frame."""

    frame: int
    """Its number."""
    files: Mapping[str, Stamp] = field(default_factory=dict)
    """What it made, by name."""
    error: str | None = None
    """Why it was given up, in one line; None where it is finished."""
    seconds: float | None = None
    """How long making it took its worker."""

    def line(self) -> bytes:
        """Itself as a line of the ledger."""
        fields: dict[str, Any] = {"frame": self.frame}
        if self.error is not None:
            fields["error"] = self.error
        else:
            fields["files"] = {name: list(value) for name, value in self.files.items()}
        if self.seconds is not None:
            fields["seconds"] = round(self.seconds, 4)
        start = json.dumps(fields, separators=(",", ":")).encode()[:-1]
        return start + CHECK + _check(start) + b'"}\n'


def digest(pieces: Iterable[bytes]) -> Stamp:
    """The stamp of a file with these bytes."""
    size, hashed = 0, hashlib.sha256()
    for piece in pieces:
        size += len(piece)
        hashed.update(piece)
    return size, hashed.hexdigest()


def read(path: Path) -> Iterator[tuple[int, JournalEntry | None]]:
    """The entries of a ledger with their places, oldest first, None for a line that was damaged.

    Half a line at the end, as a killed process leaves it, is nothing. None of all that where there is no file.
    """
    try:
        with path.open("rb") as lines:
            place = 0
            for line in lines:
                if line.endswith(b"\n") and line.strip(b" \n"):
                    yield place, _entry(line)
                place += len(line)
    except FileNotFoundError:
        return


def read_entry(path: Path, place: int) -> JournalEntry:
    """The entry at a place that `read` or `Journal.add` gave; raises `JobError` where there is none any more."""
    with path.open("rb") as lines:
        lines.seek(place)
        entry = _entry(lines.readline())
    if entry is None:
        raise JobError(f"{path}: it was changed by somebody else, at byte {place}")
    return entry


def erase_line(path: Path, place: int) -> None:
    """Overwrites a damaged line, which `read` found at `place`, with spaces: its frame is made again.

    For whoever holds the lock of the ledger: what looks damaged may be a line that another machine has not written to
    its end. Raises `OSError` as the disk does.
    """
    with path.open("r+b") as lines:
        lines.seek(place)
        line = lines.readline()
        if _entry(line) is None:
            lines.seek(place)
            lines.write(b" " * (len(line) - 1))
            lines.flush()
            os.fsync(lines.fileno())


def _entry(line: bytes) -> JournalEntry | None:
    """An entry, or None for half a line, one that was damaged, or the zeros that a power cut may leave."""
    start, _, end = line.rpartition(CHECK)
    if end != _check(start) + b'"}\n':
        return None
    try:
        fields = json.loads(line)
        files = {str(name): (int(size), str(sha)) for name, (size, sha) in fields.get("files", {}).items()}
        error = fields.get("error")
        if error is None and "files" not in fields:
            return None
        return JournalEntry(
            int(fields["frame"]), files, None if error is None else str(error), fields.get("seconds")
        )
    except (ValueError, TypeError, KeyError, AttributeError):
        return None


def _check(data: bytes) -> bytes:
    return b"%08x" % zlib.crc32(data)


class Journal:
    """A ledger to write to; made where it is not there. Raises `OSError` as the disk does."""

    def __init__(self, path: Path) -> None:
        self._path = path
        new = not path.exists()
        self._file = os.open(path, os.O_RDWR | os.O_CREAT | os.O_APPEND, 0o666)
        try:
            if new:
                sync(path.parent)
            self._truncate_partial()
        except BaseException:
            os.close(self._file)
            raise

    def _truncate_partial(self) -> None:
        """Cuts off half a line at the end."""
        size = os.fstat(self._file).st_size
        end = size
        while end > 0:
            start = max(0, end - 4096)
            newline = os.pread(self._file, end - start, start).rfind(b"\n")
            end = start + newline + 1 if newline >= 0 else start
            if newline >= 0:
                break
        if end != size:
            os.ftruncate(self._file, end)
            os.fsync(self._file)

    def add(self, entry: JournalEntry) -> int:
        """Writes an entry, waits until it is on the disk, and gives its place. Where that fails, it is not there."""
        line = entry.line()
        before = os.fstat(self._file).st_size
        try:
            with with_path(self._path):
                if os.write(self._file, line) != len(line):
                    # The disk took a part: asking again gives the reason, or the rest of the room.
                    os.ftruncate(self._file, before)
                    if os.write(self._file, line) != len(line):
                        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
                os.fsync(self._file)
        except OSError:
            os.ftruncate(self._file, before)
            raise
        return before

    def close(self) -> None:
        """Closes the file."""
        os.close(self._file)

    def __enter__(self) -> Journal:
        """Itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Closes the file."""
        self.close()
