"""Pools of workers that render the frames of a job.

The workers are this process, other processes, or a cluster. All pools give the same frames, byte for byte: a
frame is a function of the job's package and its number. Workers return the bytes to the process that called
`Job.run`, and only that process writes final files.
"""

from __future__ import annotations

import contextlib
import os
import threading
from collections import Counter
from collections.abc import Callable
from concurrent.futures import Executor, Future, ThreadPoolExecutor

from ..arguments import as_number, whole
from ..errors import Notice
from ..io.temp_stream import TempStream
from ..jobs.job_package import JobPackage
from ..jobs.scheduler import MAX_ATTEMPTS, Pool, PoolLost
from ..jobs.worker import FrameResult, FrameTask, WorkerUnfit, cache_package, clear_cache, render_frame
from ..notices import warn
from .dask_pool import connect
from .process_pool import ProcessPool

__all__ = ["ExecutorPool", "InProcessPool", "make_pool"]


def make_pool(
    where: int | str | Executor | Callable[[], Executor] | None = None,
    *,
    threads: int | None = None,
    tell: Callable[[Notice], object] = warn,
) -> contextlib.AbstractContextManager[Pool]:
    """Returns a context manager with a pool of workers for `Job.run`.

    `where` is one of these:

    * None: this process
    * a number: this many processes on this machine, or fewer if memory is insufficient; a worker that dies does not
      affect other workers
    * "local:N": a Dask cluster of N processes on this machine
    * "tcp://HOST:PORT" or "tls://HOST:PORT": the Dask cluster of the scheduler at this address
    * an `Executor` of `concurrent.futures`, which stays open, or a function that creates an executor and is called
      again if the executor breaks. Its workers import this version of raycam. They read the package from the job's
      folder; a worker without access to the folder receives the package with its frame.

    `threads` is the number of threads per worker; None divides the cores, if their number is known. `tell` is called
    immediately with urgent notices, such as a cluster without workers.

    Raises `SettingsError` for anything else, and if Dask is not installed.
    """
    if where is None:
        return contextlib.closing(InProcessPool(threads))
    if isinstance(where, bool) or as_number(where) is not None:
        return contextlib.closing(ProcessPool(whole("workers", where, 1), threads))
    if isinstance(where, str):
        return contextlib.closing(connect(where, threads, tell))
    return contextlib.closing(ExecutorPool(where, threads=threads))  # type: ignore[arg-type]


class InProcessPool:
    """Renders in this process, one frame after the other on all `threads`.

    While a frame is rendered, the previous frame is encoded.
    """

    apart = False
    notices: tuple[Notice, ...] = ()

    def __init__(self, threads: int | None = None) -> None:
        self._threads = threads
        self._executor = ThreadPoolExecutor(2, "raycam-frame")
        self._stopped = threading.Event()

    def open(self, package: JobPackage, path: str) -> None:
        """Caches the package and its world."""
        cache_package(package)

    def threads(self, left: int) -> int | None:
        """Returns the number of threads per frame that was given to this pool, or None (all)."""
        return self._threads

    def submit(self, task: FrameTask) -> Future[FrameResult]:
        """Starts a frame on a thread of this process."""
        folder = os.path.dirname(task.package)  # the job's folder, which is on the disk of the results
        return self._executor.submit(
            render_frame, task, self._check_stopped, None, lambda pieces: TempStream(folder, pieces)
        )

    def _check_stopped(self, done: int, total: int) -> None:
        if self._stopped.is_set():
            raise PoolLost("stopped")

    def slots(self) -> int:
        """Returns the number of frames that may be queued: 3.

        One frame is rendered, one is encoded, and one waits.
        """
        return 3

    def close(self) -> None:
        """Stops the current rendering within a fraction of a second."""
        self._stopped.set()
        self._executor.shutdown(cancel_futures=True)
        clear_cache()


class ExecutorPool:
    """Renders on a `concurrent.futures.Executor`, or on executors from a function.

    The function is called again after each failure.
    """

    apart = True
    notices: tuple[Notice, ...] = ()

    def __init__(
        self, executor: Executor | Callable[[], Executor], slots: int = 8, threads: int | None = None
    ) -> None:
        self._threads = threads
        self._make = None if isinstance(executor, Executor) else executor
        self._executor = executor if isinstance(executor, Executor) else executor()
        self._slots = slots
        self._unfit: Counter[int] = Counter()
        self._reason = ""

    def open(self, package: JobPackage, path: str) -> None:
        """Keeps the package for workers that do not find it in the job's folder."""
        self._package = package

    def threads(self, left: int) -> int | None:
        """Returns the number of threads per frame that was given to this pool, or None (all)."""
        return self._threads

    def submit(self, task: FrameTask) -> Future[FrameResult]:
        """Starts a frame, together with the package if a worker did not find it."""
        asked_before = self._unfit[task.frame]
        if asked_before >= MAX_ATTEMPTS:
            raise PoolLost(self._reason)
        data = self._package.to_bytes() if asked_before else None
        try:
            future = self._executor.submit(render_frame, task, None, data)
        except RuntimeError:  # includes BrokenExecutor
            if self._make is None:
                raise
            self._executor = self._make()
            future = self._executor.submit(render_frame, task, None, data)
        future.add_done_callback(lambda done: self._collect_result(task, done))
        return future

    def _collect_result(self, task: FrameTask, done: Future[FrameResult]) -> None:
        fault = None if done.cancelled() else done.exception()
        if isinstance(fault, WorkerUnfit):
            self._reason = str(fault)
            self._unfit[task.frame] += 1

    def slots(self) -> int:
        """The number of frames that may be queued, as given to the constructor."""
        return self._slots

    def close(self) -> None:
        """Shuts down an executor that this pool created.

        An executor passed by the caller stays open.
        """
        if self._make is not None:
            self._executor.shutdown(wait=False, cancel_futures=True)
