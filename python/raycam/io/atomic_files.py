"""Atomic writing of files: a file with its final name is complete."""

from __future__ import annotations

import contextlib
import errno
import os
import re
import stat
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from ..errors import with_code
from .file_lock import LocksUnsupportedError, try_lock
from .system_calls import BINARY, sync, sync_file, sync_folder

__all__ = ["atomic_path", "check_writable", "make_folder", "sync", "sync_folder", "with_path", "write"]

PLACEHOLDER = b"not written yet\n"
"""The contents of a temporary file before anything is written to it."""

MAX_STEM_BYTES = 100
"""Maximum number of bytes of a file's stem in its temporary name: file systems limit a name to 255 bytes."""

MAX_ENDING_BYTES = 40
"""Maximum number of bytes of an ending that a temporary name keeps."""

MAX_LOCK_ATTEMPTS = 8
"""Number of temporary files that are created until one can be locked; the last one is used without a lock."""

DISK_ERRORS = (errno.ENOSPC, errno.EDQUOT, errno.EIO, errno.EROFS, errno.EACCES)
"""Errors after which an existing file is kept: the disk is full, failing or write-protected, or access is denied."""

MAX_LINKS = 40
"""Maximum number of symbolic links followed one after another, as in Linux."""


@contextlib.contextmanager
def atomic_path(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Yields the path of a temporary file that replaces `path` when the block ends.

    The temporary file is in the same folder and has the same ending; its name begins with a dot. It is synced and
    renamed to `path`, and then the folder is synced, so that `path` is complete even after a crash. If the block
    raises, the temporary file is removed and an existing `path` is kept. Temporary files of killed processes are
    removed.

    Symbolic links are followed. Files that cannot be replaced are overwritten instead, which is not atomic. Such files
    are pipes, devices, files mounted into a container, files in a folder without write permission, and files on a file
    system that cannot rename files.

    Raises the `OSError`s of `check_writable` and of the disk.
    """
    target = os.fspath(path)
    with _atomic(target) as (temporary, file):
        os.write(file, PLACEHOLDER)
        yield Path(temporary)
        if Path(temporary).stat().st_size == len(PLACEHOLDER) and Path(temporary).read_bytes() == PLACEHOLDER:
            raise with_code(FileNotFoundError(errno.ENOENT, "nothing was written", target))


@dataclass(frozen=True)
class _Destination:
    """The file that a path leads to."""

    path: str
    """The path after symbolic links are followed."""
    is_stream: bool
    """True for a pipe, a device or an open descriptor, which can only be written to."""
    is_replaceable: bool
    """False if the contents must be copied into the existing file."""


def _find_destination(target: str) -> _Destination:
    """Follows the links of a path. Raises `OSError` (ELOOP, ENAMETOOLONG, EACCES)."""
    path = target
    for _ in range(MAX_LINKS):
        try:
            mode = os.lstat(path).st_mode
        except (FileNotFoundError, NotADirectoryError):
            return _Destination(path, is_stream=False, is_replaceable=True)
        folder = os.path.realpath(os.path.dirname(path))
        if folder == "/proc" or folder.startswith("/proc/"):  # /dev/stdout and similar names: an open file
            return _Destination(path, is_stream=True, is_replaceable=False)
        if not stat.S_ISLNK(mode):
            stream = not stat.S_ISREG(mode) and not stat.S_ISDIR(mode)
            writable = os.access(os.path.dirname(path) or os.curdir, os.W_OK | os.X_OK)
            return _Destination(path, is_stream=stream, is_replaceable=writable and not stream)
        path = os.path.join(os.path.dirname(path), os.readlink(path))
    raise with_code(OSError(errno.ELOOP, os.strerror(errno.ELOOP), target))


def _temporary_stem_and_ending(target: str) -> tuple[str, str]:
    """The stem and the ending of a target's temporary names, short enough for every file system."""
    stem, ending = os.path.splitext(os.path.basename(target))
    while len(os.fsencode(stem)) > MAX_STEM_BYTES:
        stem = stem[:-1]
    return stem, ending if len(os.fsencode(ending)) <= MAX_ENDING_BYTES else ""


def _remove_stale_temp_files(target: str) -> None:
    """Removes the temporary files of a target that no running process has locked.

    Files that cannot be removed are kept. Without file locks, a process may still be writing a file, so all
    files are kept.
    """
    folder = os.path.dirname(target)
    stem, ending = _temporary_stem_and_ending(target)
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


def _lock_if_supported(file: int) -> bool:
    """Locks an open file, and returns True if the lock was acquired.

    Returns True also on file systems without locks, where no process removes the file.
    """
    try:
        return try_lock(file)
    except LocksUnsupportedError:
        return True


def _create_temporary(target: str, folder: str) -> tuple[str, int]:
    """Creates and locks a temporary file of a target; returns its path and descriptor.

    A temporary file without a lock belongs to a dead process. Another process may therefore remove the new file before
    it is locked; the loop then creates another. Some file systems never grant a lock; the last temporary file is
    therefore used without a lock.
    """
    stem, ending = _temporary_stem_and_ending(target)
    attempts = 0
    while True:
        attempts += 1
        temporary = os.path.join(folder, f".{stem}.{os.urandom(4).hex()}{ending}")
        with with_path(target, temporary):
            file = os.open(temporary, os.O_RDWR | os.O_CREAT | os.O_EXCL | BINARY, 0o666)
            try:
                is_kept = _lock_if_supported(file) or os.name == "nt"  # Windows cannot remove an open file
                if (is_kept or attempts >= MAX_LOCK_ATTEMPTS) and os.fstat(file).st_nlink > 0:
                    return temporary, file
            except BaseException:
                os.unlink(temporary)
                os.close(file)
                raise
            os.close(file)
            with contextlib.suppress(FileNotFoundError):
                os.unlink(temporary)


@contextlib.contextmanager
def _atomic(target: str, scratch: str | None = None) -> Iterator[tuple[str, int]]:
    """Yields the temporary path and its open file; see `atomic_path`.

    Paths are strings: pathlib interns the parts of every name, and a long job has very many names.
    """
    found = _check_destination(target)
    folder = os.path.dirname(found.path)
    if found.path != target or not found.is_replaceable:
        scratch = None  # `scratch` may be on another disk
    if scratch is None and found.is_replaceable:
        with with_path(target):
            _remove_stale_temp_files(found.path)
    place = scratch or (folder if found.is_replaceable else _temporary_folder())
    temporary, file = _create_temporary(found.path, place)
    try:
        with with_path(target, temporary), contextlib.ExitStack() as opened:
            opened.callback(os.close, file)
            yield temporary, file
            sync(temporary)
            if found.is_replaceable and not found.is_stream:
                _keep_mode(found.path, temporary)
            if os.name == "nt":  # Windows cannot rename an open file
                opened.close()
            _move(temporary, found)
    except BaseException:
        _remove_temporary(temporary)
        raise
    if found.is_replaceable:
        sync_folder(folder or os.curdir)


def _temporary_folder() -> str:
    """The system's folder for temporary files."""
    from tempfile import gettempdir  # imported here, so that `import raycam` is fast

    return gettempdir()


def _keep_mode(target: str, temporary: str) -> None:
    """Gives a temporary file the permissions of the replaced file.

    The permissions are unchanged if the file system does not support permissions.
    """
    if os.path.exists(target):
        mode = os.stat(target).st_mode & 0o7777
        if os.stat(temporary).st_mode & 0o7777 != mode:
            with contextlib.suppress(OSError, NotImplementedError):
                os.chmod(temporary, mode)


def _move(temporary: str, found: _Destination) -> None:
    """Renames a temporary file to its destination.

    If the destination cannot be replaced, the contents are copied into the destination: a file that is mounted into a
    container (EBUSY), shares of object stores that cannot rename files (EPERM, ENOSYS, ...), and shares that lost the
    file's handle (ESTALE). If this fails, too, raises the first error.
    """
    failed: OSError | None = None
    if found.is_replaceable:
        try:
            os.replace(temporary, found.path)
            return
        except OSError as fault:
            if fault.errno in DISK_ERRORS:
                raise
            failed = fault
    from shutil import copyfileobj  # imported here, so that `import raycam` is fast

    try:
        with open(temporary, "rb") as source, open(found.path, "wb") as into:
            copyfileobj(source, into, 1 << 20)
            into.flush()
            if not found.is_stream:
                sync(found.path)
    except OSError as fault:
        raise failed or fault from None
    _remove_temporary(temporary)


def _remove_temporary(path: str) -> None:
    """Removes a temporary file. On file systems that cannot remove files, the file remains."""
    with contextlib.suppress(OSError):
        os.unlink(path)


@contextlib.contextmanager
def with_path(path: str | os.PathLike[str], instead_of: str | None = None) -> Iterator[None]:
    """Adds `path` to `OSError`s of the block that contain no file name.

    The file name `instead_of` is replaced by `path`, too.
    """
    try:
        yield
    except OSError as fault:
        if fault.errno is None or fault.filename not in (None, instead_of):
            raise
        # A new exception, because the file name of PyAV's errors is read-only.
        raise with_code(OSError(fault.errno, fault.strerror, os.fspath(path))) from fault


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

    A temporary file is written, synced and removed, so that quotas, read-only disks, limits of names and disks with
    errors are also detected.

    Raises `FileNotFoundError` or `NotADirectoryError` if the folder does not exist, and `IsADirectoryError` if `path`
    is a folder. Raises `PermissionError` if the folder or the existing file is write-protected. Raises `OSError` if the
    disk has too little space (ENOSPC) or does not accept the name (ENAMETOOLONG).
    """
    target = os.fspath(path)
    found = _check_destination(target, size)
    if found.is_replaceable:
        temporary, file = _create_temporary(found.path, os.path.dirname(found.path))
        try:
            with with_path(target, temporary):
                os.write(file, PLACEHOLDER)
                sync_file(file)
        finally:
            os.close(file)
            _remove_temporary(temporary)


def _check_destination(target: str, size: int = 0) -> _Destination:
    """Runs the checks of `check_writable` that create nothing.

    Returns the file that the path leads to.
    """
    if not os.path.basename(target) or os.path.isdir(target):
        raise with_code(IsADirectoryError(errno.EISDIR, "this is a folder; expected a file name", target))
    found = _find_destination(target)
    folder = os.path.dirname(found.path) or os.curdir
    if not os.path.exists(folder):
        raise with_code(
            FileNotFoundError(errno.ENOENT, f"the folder {folder!r} does not exist; create it first", target)
        )
    if not os.path.isdir(folder):
        raise with_code(NotADirectoryError(errno.ENOTDIR, f"{folder!r} is a file, not a folder", target))
    if found.is_stream:
        return found
    if os.path.exists(found.path):
        _check_not_protected(target, found)
    elif not os.access(folder, os.W_OK | os.X_OK):
        raise with_code(PermissionError(errno.EACCES, f"the folder {folder!r} is write-protected", target))
    free = _free_bytes(folder)
    # An empty file also requires free space.
    if free is not None and free < max(size, 1):
        text = f"has {free} bytes free; about {size} are needed" if size else "is full"
        raise with_code(OSError(errno.ENOSPC, f"the disk {text}", target))
    return found


def _free_bytes(folder: str) -> int | None:
    """Returns the free space in bytes.

    The result is None for file systems that do not report their size, such as some network shares.
    """
    from shutil import disk_usage  # imported here, so that `import raycam` is fast

    try:
        usage = disk_usage(folder)
    except OSError:
        return None
    return usage.free if usage.total else None


def _check_not_protected(target: str, found: _Destination) -> None:
    """Raises `PermissionError` for an existing file without write permission, also for root.

    Raises `OSError` (EROFS) for a file on a read-only file system.
    """
    if not os.stat(found.path).st_mode & 0o222:
        raise with_code(
            PermissionError(
                errno.EACCES,
                "the file is write-protected; make it writable, remove it, or choose another name",
                target,
            )
        )
    with with_path(target, found.path):
        os.close(os.open(found.path, os.O_WRONLY | BINARY))


def make_folder(folder: Path) -> None:
    """Creates a folder and its parents, and syncs its directory entry.

    Raises `OSError` from the disk.
    """
    folder.mkdir(parents=True, exist_ok=True)
    sync_folder(folder.parent)
