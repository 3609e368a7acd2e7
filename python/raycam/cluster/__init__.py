"""Where the frames of a job are made: in this process, in others on this machine, or on a cluster.

`make_pool` chooses. Whatever it is, the frames come out the same, byte for byte: they are functions of the job's
package and their number, and the bytes come back to the one process that writes final files.
"""

from __future__ import annotations

import contextlib
import os
import threading
import warnings
from collections import Counter
from collections.abc import Callable
from concurrent.futures import Executor, Future, ThreadPoolExecutor

from ..errors import SettingsError
from ..io.temp_stream import TempStream
from ..jobs.job_package import JobPackage
from ..jobs.scheduler import MAX_ATTEMPTS, Pool, PoolLost
from ..jobs.worker import FrameResult, FrameTask, WorkerUnfit, cache_package, clear_cache, render_frame
from .dask_pool import connect
from .process_pool import ProcessPool

__all__ = ["ExecutorPool", "InProcessPool", "make_pool"]


def make_pool(
    where: int | str | Executor | Callable[[], Executor] | None = None,
    *,
    threads: int | None = None,
    tell: Callable[[str], object] = warnings.warn,
) -> contextlib.AbstractContextManager[Pool]:
    """The workers for `Job.run`, to be closed by `with`.

    * None: this process.
    * a number: so many processes on this machine, fewer where memory is short. One that dies takes no other along.
    * "local:N": a Dask cluster of N processes on this machine.
    * "tcp://HOST:PORT", "tls://HOST:PORT": the Dask cluster of the scheduler there.
    * an `Executor` of `concurrent.futures`, which stays open, or a function that makes one, called again where one
      breaks. Its workers import this version of raycam; the package of the job is read from the job's folder, and
      comes along with a frame to a worker that does not see it.

    `threads` is how many threads a worker renders with; None shares out the cores where they are known. `tell` is told
    at once of what cannot wait for `Pool.notices`: that a cluster has no workers, and is waited for.

    Raises `SettingsError` for anything else, and where Dask is not installed.
    """
    if where is None:
        return contextlib.closing(InProcessPool(threads))
    if isinstance(where, bool) or (isinstance(where, int) and where < 1):
        raise SettingsError(f"workers must be a whole number >= 1, not {where!r}")
    if isinstance(where, int):
        return contextlib.closing(ProcessPool(where, threads))
    if isinstance(where, str):
        return contextlib.closing(connect(where, threads, tell))
    return contextlib.closing(ExecutorPool(where, threads=threads))


class InProcessPool:
    """This process, a frame after the other on all `threads`; files of one are encoded while the next is rendered."""

    apart = False
    notices: tuple[str, ...] = ()

    def __init__(self, threads: int | None = None) -> None:
        self._threads = threads
        self._executor = ThreadPoolExecutor(2, "raycam-frame")
        self._stopped = threading.Event()

    def open(self, package: JobPackage, path: str) -> None:
        """Remembers the package, whose world is here."""
        cache_package(package)

    def threads(self, left: int) -> int | None:
        """As was said: frames share them."""
        return self._threads

    def submit(self, task: FrameTask) -> Future[FrameResult]:
        """Starts a frame."""
        folder = os.path.dirname(task.package)  # the job's own, on the disk where its results will lie
        return self._executor.submit(
            render_frame, task, self._check_stopped, None, lambda pieces: TempStream(folder, pieces)
        )

    def _check_stopped(self, done: int, total: int) -> None:
        if self._stopped.is_set():
            raise PoolLost("stopped")

    def slots(self) -> int:
        """One frame waits, for there to be always something to do."""
        return 3

    def close(self) -> None:
        """Stops what is being rendered, within a fraction of a second."""
        self._stopped.set()
        self._executor.shutdown(cancel_futures=True)
        clear_cache()


class ExecutorPool:
    """Any `concurrent.futures.Executor`, or a function that makes one, called again where one breaks."""

    apart = True
    notices: tuple[str, ...] = ()

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
        """Workers fetch the package by themselves; here it is for those that do not find it."""
        self._package = package

    def threads(self, left: int) -> int | None:
        """As was said."""
        return self._threads

    def submit(self, task: FrameTask) -> Future[FrameResult]:
        """Starts a frame, with the package where a worker did not find it."""
        asked_before = self._unfit[task.frame]
        if asked_before >= MAX_ATTEMPTS:
            raise PoolLost(self._reason)
        data = self._package.to_bytes() if asked_before else None
        try:
            future = self._executor.submit(render_frame, task, None, data)
        except RuntimeError:  # a BrokenExecutor is one
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
        """As was said."""
        return self._slots

    def close(self) -> None:
        """Ends an executor that was made here; one that was given stays open."""
        if self._make is not None:
            self._executor.shutdown(wait=False, cancel_futures=True)


pool_of = make_pool
"""Former name of `make_pool`, kept for one release."""
