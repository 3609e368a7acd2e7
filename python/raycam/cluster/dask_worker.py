"""What a Dask worker does for a job. Imported by nobody without Dask."""

from __future__ import annotations

import os
import signal
from pathlib import Path

from distributed import get_worker

from ..io import atomic_files
from ..jobs import worker
from ..jobs.worker import FrameResult, FrameTask, PackageNotFound, WorkerUnfit

__all__ = ["dask_setup", "has_package", "keep_package", "render_frame"]

MAX_PACKAGES = 4  # packages on the disk of a worker, which may live for many jobs


def dask_setup(worker: object) -> None:
    """Called by a worker of `local:N` as it starts: Ctrl-C reaches all of a terminal, and the parent decides."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def render_frame(task: FrameTask) -> FrameResult:
    """Makes a frame as `worker.make` does; an `WorkerUnfit` says in `worker` which one this is."""
    try:
        return worker.render_frame(task)
    except WorkerUnfit as fault:
        fault.worker = get_worker().address
        raise


def has_package(task: FrameTask) -> bool:
    """Whether this worker has or finds the package of a job; raises `WorkerUnfit` where it could do nothing with it."""
    try:
        worker.load_package(task)
    except PackageNotFound:
        return False
    return True


def keep_package(job: str, data: bytes) -> None:
    """Puts a package where `worker.fetch` looks for it, in a file: others may take its place in memory."""
    folder = Path(get_worker().local_directory) / "raycam"
    folder.mkdir(exist_ok=True)
    atomic_files.write(folder / job, data)
    for old in sorted(folder.iterdir(), key=os.path.getmtime)[
        :-MAX_PACKAGES
    ]:  # whose job still goes on asks for it again
        old.unlink()
    if folder not in worker.PACKAGE_PATHS:
        worker.PACKAGE_PATHS.append(folder)
