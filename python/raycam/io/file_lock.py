"""File locks: one process at a time works in a folder."""

from __future__ import annotations

import contextlib
import os
import time
from collections.abc import Iterator
from pathlib import Path

from ..errors import JobError, Notice
from ..notices import warn
from .system_calls import read_at, write_at

__all__ = ["LocksUnsupportedError", "hold_lock", "lock_holder", "try_lock"]

LOCKED_BYTE = 1 << 20
"""The position of the byte that Windows locks."""


class LocksUnsupportedError(OSError):
    """The file system of a file does not support locks."""


@contextlib.contextmanager
def hold_lock(path: Path, folder: Path, patience: float = 0.2) -> Iterator[None]:
    """Holds the lock file `path` of `folder` while the block lasts.

    If the process that held the lock has ended, the lock is free. The function waits up to `patience` seconds for the
    lock, because `lock_holder` holds the lock briefly. A file system without locks gives a notice.

    Raises `JobError` with the name of the process that holds the lock.
    """
    file = os.open(path, os.O_RDWR | os.O_CREAT, 0o666)
    try:
        _wait_for_lock(file, folder, patience)
        from socket import gethostname  # imported here, so that `import raycam` is fast

        os.ftruncate(file, 0)
        write_at(file, f"process {os.getpid()} on {gethostname()}".encode(), 0)
        yield
    finally:
        os.close(file)


def _wait_for_lock(file: int, folder: Path, patience: float) -> None:
    """Locks an open lock file within `patience` seconds; see `hold_lock`."""
    end = time.monotonic() + patience
    try:
        while not try_lock(file):
            if time.monotonic() < end:
                time.sleep(0.02)
                continue
            who = read_at(file, 200, 0).decode(errors="replace").strip() or "another process"
            raise JobError(
                f"{folder}: {who} works in this folder; wait for it, stop it, or give each process its part with "
                "shard=(I, N)",
                code="folder_in_use",
            )
    except LocksUnsupportedError as fault:
        message = (
            f"{folder}: this file system does not support locks ({fault.strerror}); only one process at a time "
            "may work in this folder"
        )
        warn(Notice(message, "missing_locks"))


def lock_holder(path: Path) -> str | None:
    """Returns the name of the process that holds a lock now.

    The result is None if the lock is free, or if the file system has no locks.
    """
    try:
        file = os.open(path, os.O_RDWR)
    except OSError:
        return None
    try:
        return None if try_lock(file) else read_at(file, 200, 0).decode(errors="replace").strip()
    except LocksUnsupportedError:
        return None
    finally:
        os.close(file)


def try_lock(file: int) -> bool:
    """Locks an open file until the file is closed or the process ends.

    Returns True if the file is locked, and False if another process holds the lock. Raises
    `LocksUnsupportedError` if the file system has no locks, which is common for Lustre, NFS and SMB shares.
    """
    try:
        import fcntl
    except ImportError:  # Windows: locks a byte far beyond the text, which must stay readable
        import msvcrt

        place = os.lseek(file, 0, os.SEEK_CUR)
        try:
            os.lseek(file, LOCKED_BYTE, os.SEEK_SET)
            msvcrt.locking(file, msvcrt.LK_NBLCK, 1)  # type: ignore[attr-defined]
        except OSError:
            return False
        finally:
            os.lseek(file, place, os.SEEK_SET)
        return True
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError as fault:
        raise LocksUnsupportedError(fault.errno, fault.strerror) from fault
    return True
