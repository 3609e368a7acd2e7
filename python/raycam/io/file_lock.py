"""One process at a time at a folder."""

from __future__ import annotations

import contextlib
import os
import socket
import time
from collections.abc import Iterator
from pathlib import Path

from ..errors import JobError

__all__ = ["hold_lock", "lock_holder", "try_lock"]


@contextlib.contextmanager
def hold_lock(path: Path, folder: Path, patience: float = 0.2) -> Iterator[None]:
    """Holds the lock file `path` of `folder` while the block lasts; a process that dies lets go of it.

    Somebody else is waited for `patience` seconds; `lock_holder` takes it for an instant only.

    Raises `JobError` with the process that holds it, where another one does.
    """
    file = os.open(path, os.O_RDWR | os.O_CREAT, 0o666)
    try:
        end = time.monotonic() + patience
        while not try_lock(file):
            if time.monotonic() < end:
                time.sleep(0.02)
                continue
            who = os.pread(file, 200, 0).decode(errors="replace").strip() or "another process"
            raise JobError(
                f"{folder}: {who} is at it already; wait for it, stop it, or give each run its part: --shard I/N"
            )
        os.ftruncate(file, 0)
        os.pwrite(file, f"process {os.getpid()} on {socket.gethostname()}".encode(), 0)
        yield
    finally:
        os.close(file)


def lock_holder(path: Path) -> str | None:
    """Who holds a lock now, or None."""
    try:
        file = os.open(path, os.O_RDWR)
    except OSError:
        return None
    try:
        return None if try_lock(file) else os.pread(file, 200, 0).decode(errors="replace").strip()
    finally:
        os.close(file)


def try_lock(file: int) -> bool:
    """Locks an open file, where nobody else has; until it is closed, or its process ends."""
    try:
        import fcntl
    except ImportError:  # Windows: its own locks, on the first byte far beyond the text
        import msvcrt

        try:
            os.lseek(file, 1 << 20, os.SEEK_SET)
            msvcrt.locking(file, msvcrt.LK_NBLCK, 1)  # type: ignore[attr-defined]
        except OSError:
            return False
        return True
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True
