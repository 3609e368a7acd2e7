"""Bytes that are made piece by piece and are too many for the memory."""

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
    """The disk of a job does not take what was made: no fault of the frame, as where a result cannot be written."""


class TempStream:
    """Bytes in a temporary file of a folder, without a name: it is gone with whoever holds it, killed or not.

    Raises `TempStreamError` as the disk does.
    """

    def __init__(self, folder: str, pieces: Iterable[Piece] = ()) -> None:
        self.size = 0
        """How many bytes there are."""
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
        """Writes what comes next."""
        try:
            with with_path(self._folder):
                self._file.write(piece)
                self._file.flush()
        except OSError as fault:
            raise _stream_error(fault) from fault
        self.size += len(piece)

    def __iter__(self) -> Iterator[bytes]:
        """All of them from the first, in pieces of a MiB."""
        self._file.seek(0)
        while piece := self._file.read(READ_BYTES):
            yield piece


def _stream_error(fault: OSError) -> TempStreamError:
    return TempStreamError(fault.errno, fault.strerror, fault.filename)
