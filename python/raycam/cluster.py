"""Where the frames of a job are made: in this process, in others on this machine, or on a cluster.

`pool_of` chooses. Whatever it is, the frames come out the same, byte for byte.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import Executor, Future, ThreadPoolExecutor

from . import workers
from .dispatch import PoolLost
from .package import Package
from .workers import Made, Task

__all__ = ["Executors", "Here", "Processes", "pool_of"]


class Here:
    """This process: two frames at a time, so that one is rendered while the other is written.

    A frame uses all `threads`.
    """

    apart = False

    def __init__(self, threads: int | None = None) -> None:
        self.threads = threads
        """How many threads a frame is rendered with; None for all."""
        self._executor = ThreadPoolExecutor(2, "raycam-frame")
        self._stopped = threading.Event()

    def open(self, package: Package) -> None:
        """Remembers the package, whose world is here."""
        workers.keep(package)

    def submit(self, task: Task) -> Future[Made]:
        """Starts a frame."""
        return self._executor.submit(workers.make, task, self._watch)

    def _watch(self, done: int, total: int) -> None:
        if self._stopped.is_set():
            raise PoolLost("stopped")

    def slots(self) -> int:
        """One frame waits, for there to be always something to do."""
        return 3

    def close(self) -> None:
        """Stops what is being rendered, within a fraction of a second."""
        self._stopped.set()
        self._executor.shutdown(cancel_futures=True)
        workers.forget()


class Executors:
    """Any `concurrent.futures.Executor`, or a function that makes one, for those that break when a worker dies.

    Its workers import raycam, of this very version, and read the job's folder under the same name.
    """

    apart = True

    def __init__(
        self, executor: Executor | Callable[[], Executor], slots: int = 4, threads: int | None = None
    ) -> None:
        self.threads = threads
        """How many threads each worker renders with; None for all."""
        self._make = None if isinstance(executor, Executor) else executor
        self._executor = executor if isinstance(executor, Executor) else executor()
        self._slots = slots

    def open(self, package: Package) -> None:
        """Nothing: workers fetch it."""

    def submit(self, task: Task) -> Future[Made]:
        """Starts a frame."""
        try:
            return self._executor.submit(workers.make, task)
        except RuntimeError:
            if self._make is None:
                raise
            self._executor = self._make()
            return self._executor.submit(workers.make, task)

    def slots(self) -> int:
        """As was said."""
        return self._slots

    def close(self) -> None:
        """Ends an executor that was made here; one that was given stays open."""
        self._executor.shutdown(wait=False, cancel_futures=True) if self._make else None
