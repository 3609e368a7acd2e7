"""The worker's side of a job: fetch the package once, make the frames that are asked for.

A task is data: which job by its hash, where its package lies, which frame. Nothing that a task says is run as code:
what to do is a row of `KINDS`. Frames are pure functions of their package, so whether a frame is made once or twice,
by this worker or another, gives the same bytes; and a worker never writes a final file, it hands the bytes back.
"""

from __future__ import annotations

import importlib
import os
import threading
import time
from collections import OrderedDict
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from .errors import JobError, nearest
from .package import Package

__all__ = ["KINDS", "Made", "Task", "keep", "make"]

Progress = Callable[[int, int], object]
Files = Mapping[str, bytes]
Maker = Callable[[int, Progress | None], tuple[Files, list[str]]]
"""`maker(number, progress)` gives the files of a frame, by name, and notices. It hands `progress` to
`raycam.render`, which is how a frame is stopped half way."""

KINDS = {"picture": "raycam.tiles", "video": "raycam.video", "dataset": "raycam.dataset.units"}
"""Kind of job: the module whose `maker(world, settings, threads)` gives a `Maker`."""

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
    """Bytes by name."""
    notices: list[str]
    """What the one who looks at it should know."""
    seconds: float
    """How long it took."""


_jobs: OrderedDict[tuple[str, int | None], Maker] = OrderedDict()
_packages: OrderedDict[str, Package] = OrderedDict()
_lock = threading.Lock()


def make(task: Task, progress: Progress | None = None) -> Made:
    """Makes a frame; what it needs of the job is fetched at the first one and kept.

    Raises what making the frame raises, and `JobError` where there is no such job to be found from here.
    """
    maker = _maker(task)
    start = time.perf_counter()
    files, notices = maker(task.frame, progress)
    return Made(task.frame, dict(files), list(notices), time.perf_counter() - start)


def keep(package: Package) -> None:
    """Remembers a package that is here already."""
    with _lock:
        _packages[package.id] = package
        while len(_packages) > KEPT:
            _packages.popitem(last=False)


def forget() -> None:
    """Lets go of everything that is remembered."""
    with _lock:
        _packages.clear()
        _jobs.clear()


def _maker(task: Task) -> Maker:
    key = (task.job, task.threads)
    with _lock:  # others wait for the first one: the world is fetched and built once
        maker = _jobs.get(key)
        if maker is None:
            package = _packages.get(task.job) or _fetch(task)
            if package.kind not in KINDS:
                raise JobError(nearest("kind of job", package.kind, list(KINDS)))
            module: Any = importlib.import_module(KINDS[package.kind])
            maker = _jobs[key] = module.maker(package.world, package.settings, task.threads)
            while len(_jobs) > KEPT:
                _jobs.popitem(last=False)
        else:
            _jobs.move_to_end(key)
        return maker


def _fetch(task: Task) -> Package:
    """The package from where the task says that it lies, or from `PLACES`; kept, for tasks with other threads."""
    candidates = [Path(task.package), *(place / task.job for place in PLACES)]
    for path in candidates:
        try:
            data = path.read_bytes()
        except OSError:
            continue
        package = _packages[task.job] = Package.from_bytes(data, str(path), task.job)
        while len(_packages) > KEPT:
            _packages.popitem(last=False)
        return package
    raise JobError(
        f"no job {task.job[:12]} at {task.package} seen from {os.uname().nodename}: put the job's folder where every "
        "worker reads it under the same name"
    )
