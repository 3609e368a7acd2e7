"""The journal of a job: its finished and failed frames, and their files.

The journal is an append-only text file with one JSON object per line and one line per frame,

    {"frame": 12, "files": {"frame_0012.png": [41802, "9f86d0..."]}, "seconds": 0.52, "crc32": "5f0e1a07"}
    {"frame": 13, "error": "WorldError: ...", "crc32": "c3a40e2b"}

where a file has its size in bytes and its SHA-256. A line is written and synced after its files have their final names,
so that every recorded file is on the disk. A process that is killed while writing leaves a partial line at the end,
which is ignored and truncated by the next writer. A damaged line is ignored too: its frame is rendered again, and the
line is overwritten with spaces.
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
from typing import Any

from ..errors import JobError
from ..io.atomic_files import with_path
from ..io.system_calls import BINARY, read_at, sync_file, sync_folder

__all__ = ["Journal", "JournalEntry", "Stamp", "digest", "erase_line", "read", "read_entry"]

Stamp = tuple[int, str]
"""Size in bytes and SHA-256 in hexadecimal of a file."""
CHECK = b',"crc32":"'
"""Separator before the check sum of a line, which covers all bytes before the separator."""


@dataclass(frozen=True)
class JournalEntry:
    """The outcome of a frame."""

    frame: int
    """The frame's number."""
    files: Mapping[str, Stamp] = field(default_factory=dict)
    """The stamps of the frame's files, by name."""
    error: str | None = None
    """The error of a failed frame, in one line; None for a finished frame."""
    seconds: float | None = None
    """The time that the worker took, in seconds."""

    def line(self) -> bytes:
        """The entry as a line of the journal."""
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
    """Returns the stamp of a file with these bytes."""
    size, hashed = 0, hashlib.sha256()
    for piece in pieces:
        size += len(piece)
        hashed.update(piece)
    return size, hashed.hexdigest()


def read(path: Path) -> Iterator[tuple[int, JournalEntry | None]]:
    """Iterates over the entries of a journal with their byte offsets, oldest first.

    Yields None for a damaged line.

    A partial line at the end, left by a killed process, is skipped. A missing file has no entries.
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
    """Returns the entry at an offset from `read` or `Journal.add`.

    Raises `JobError` if the line has changed.
    """
    with path.open("rb") as lines:
        lines.seek(place)
        entry = _entry(lines.readline())
    if entry is None:
        raise JobError(
            f"{path}: another program has changed the file at byte {place}; run the job's command again",
            code="damaged_job",
        )
    return entry


def erase_line(path: Path, place: int) -> None:
    """Overwrites a damaged line, which `read` found at the offset `place`, with spaces.

    The caller holds the lock of the journal, because another machine may still be writing a line that looks damaged.
    Raises `OSError` from the disk.
    """
    with path.open("r+b") as lines:
        lines.seek(place)
        line = lines.readline()
        if _entry(line) is None:
            lines.seek(place)
            lines.write(b" " * (len(line) - 1))
            lines.flush()
            sync_file(lines.fileno())


def _entry(line: bytes) -> JournalEntry | None:
    """Parses an entry; returns None for a partial or damaged line.

    A line of zeros, which a power cut may leave, also returns None.
    """
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
    """A journal open for appending, created if missing. Raises `OSError` from the disk."""

    def __init__(self, path: Path) -> None:
        self._path = path
        new = not path.exists()
        self._file = os.open(path, os.O_RDWR | os.O_CREAT | os.O_APPEND | BINARY, 0o666)
        try:
            if new:
                sync_folder(path.parent)
            self._truncate_partial()
        except BaseException:
            os.close(self._file)
            raise

    def _truncate_partial(self) -> None:
        """Truncates a partial line at the end."""
        size = os.fstat(self._file).st_size
        end = size
        while end > 0:
            start = max(0, end - 4096)
            newline = read_at(self._file, end - start, start).rfind(b"\n")
            end = start + newline + 1 if newline >= 0 else start
            if newline >= 0:
                break
        if end != size:
            os.ftruncate(self._file, end)
            sync_file(self._file)

    def add(self, entry: JournalEntry) -> int:
        """Appends an entry, syncs it to the disk, and returns its byte offset.

        On failure, nothing is appended, and `OSError` is raised.
        """
        line = entry.line()
        before = os.fstat(self._file).st_size
        try:
            with with_path(self._path):
                if os.write(self._file, line) != len(line):
                    # The disk accepted only a part of the line. A second attempt raises the error or succeeds.
                    os.ftruncate(self._file, before)
                    if os.write(self._file, line) != len(line):
                        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
                sync_file(self._file)
        except OSError:
            os.ftruncate(self._file, before)
            raise
        return before

    def close(self) -> None:
        """Closes the file."""
        os.close(self._file)

    def __enter__(self) -> Journal:
        """Returns the journal."""
        return self

    def __exit__(self, *raised: object) -> None:
        """Closes the file."""
        self.close()
