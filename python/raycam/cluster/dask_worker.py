"""Functions that run on Dask workers; requires Dask."""

from __future__ import annotations

import os
import signal
from pathlib import Path

from distributed import get_worker

from ..io import atomic_files
from ..jobs import worker
from ..jobs.worker import FrameResult, FrameTask, PackageNotFound, WorkerUnfit

__all__ = ["dask_setup", "has_package", "keep_package", "render_frame"]

MAX_PACKAGES = 4  # packages on the disk of a worker, which may serve many jobs


def dask_setup(worker: object) -> None:
    """Makes the workers of `local:N` ignore Ctrl-C.

    Ctrl-C reaches all processes of a terminal. This function is a preload of these workers.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def render_frame(task: FrameTask) -> FrameResult:
    """Renders a frame as `worker.render_frame` does.

    If `WorkerUnfit` is raised, its attribute `worker` is the address of this worker.
    """
    try:
        return worker.render_frame(task)
    except WorkerUnfit as fault:
        fault.worker = get_worker().address
        raise


def has_package(task: FrameTask) -> bool:
    """Returns True if this worker has or finds the package of a job.

    Raises `WorkerUnfit` for a package of another version.
    """
    try:
        worker.load_package(task)
    except PackageNotFound:
        return False
    return True


def keep_package(job: str, data: bytes) -> None:
    """Stores a package in a file.

    `worker.load_package` reads this file after the memory cache has dropped the package.
    """
    folder = Path(get_worker().local_directory) / "raycam"
    folder.mkdir(exist_ok=True)
    atomic_files.write(folder / job, data)
    for old in sorted(folder.iterdir(), key=os.path.getmtime)[
        :-MAX_PACKAGES
    ]:  # if the job still runs, it sends its package again
        old.unlink()
    if folder not in worker.PACKAGE_PATHS:
        worker.PACKAGE_PATHS.append(folder)
