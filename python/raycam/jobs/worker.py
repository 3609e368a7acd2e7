"""The worker's side of a job: fetch the package once, make the frames that are asked for.

A task is data: the job by its hash, the place of its package, the frame. Nothing in a task is run as code: the kind of
the job is looked up in `jobs.kinds`. Frames are pure functions of their package, so a frame that is made twice, by this
worker or another, has the same bytes. A worker never writes a final file; it returns the bytes.
"""

from __future__ import annotations

import platform
import threading
import time
from collections import OrderedDict
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import NamedTuple

from ..errors import FormatError, JobError
from ..io.temp_stream import Piece, TempStream
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
"""What becomes of a file in pieces: `b"".join`, or a `TempStream`."""

MAX_CACHED = 2  # jobs that a worker remembers
PACKAGE_PATHS: list[Path] = []
"""Folders where packages lie that came another way than through the job's own folder."""


class FrameTask(NamedTuple):
    """One frame to make."""

    job: str
    """The `JobPackage.id`."""
    package: str
    """Where the package lies."""
    frame: int
    """Which frame."""
    threads: int | None = None
    """How many threads to use: it changes the speed alone."""


class FrameResult(NamedTuple):
    """A frame that was made."""

    frame: int
    """Its number."""
    files: Files
    """Bytes by name, or where they lie."""
    notices: list[str]
    """What the one who looks at it should know."""
    seconds: float
    """How long it took."""


class WorkerUnfit(Exception):
    """This worker cannot make frames of the job; another one may. It is no fault of the frame."""

    worker: str | None = None
    """Where it is, as its engine calls it."""


class PackageNotFound(WorkerUnfit):
    """The package of the job is not to be found from here."""


_frame_makers: OrderedDict[tuple[str, int | None], FrameMaker] = OrderedDict()
_packages: OrderedDict[str, JobPackage] = OrderedDict()
_lock = threading.Lock()


def render_frame(
    task: FrameTask,
    progress: Progress | None = None,
    package: bytes | None = None,
    gather: GatherPieces = b"".join,
) -> FrameResult:
    """Makes a frame; what it needs of the job is fetched at the first one and kept, or comes along as `package`.

    `gather` takes each file that is made in pieces. Raises what making the frame raises, and `WorkerUnfit` as
    `load_package` does.
    """
    if package is not None:
        cache_package(_read_package(package, "the package that came along", task.job))
    maker = _cached_frame_maker(task)
    start = time.perf_counter()
    made, notices = maker(task.frame, progress)
    files = {name: data if isinstance(data, bytes) else gather(data) for name, data in made.items()}
    return FrameResult(task.frame, files, list(notices), time.perf_counter() - start)


def cache_package(package: JobPackage) -> None:
    """Remembers a package that is here already."""
    with _lock:
        _cache_package(package)


def load_package(task: FrameTask) -> JobPackage:
    """The package of a task: one that is kept, or from where the task says that it lies, or from `PACKAGE_PATHS`.

    It is kept, for tasks with other threads. Raises `PackageNotFound` where it is in none of them, and `WorkerUnfit`
    where another version of raycam has made it.
    """
    with _lock:  # others wait for the first one: the world is fetched once
        return _load_package(task)


def clear_cache() -> None:
    """Lets go of everything that is remembered."""
    with _lock:
        _packages.clear()
        _frame_makers.clear()


def _cached_frame_maker(task: FrameTask) -> FrameMaker:
    key = (task.job, task.threads)
    with _lock:  # and built once
        maker = _frame_makers.get(key)
        if maker is None:
            package = _load_package(task)
            maker = frame_maker(package.kind, package.world, package.settings, task.threads)
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
    """See `load_package`."""
    if task.job in _packages:
        return _packages[task.job]
    strange = ""
    for path in (Path(task.package), *(place / task.job for place in PACKAGE_PATHS)):
        try:
            package = _read_package(path.read_bytes(), str(path), task.job)
        except OSError:
            continue
        except FormatError as fault:  # damaged, or another job's on the disk of this machine
            strange = f" ({fault})"
        else:
            _cache_package(package)
            return package
    raise PackageNotFound(
        f"no job {task.job[:12]} at {task.package} seen from {platform.node()}{strange}: put the job's folder where "
        "every worker reads it under the same name"
    )


def _read_package(data: bytes, name: str, job: str) -> JobPackage:
    try:
        return JobPackage.from_bytes(data, name, job)
    except JobError as fault:
        raise WorkerUnfit(f"{fault} (seen from {platform.node()})") from None
