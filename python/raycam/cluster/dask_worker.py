"""What a Dask worker does for a job. Imported by nobody without Dask."""

from __future__ import annotations

import os
import signal
from pathlib import Path

from distributed import get_worker

from ..io import atomic_files
from ..jobs import worker
from ..jobs.worker import Made, NoPackage, Task, Unfit

__all__ = ["dask_setup", "has_package", "keep_package", "make"]

KEPT = 4  # packages on the disk of a worker, which may live for many jobs


def dask_setup(worker: object) -> None:
    """Called by a worker of `local:N` as it starts: Ctrl-C reaches all of a terminal, and the parent decides."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def make(task: Task) -> Made:
    """Makes a frame as `worker.make` does; an `Unfit` says in `worker` which one this is."""
    try:
        return worker.make(task)
    except Unfit as fault:
        fault.worker = get_worker().address
        raise


def has_package(task: Task) -> bool:
    """Whether this worker has or finds the package of a job; raises `Unfit` where it could do nothing with it."""
    try:
        worker.fetch(task)
    except NoPackage:
        return False
    return True


def keep_package(job: str, data: bytes) -> None:
    """Puts a package where `worker.fetch` looks for it, in a file: others may take its place in memory."""
    folder = Path(get_worker().local_directory) / "raycam"
    folder.mkdir(exist_ok=True)
    atomic_files.write(folder / job, data)
    for old in sorted(folder.iterdir(), key=os.path.getmtime)[
        :-KEPT
    ]:  # whose job still goes on asks for it again
        old.unlink()
    if folder not in worker.PLACES:
        worker.PLACES.append(folder)
