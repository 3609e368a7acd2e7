"""System calls that differ between operating systems or are missing on some systems."""

from __future__ import annotations

import contextlib
import errno
import os
import sys
from collections.abc import Callable

__all__ = [
    "BINARY",
    "give_memory_back",
    "lower_own_priority",
    "parent_watch",
    "read_at",
    "sync",
    "sync_file",
    "sync_folder",
    "write_at",
]

BINARY: int = getattr(os, "O_BINARY", 0)
"""The flag of `os.open` with which Windows keeps line ends as they are; 0 elsewhere."""


def read_at(file: int, count: int, place: int) -> bytes:
    """Reads up to `count` bytes of an open file from the offset `place`.

    On Windows, the call moves the file's position.
    """
    if hasattr(os, "pread"):
        return os.pread(file, count, place)
    os.lseek(file, place, os.SEEK_SET)
    return os.read(file, count)


def write_at(file: int, data: bytes, place: int) -> int:
    """Writes bytes to an open file from the offset `place`, and returns their number.

    On Windows, this call moves the file's position.
    """
    if hasattr(os, "pwrite"):
        return os.pwrite(file, data, place)
    os.lseek(file, place, os.SEEK_SET)
    return os.write(file, data)


SYNC_UNSUPPORTED = (errno.EINVAL, errno.ENOSYS, errno.ENOTSUP, errno.EOPNOTSUPP)
"""The errors of file systems that cannot sync files, such as some network shares."""


def sync_file(file: int) -> None:
    """Syncs an open file to the disk, if the file system supports it.

    On macOS, the disk's own cache is also written to the disk. Raises `OSError` from the disk.
    """
    if sys.platform == "darwin":
        import fcntl

        try:
            fcntl.fcntl(file, fcntl.F_FULLFSYNC)
            return
        except OSError:  # network file systems may not support this call
            pass
    try:
        os.fsync(file)
    except OSError as fault:
        if fault.errno not in SYNC_UNSUPPORTED:
            raise


def sync(path: str | os.PathLike[str]) -> None:
    """Syncs a file or folder to the disk.

    Windows syncs a file only if it is open for writing. It cannot sync a folder, but NTFS keeps a journal of a folder's
    entries. Raises `OSError` from the disk.
    """
    windows = os.name == "nt"
    if windows and os.path.isdir(path):
        return
    descriptor = os.open(path, os.O_RDWR | BINARY if windows else os.O_RDONLY)
    try:
        sync_file(descriptor)
    finally:
        os.close(descriptor)


def sync_folder(path: str | os.PathLike[str]) -> None:
    """Syncs the entries of a folder to the disk, if the file system supports it.

    Network shares may fail with EINVAL or EIO. The files are complete in that case, but their names could be lost in
    a crash of the system.
    """
    with contextlib.suppress(OSError):
        sync(path)


def lower_own_priority() -> None:
    """Lowers the priority of this process.

    The new priority also applies to threads and processes that this process starts from now on.
    """
    if hasattr(os, "nice"):
        os.nice(19)
        return
    import ctypes

    kernel = ctypes.windll.kernel32  # type: ignore[attr-defined]
    kernel.GetCurrentProcess.restype = ctypes.c_void_p
    kernel.SetPriorityClass(ctypes.c_void_p(kernel.GetCurrentProcess()), IDLE_PRIORITY_CLASS)


IDLE_PRIORITY_CLASS = 0x40
"""Windows: the idle priority class, which child processes inherit."""
SYNCHRONIZE = 0x00100000
"""Windows: the right to wait for a process."""
WAIT_OBJECT_0 = 0
"""Windows: the result of waiting for a process that has ended."""


def parent_watch() -> Callable[[], bool]:
    """Returns a function that returns True once the parent process has ended."""
    parent = os.getppid()
    if os.name != "nt":
        return lambda: os.getppid() != parent
    # On Windows, the parent's process id never changes. Instead, the parent's handle is signalled at its end.
    import ctypes

    kernel = ctypes.windll.kernel32  # type: ignore[attr-defined]
    kernel.OpenProcess.restype = ctypes.c_void_p
    handle = kernel.OpenProcess(SYNCHRONIZE, False, parent)
    if not handle:
        return lambda: False
    return lambda: kernel.WaitForSingleObject(ctypes.c_void_p(handle), 0) == WAIT_OBJECT_0


MMAP_THRESHOLD = -3
"""An option of `mallopt`, of glibc's `malloc.h`."""


def give_memory_back() -> bool:
    """Makes the C library return freed blocks to the system.

    Returns False, without effect, for C libraries other than glibc. By default, glibc raises its mmap and trim
    thresholds after a large block is freed, so each thread may keep up to 64 MiB of freed memory. This call fixes the
    thresholds: blocks of 256 KiB or more (image planes, trees) are mapped separately and returned immediately, and each
    thread keeps at most 128 KiB.
    """
    import ctypes

    mallopt = getattr(ctypes.CDLL(None), "mallopt", None) if sys.platform == "linux" else None
    if mallopt is None:
        return False
    return bool(mallopt(MMAP_THRESHOLD, 256 << 10) == 1)
