"""The one way a file is written: a final name means a complete file."""

from __future__ import annotations

import contextlib
import errno
import os
import re
import secrets
import shutil
from collections.abc import Iterable, Iterator
from pathlib import Path

from .file_lock import try_lock

__all__ = ["atomic_path", "check_writable", "make_folder", "sync", "with_path", "write"]

PLACEHOLDER = b"not written yet\n"
"""What is in a temporary file until something is written to it."""


@contextlib.contextmanager
def atomic_path(path: str | os.PathLike[str]) -> Iterator[Path]:
    """A temporary path beside `path`, which becomes `path` when the block ends.

    The file written there is synced to the disk, renamed over `path`, and the folder is synced: whoever sees
    `path` sees all of it, after a crash too. When the block raises, nothing is left behind and an existing
    file stays as it was. The temporary name begins with a dot and keeps the ending of `path`; what a process that was
    killed has left under such a name is removed.

    Raises `OSError` as `check_writable` does, and whatever the disk says.
    """
    target = os.fspath(path)
    with _atomic(target) as (temporary, file):
        os.write(file, PLACEHOLDER)
        yield Path(temporary)
        if Path(temporary).stat().st_size == len(PLACEHOLDER) and Path(temporary).read_bytes() == PLACEHOLDER:
            raise FileNotFoundError(errno.ENOENT, "nothing was written", target)


def _remove_stale_temp_files(target: str) -> None:
    """Removes the temporary files of a target that no living process holds; where the disk refuses, they stay."""
    folder, name = os.path.split(target)
    stem, ending = os.path.splitext(name)
    temporary = re.compile(rf"\.{re.escape(stem)}\.[0-9a-f]{{8}}{re.escape(ending)}")
    names = (other for other in os.listdir(folder or os.curdir) if other.startswith(f".{stem}."))
    for other in filter(temporary.fullmatch, names):
        with contextlib.suppress(OSError):
            path = os.path.join(folder, other)
            file = os.open(path, os.O_RDWR)
            try:
                if try_lock(file):
                    os.unlink(path)
            finally:
                os.close(file)


@contextlib.contextmanager
def _atomic(target: str, scratch: str | None = None) -> Iterator[tuple[str, int]]:
    """See `atomic_path`; the temporary file is open. In strings: pathlib interns the parts of every name, and a long
    job has very many."""
    check_writable(target)
    folder, name = os.path.split(target)
    stem, ending = os.path.splitext(name)
    temporary = os.path.join(scratch or folder, f".{stem}.{secrets.token_hex(4)}{ending}")
    try:
        with with_path(target, temporary), contextlib.ExitStack() as opened:
            if scratch is None:
                _remove_stale_temp_files(target)
            file = os.open(temporary, os.O_RDWR | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0), 0o666)
            opened.callback(os.close, file)
            try_lock(file)  # whoever else may lock it knows that its process is dead
            yield temporary, file
            sync(temporary)
            # A rename keeps the mode of the new file; one that replaces another should not change who may read it.
            if os.path.exists(target):
                shutil.copymode(target, temporary)
            if os.name == "nt":  # where nothing that is open may be renamed
                opened.close()
            os.replace(temporary, target)
    except BaseException:
        with contextlib.suppress(FileNotFoundError):
            os.unlink(temporary)
        raise
    sync(folder or os.curdir)


@contextlib.contextmanager
def with_path(path: str | os.PathLike[str], instead_of: str | None = None) -> Iterator[None]:
    """Errors of the disk in the block that do not say of which file, or say `instead_of`, are of this one."""
    try:
        yield
    except OSError as fault:
        if fault.errno is None or fault.filename not in (None, instead_of):
            raise
        # Anew, since the errors of others, such as those of PyAV, do not let their file be changed.
        raise OSError(fault.errno, fault.strerror, os.fspath(path)) from fault


def write(
    path: str | os.PathLike[str],
    data: bytes | Iterable[bytes],
    scratch: str | os.PathLike[str] | None = None,
) -> None:
    """Writes a whole file, of bytes or of pieces, as `atomic_path` does.

    `scratch` is another folder of the same disk for the temporary file, for those who clean it up after a crash.
    """
    with _atomic(os.fspath(path), None if scratch is None else os.fspath(scratch)) as (_, file):
        for piece in (data,) if isinstance(data, bytes) else data:
            rest = memoryview(piece)
            while rest:
                rest = rest[os.write(file, rest) :]


def check_writable(path: str | os.PathLike[str], size: int = 0) -> None:
    """Whether a file of about `size` bytes can be written to `path`: asked before long work, not after.

    Raises `FileNotFoundError` or `NotADirectoryError` where there is no such folder, `IsADirectoryError` where
    `path` is a folder, `PermissionError` where the folder may not be written to, and `OSError` (ENOSPC) where
    the disk has too little room.
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
    free = shutil.disk_usage(folder).free
    # One block even for an empty file: a full disk is full for every file.
    if free < max(size, 1):
        text = f"has {free} bytes free, about {size} are needed" if size else "is full"
        raise OSError(errno.ENOSPC, f"the disk {text}", target)


def sync(path: str | os.PathLike[str]) -> None:
    """Waits until a file or a folder is on the disk."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def make_folder(folder: Path) -> None:
    """Makes a folder and those above it, and syncs its place on the disk.

    Raises `OSError` as the disk says.
    """
    folder.mkdir(parents=True, exist_ok=True)
    sync(folder.parent)
