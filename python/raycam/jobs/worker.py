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
from ..io.temp_stream import Piece, Spool
from .job_package import Package
from .kinds import FrameMaker, Progress, frame_maker

__all__ = ["Made", "NoPackage", "Task", "Unfit", "fetch", "forget", "keep", "make"]

Files = Mapping[str, bytes | Spool]
Gather = Callable[[Iterable[Piece]], bytes | Spool]
"""What becomes of a file in pieces: `b"".join`, or a `Spool`."""

KEPT = 2  # jobs that a worker remembers
PLACES: list[Path] = []
"""Folders where packages lie that came another way than through the job's own folder."""


class Task(NamedTuple):
    """One frame to make."""

    job: str
    """The `Package.id`."""
    package: str
    """Where the package lies."""
    frame: int
    """Which frame."""
    threads: int | None = None
    """How many threads to use: it changes the speed alone."""


class Made(NamedTuple):
    """A frame that was made."""

    frame: int
    """Its number."""
    files: Files
    """Bytes by name, or where they lie."""
    notices: list[str]
    """What the one who looks at it should know."""
    seconds: float
    """How long it took."""


class Unfit(Exception):
    """This worker cannot make frames of the job; another one may. It is no fault of the frame."""

    worker: str | None = None
    """Where it is, as its engine calls it."""


class NoPackage(Unfit):
    """The package of the job is not to be found from here."""


_jobs: OrderedDict[tuple[str, int | None], FrameMaker] = OrderedDict()
_packages: OrderedDict[str, Package] = OrderedDict()
_lock = threading.Lock()


def make(
    task: Task,
    progress: Progress | None = None,
    package: bytes | None = None,
    gather: Gather = b"".join,
) -> Made:
    """Makes a frame; what it needs of the job is fetched at the first one and kept, or comes along as `package`.

    `gather` takes each file that is made in pieces. Raises what making the frame raises, and `Unfit` as `fetch` does.
    """
    if package is not None:
        keep(_read(package, "the package that came along", task.job))
    maker = _maker(task)
    start = time.perf_counter()
    made, notices = maker(task.frame, progress)
    files = {name: data if isinstance(data, bytes) else gather(data) for name, data in made.items()}
    return Made(task.frame, files, list(notices), time.perf_counter() - start)


def keep(package: Package) -> None:
    """Remembers a package that is here already."""
    with _lock:
        _keep(package)


def fetch(task: Task) -> Package:
    """The package of a task: one that is kept, or from where the task says that it lies, or from `PLACES`.

    It is kept, for tasks with other threads. Raises `NoPackage` where it is in none of them, and `Unfit` where another
    version of raycam has made it.
    """
    with _lock:  # others wait for the first one: the world is fetched once
        return _fetch(task)


def forget() -> None:
    """Lets go of everything that is remembered."""
    with _lock:
        _packages.clear()
        _jobs.clear()


def _maker(task: Task) -> FrameMaker:
    key = (task.job, task.threads)
    with _lock:  # and built once
        maker = _jobs.get(key)
        if maker is None:
            package = _fetch(task)
            maker = frame_maker(package.kind, package.world, package.settings, task.threads)
            _jobs[key] = maker
            while len(_jobs) > KEPT:
                _jobs.popitem(last=False)
        else:
            _jobs.move_to_end(key)
        return maker


def _keep(package: Package) -> None:
    _packages[package.id] = package
    while len(_packages) > KEPT:
        _packages.popitem(last=False)


def _fetch(task: Task) -> Package:
    """See `fetch`."""
    if task.job in _packages:
        return _packages[task.job]
    strange = ""
    for path in (Path(task.package), *(place / task.job for place in PLACES)):
        try:
            package = _read(path.read_bytes(), str(path), task.job)
        except OSError:
            continue
        except FormatError as fault:  # damaged, or another job's on the disk of this machine
            strange = f" ({fault})"
        else:
            _keep(package)
            return package
    raise NoPackage(
        f"no job {task.job[:12]} at {task.package} seen from {platform.node()}{strange}: put the job's folder where "
        "every worker reads it under the same name"
    )


def _read(data: bytes, name: str, job: str) -> Package:
    try:
        return Package.from_bytes(data, name, job)
    except JobError as fault:
        raise Unfit(f"{fault} (seen from {platform.node()})") from None
