"""Temporary streams on disk, for data that is produced in pieces and may exceed the memory."""

from __future__ import annotations

import os
import weakref
from collections.abc import Iterable, Iterator
from tempfile import TemporaryFile

from .atomic_files import with_path

__all__ = ["Piece", "TempStream", "TempStreamError"]

Piece = bytes | memoryview
READ_BYTES = 1 << 20


class TempStreamError(OSError):
    """A failure of the job's disk while a stream is written.

    This error does not count as a failure of the frame.
    """


class TempStream:
    """Bytes in an unnamed temporary file of a folder.

    The file disappears when the process that holds the file ends. Raises `TempStreamError` for errors of the
    disk.
    """

    def __init__(self, folder: str, pieces: Iterable[Piece] = ()) -> None:
        self.size = 0
        """The number of bytes."""
        self._folder = folder or os.curdir
        try:
            with with_path(self._folder):
                self._file = TemporaryFile(dir=self._folder)  # noqa: SIM115
        except OSError as fault:
            raise _stream_error(fault) from fault
        weakref.finalize(self, self._file.close)
        for piece in pieces:
            self.add(piece)

    def add(self, piece: Piece) -> None:
        """Appends a piece."""
        try:
            with with_path(self._folder):
                self._file.write(piece)
                self._file.flush()
        except OSError as fault:
            raise _stream_error(fault) from fault
        self.size += len(piece)

    def __iter__(self) -> Iterator[bytes]:
        """Iterates over all bytes in pieces of 1 MiB."""
        self._file.seek(0)
        while piece := self._file.read(READ_BYTES):
            yield piece


def _stream_error(fault: OSError) -> TempStreamError:
    return TempStreamError(fault.errno, fault.strerror, fault.filename)
