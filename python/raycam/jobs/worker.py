"""The worker's side of a job: loads the package once and renders the requested frames.

A task is data: the job's hash, the path of its package, the frame. Nothing in a task is run as code: the kind of the
job is looked up in `jobs.kinds`. Frames are pure functions of their package, so a frame that is rendered twice, even by
two workers, has the same bytes. A worker never writes a final file; it returns the bytes.
"""

from __future__ import annotations

import platform
import threading
import time
from collections import OrderedDict
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from pathlib import Path
from typing import NamedTuple

from ..errors import FormatError, JobError, Notice
from ..io.temp_stream import Piece, TempStream
from ..notices import collected, distinct
from .job_package import JobPackage
from .kinds import FrameMaker, Progress, frame_maker

__all__ = [
    "FrameResult",
    "FrameTask",
    "PackageNotFound",
    "WorkerUnfit",
    "cache_package",
    "clear_cache",
    "load_package",
    "render_frame",
]

Files = Mapping[str, bytes | TempStream]
GatherPieces = Callable[[Iterable[Piece]], bytes | TempStream]
"""Combines the pieces of a file: `b"".join`, or a `TempStream`."""

MAX_CACHED = 2  # jobs in a worker's cache
PACKAGE_PATHS: list[Path] = []
"""Folders with packages that were sent to this worker, which has no access to the job's own folder."""


class FrameTask(NamedTuple):
    """One frame to render."""

    job: str
    """The id of the job, `JobPackage.id`."""
    package: str
    """The path of the package."""
    frame: int
    """The frame's number."""
    threads: int | None = None
    """The number of threads, None for all; affects the speed only."""


class FrameResult(NamedTuple):
    """A rendered frame."""

    frame: int
    """The frame's number."""
    files: Files
    """The files by name: bytes, or a `TempStream`."""
    notices: list[Notice]
    """Notices for the user."""
    seconds: float
    """The rendering time in seconds."""


class WorkerUnfit(Exception):
    """This worker cannot render frames of the job, but another worker may.

    The error does not count as a failure of the frame.
    """

    worker: str | None = None
    """The worker's address in its cluster."""


class PackageNotFound(WorkerUnfit):
    """This worker cannot find the job's package."""


_frame_makers: OrderedDict[tuple[str, int | None], FrameMaker] = OrderedDict()
_packages: OrderedDict[str, JobPackage] = OrderedDict()
_lock = threading.Lock()


def render_frame(
    task: FrameTask,
    progress: Progress | None = None,
    package: bytes | None = None,
    gather: GatherPieces = b"".join,
) -> FrameResult:
    """Renders a frame, and returns its files, notices and render time.

    The package is loaded for the first frame and cached, or given as `package`. `gather` combines the pieces
    of each file that is made in pieces.

    Raises the errors of the frame, and the errors of `load_package`.
    """
    if package is not None:
        cache_package(_read_package(package, "the package sent with the frame", task.job))
    with collected() as said:  # the process that runs the job issues the notices
        maker = _cached_frame_maker(task)
        start = time.perf_counter()
        made, notices = maker(task.frame, progress)
        files = {name: data if isinstance(data, bytes) else gather(data) for name, data in made.items()}
    return FrameResult(task.frame, files, distinct([*notices, *said]), time.perf_counter() - start)


def cache_package(package: JobPackage) -> None:
    """Puts a package into the cache."""
    with _lock:
        _cache_package(package)


def load_package(task: FrameTask) -> JobPackage:
    """Returns a task's package, and caches the package.

    The package is read from the cache, the task's path, or `PACKAGE_PATHS`.

    Raises `PackageNotFound` if the package is in none of these places, and `WorkerUnfit` if another version of raycam
    created it.
    """
    with _lock:  # other threads wait, so that the world is loaded once
        return _load_package(task)


def clear_cache() -> None:
    """Empties the cache."""
    with _lock:
        _packages.clear()
        _frame_makers.clear()


def _cached_frame_maker(task: FrameTask) -> FrameMaker:
    key = (task.job, task.threads)
    with _lock:  # other threads wait, so that the world is built once
        maker = _frame_makers.get(key)
        if maker is None:
            package = _load_package(task)
            JobPackage.check_backgrounds(package.settings)
            factory = package.factory or partial(frame_maker, package.kind)
            maker = factory(package.world, package.settings, task.threads)
            _frame_makers[key] = maker
            while len(_frame_makers) > MAX_CACHED:
                _frame_makers.popitem(last=False)
        else:
            _frame_makers.move_to_end(key)
        return maker


def _cache_package(package: JobPackage) -> None:
    _packages[package.id] = package
    while len(_packages) > MAX_CACHED:
        _packages.popitem(last=False)


def _load_package(task: FrameTask) -> JobPackage:
    """Loads the package of a task; the caller holds the lock."""
    if task.job in _packages:
        return _packages[task.job]
    strange = ""
    for path in (Path(task.package), *(place / task.job for place in PACKAGE_PATHS)):
        try:
            package = _read_package(path.read_bytes(), str(path), task.job)
        except OSError:
            continue
        except FormatError as fault:  # damaged, or the package of another job
            strange = f" ({fault})"
        else:
            _cache_package(package)
            return package
    raise PackageNotFound(
        f"{platform.node()}: job {task.job[:12]} not found at {task.package}{strange}; place the job's "
        "folder where every worker can read it under the same path"
    )


def _read_package(data: bytes, name: str, job: str) -> JobPackage:
    try:
        return JobPackage.from_bytes(data, name, job)
    except JobError as fault:
        raise WorkerUnfit(f"{fault} (on {platform.node()})") from None
