"""Atomic writing of files: a file with its final name is complete."""

from __future__ import annotations

import contextlib
import errno
import os
import re
from collections.abc import Iterable, Iterator
from pathlib import Path

from .file_lock import try_lock
from .system_calls import BINARY, sync

__all__ = ["atomic_path", "check_writable", "make_folder", "sync", "with_path", "write"]

PLACEHOLDER = b"not written yet\n"
"""The contents of a temporary file before anything is written to it."""


@contextlib.contextmanager
def atomic_path(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Yields a temporary path beside `path`; the file there is renamed to `path` when the block ends.

    The file is synced, renamed over `path`, and the folder is synced, so that `path` is complete even after a crash. If
    the block raises, the temporary file is removed and an existing `path` is kept. The temporary name begins with a dot
    and has the ending of `path`. Temporary files that a killed process has left are removed.

    Raises the `OSError`s of `check_writable` and of the disk.
    """
    target = os.fspath(path)
    with _atomic(target) as (temporary, file):
        os.write(file, PLACEHOLDER)
        yield Path(temporary)
        if Path(temporary).stat().st_size == len(PLACEHOLDER) and Path(temporary).read_bytes() == PLACEHOLDER:
            raise FileNotFoundError(errno.ENOENT, "nothing was written", target)


def _remove_stale_temp_files(target: str) -> None:
    """Removes the temporary files of a target that no living process has locked, as far as the disk allows."""
    folder, name = os.path.split(target)
    stem, ending = os.path.splitext(name)
    temporary = re.compile(rf"\.{re.escape(stem)}\.[0-9a-f]{{8}}{re.escape(ending)}")
    names = (other for other in os.listdir(folder or os.curdir) if other.startswith(f".{stem}."))
    for other in filter(temporary.fullmatch, names):
        with contextlib.suppress(OSError):
            path = os.path.join(folder, other)
            file = os.open(path, os.O_RDWR)
            try:
                stale = try_lock(file)
                if stale and os.name != "nt":
                    os.unlink(path)
            finally:
                os.close(file)
            if stale and os.name == "nt":  # Windows cannot remove an open file
                os.unlink(path)


def _create_temporary(target: str, folder: str) -> tuple[str, int]:
    """A new temporary file of a target, its path and descriptor, locked: one without a lock belongs to a dead process.

    Another process that removes stale files may meet it before it is locked, and remove it; then there is a next one.
    """
    stem, ending = os.path.splitext(os.path.basename(target))
    while True:
        temporary = os.path.join(folder, f".{stem}.{os.urandom(4).hex()}{ending}")
        with with_path(target, temporary):
            file = os.open(temporary, os.O_RDWR | os.O_CREAT | os.O_EXCL | BINARY, 0o666)
            try:
                if (try_lock(file) or os.name == "nt") and os.fstat(file).st_nlink > 0:
                    return temporary, file  # Windows removes no open file
            except BaseException:
                os.unlink(temporary)
                os.close(file)
                raise
            os.close(file)


@contextlib.contextmanager
def _atomic(target: str, scratch: str | None = None) -> Iterator[tuple[str, int]]:
    """Yields the temporary path and its open file; see `atomic_path`.

    Paths are strings: pathlib interns the parts of every name, and a long job has very many names.
    """
    check_writable(target)
    folder = os.path.dirname(target)
    if scratch is None:
        with with_path(target):
            _remove_stale_temp_files(target)
    temporary, file = _create_temporary(target, scratch or folder)
    try:
        with with_path(target, temporary), contextlib.ExitStack() as opened:
            opened.callback(os.close, file)
            yield temporary, file
            sync(temporary)
            # A rename keeps the mode of the new file. Replacing a file must not change its permissions.
            if os.path.exists(target):
                os.chmod(temporary, os.stat(target).st_mode & 0o7777)
            if os.name == "nt":  # Windows cannot rename an open file
                opened.close()
            os.replace(temporary, target)
    except BaseException:
        with contextlib.suppress(FileNotFoundError):
            os.unlink(temporary)
        raise
    sync(folder or os.curdir)


@contextlib.contextmanager
def with_path(path: str | os.PathLike[str], instead_of: str | None = None) -> Iterator[None]:
    """Adds `path` to `OSError`s of the block that name no file, or `instead_of`."""
    try:
        yield
    except OSError as fault:
        if fault.errno is None or fault.filename not in (None, instead_of):
            raise
        # A new exception, because the file name of PyAV's errors is read-only.
        raise OSError(fault.errno, fault.strerror, os.fspath(path)) from fault


def write(
    path: str | os.PathLike[str],
    data: bytes | Iterable[bytes],
    scratch: str | os.PathLike[str] | None = None,
) -> None:
    """Writes a whole file, from bytes or pieces, atomically as `atomic_path` does.

    `scratch` is another folder on the same disk for the temporary file, which the caller cleans up after a crash.
    """
    with _atomic(os.fsdecode(path), None if scratch is None else os.fsdecode(scratch)) as (_, file):
        for piece in (data,) if isinstance(data, bytes) else data:
            rest = memoryview(piece)
            while rest:
                rest = rest[os.write(file, rest) :]


def check_writable(path: str | os.PathLike[str], size: int = 0) -> None:
    """Checks, before long work, that a file of about `size` bytes can be written to `path`.

    Raises `FileNotFoundError` or `NotADirectoryError` if there is no such folder, `IsADirectoryError` if `path` is a
    folder, `PermissionError` if the folder is not writable, and `OSError` (ENOSPC) if the disk has too little space.
    """
    target = os.fspath(path)
    folder, name = os.path.split(target)
    folder = folder or os.curdir
    if not name or os.path.isdir(target):
        raise IsADirectoryError(errno.EISDIR, "this is a folder, expected the name of a file", target)
    if not os.path.exists(folder):
        raise FileNotFoundError(
            errno.ENOENT, f"there is no folder {folder!r} to write to; make it first", target
        )
    if not os.path.isdir(folder):
        raise NotADirectoryError(errno.ENOTDIR, f"{folder!r} is a file, not a folder", target)
    if not os.access(folder, os.W_OK | os.X_OK):
        raise PermissionError(errno.EACCES, f"the folder {folder!r} may not be written to", target)
    from shutil import disk_usage  # imported here: `import raycam` does not wait for it

    free = disk_usage(folder).free
    # An empty file needs a block too.
    if free < max(size, 1):
        text = f"has {free} bytes free, about {size} are needed" if size else "is full"
        raise OSError(errno.ENOSPC, f"the disk {text}", target)


def make_folder(folder: Path) -> None:
    """Creates a folder and its parents, and syncs its directory entry.

    Raises `OSError` from the disk.
    """
    folder.mkdir(parents=True, exist_ok=True)
    sync(folder.parent)
