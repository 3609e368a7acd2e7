"""Registry of the workers of a Dask cluster that can render the frames of a job.

Every new worker is probed. A worker may lack raycam, have another version, or have no access to the job's folder; in
the last case the package is sent through the scheduler. The probe for raycam comes first, because a task that a worker
cannot unpickle looks to Dask like a broken connection and ends the worker.
"""

from __future__ import annotations

import importlib
import threading
import warnings
from collections import deque
from collections.abc import Callable, Iterable
from typing import Any

from ..jobs.job_package import JobPackage
from ..jobs.scheduler import PoolLost
from ..jobs.worker import FrameTask
from . import dask_worker

__all__ = ["WorkerRegistry"]

MAX_CONCURRENT_SENDS = 4
"""Limit of simultaneous transfers of the package: the scheduler holds a copy for each transfer."""


class WorkerRegistry:
    """The workers of a client that can render the frames of a package in the file `path`.

    `unfit(address, reason)` is called for each worker that cannot render them.
    """

    def __init__(
        self, client: Any, package: JobPackage, path: str, unfit: Callable[[str, str], object]
    ) -> None:
        self._client, self._package, self._unfit = client, package, unfit
        self._task = FrameTask(package.id, path, 0)
        self._changed = threading.Condition()
        self._fit: set[str] = set()
        self._why_not: dict[str, str] = {}
        self._without_package: deque[str] = deque()
        # Futures are kept because Dask cancels a task without references.
        self._probing: dict[str, Any] = {}
        self._sending: dict[str, Any] = {}

    def poll(self, addresses: Iterable[str]) -> None:
        """Sets the current workers to `addresses`, and probes new workers."""
        there = set(addresses)
        with self._changed:
            self._fit &= there
            self._without_package = deque(address for address in self._without_package if address in there)
            for some in (self._why_not, self._probing, self._sending):
                for gone in some.keys() - there:
                    del some[gone]
            known = self._fit.union(self._without_package, self._why_not, self._probing, self._sending)
            for address in sorted(there - known):
                self._probe(address)
            self._send_package()

    def forget(self, address: str) -> None:
        """Removes a worker that was reported as unfit, so that the next `poll` probes it again."""
        with self._changed:
            self._fit.discard(address)

    def fit(self, patience: float) -> list[str]:
        """The addresses of fit workers; waits up to `patience` seconds for a first worker.

        Raises `PoolLost` if none of the workers can render a frame.
        """
        with self._changed:
            self._changed.wait_for(lambda: self._fit or not self._is_open(), patience)
            if self._why_not and not self._fit and not self._is_open():
                raise PoolLost("; ".join(f"{where}: {why}" for where, why in self._why_not.items()))
            return sorted(self._fit)

    def wait(self, patience: float) -> None:
        """Waits up to `patience` seconds until all workers have been probed and have the package."""
        with self._changed:
            self._changed.wait_for(lambda: not self._is_open(), patience)

    def _is_open(self) -> bool:
        return bool(self._probing or self._without_package or self._sending)

    def _probe(self, address: str) -> None:
        """Probes a worker for raycam, and then for the package."""

        def further(_: Any) -> None:
            self._start(self._probing, address, sort, dask_worker.has_package, self._task)

        def sort(answer: Any) -> None:
            (self._fit.add if answer.result() else self._without_package.append)(address)

        self._start(self._probing, address, further, importlib.import_module, dask_worker.__name__)

    def _send_package(self) -> None:
        """Sends the package to workers that lack it, at most `MAX_CONCURRENT_SENDS` at a time."""
        while self._without_package and len(self._sending) < MAX_CONCURRENT_SENDS:
            self._send_package_to(self._without_package.popleft())

    def _send_package_to(self, address: str) -> None:
        with warnings.catch_warnings():
            # Each worker receives the package once, as part of a task, so this large task is intended.
            warnings.filterwarnings("ignore", "Sending large graph")
            self._start(
                self._sending, address, lambda _: self._fit.add(address),
                dask_worker.keep_package, self._task.job, self._package.to_bytes(),
            )  # fmt: skip

    def _start(
        self,
        under_way: dict[str, Any],
        address: str,
        then: Callable[[Any], object],
        work: Callable[..., object],
        *data: Any,
    ) -> None:
        """Runs a function on a worker, and calls `then(future)` when it has finished."""
        future = self._client.submit(work, *data, workers=[address], pure=False, retries=0, priority=1)
        under_way[address] = future
        future.add_done_callback(lambda _: self._collect_answer(under_way, address, future, then))

    def _collect_answer(
        self, under_way: dict[str, Any], address: str, future: Any, then: Callable[[Any], object]
    ) -> None:
        from distributed import KilledWorker

        with self._changed:
            # The worker has left in the meantime.
            if address not in under_way or under_way[address] is not future:
                return
            del under_way[address]
            fault = future.exception() if future.status == "error" else None
            if future.status == "finished":
                then(future)
            elif fault is not None and not isinstance(fault, KilledWorker):  # `poll` detects dead workers
                reason = f"{type(fault).__name__}: {fault}".partition("\n")[0]
                self._why_not[address] = reason
                self._unfit(address, reason)
            self._send_package()
            self._changed.notify_all()
