"""Frames made by a Dask cluster: `raycam[cluster]`.

Tasks are data; the package of the job is read from the job's folder where a worker sees it, and else comes once to
the worker through the scheduler, whenever it joins. It is never scattered: scattered data is lost with the worker that
holds it. Results come back to this process; the scheduler keeps none of them.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import time
import warnings
from collections.abc import Callable
from concurrent.futures import CancelledError, Future
from ipaddress import ip_address
from typing import TYPE_CHECKING, Any
from urllib.parse import urlsplit

from .. import _core
from ..errors import SettingsError
from ..jobs.job_package import JobPackage
from ..jobs.scheduler import PoolLost, WorkerDied, shared_threads
from ..jobs.worker import FrameResult, FrameTask, WorkerUnfit

if TYPE_CHECKING:
    from .worker_registry import WorkerRegistry

__all__ = ["DaskPool", "connect"]

CONNECT_TIMEOUT = 20.0  # seconds in which a scheduler answers
ANSWER_TIMEOUT = 5.0  # seconds in which a worker says whether it can make the frames of a job
REFRESH_INTERVAL = 2.0  # seconds for which the number of workers is believed
SILENCE_TIMEOUT = (
    5.0  # seconds without a worker after which that is told; again after twice as long, and so on
)
POLL_INTERVAL = 0.2  # seconds between looks for a first one


def connect(
    address: str, threads: int | None = None, tell: Callable[[str], object] = warnings.warn
) -> DaskPool:
    """The Dask cluster at "tcp://HOST:PORT" or "tls://HOST:PORT", or with "local:N" a new one of N processes here.

    `tell` is told at once where it waits for workers.

    Raises `SettingsError` where the address is none or Dask is not installed, and `OSError` where nobody answers.
    """
    try:
        import distributed
    except ImportError:
        raise SettingsError(f"{address}: Dask is not installed; pip install 'raycam[cluster]'") from None
    kind, _, rest = address.partition(":")
    if kind == "local":
        if not rest.isdigit() or int(rest) < 1:
            raise SettingsError(f"{address!r}: expected local:N with N processes, as in local:4")
        cluster = _local(address, int(rest))
        return DaskPool(distributed.Client(cluster), threads, cluster, tell)
    if kind not in ("tcp", "tls") or not urlsplit(address).port:
        raise SettingsError(f"{address!r}: expected tcp://HOST:PORT, tls://HOST:PORT or local:N")
    try:
        return DaskPool(
            distributed.Client(address, timeout=CONNECT_TIMEOUT, set_as_default=False), threads, tell=tell
        )
    except OSError as fault:
        raise OSError(f"no Dask scheduler answers at {address}: {fault}") from None


def _local(address: str, count: int) -> Any:
    """A cluster of processes on this machine; raises `SettingsError` where the script that asks for it has no guard."""
    import dask
    import distributed

    # A new process imports the main script first: what is not guarded there happens again, in each of them.
    if getattr(multiprocessing.current_process(), "_inheriting", False):
        raise SystemExit(1)
    # Deaths of workers are counted here, frame by frame.
    rules = {
        "distributed.scheduler.allowed-failures": 0,
        "distributed.scheduler.worker-ttl": "60s",
        "distributed.worker.preload": ["raycam.cluster.dask_worker"],
    }
    with dask.config.set(rules), warnings.catch_warnings():
        warnings.filterwarnings("ignore", r"\s*Port \d+ is already in use")  # another one is taken
        try:
            return distributed.LocalCluster(
                n_workers=count,
                threads_per_worker=1,
                processes=True,
                host="127.0.0.1",
                dashboard_address=None,
                worker_dashboard_address=None,
                silence_logs=50,
            )
        except RuntimeError as fault:
            raise SettingsError(
                f"{address}: its processes do not start ({fault}). They import the script that starts them, so what it "
                "does has to stand under if __name__ == '__main__':"
            ) from None


class DaskPool:
    """The workers of a Dask scheduler."""

    apart = True

    def __init__(
        self,
        client: Any,
        threads: int | None = None,
        cluster: Any = None,
        tell: Callable[[str], object] = warnings.warn,
    ) -> None:
        self._client, self._cluster, self._tell = client, cluster, tell
        self._alone_since: float | None = None
        self._next_report = SILENCE_TIMEOUT
        self._polled_at = float("-inf")
        self._workers: dict[str, dict[str, Any]] = {}  # as they were then
        self._registry: WorkerRegistry | None = None
        self._submitted: dict[Future[FrameResult], tuple[Future[FrameResult], frozenset[str]]] = {}
        """What is under way: the engine's future, and whom it is meant for."""
        self._given = threads
        self._executor = client.get_executor(pure=False, retries=0)
        self.notices: list[str] = []
        """What the one who uses it should know."""
        if not _is_private(client.scheduler.address):
            self.notices.append(
                f"{client.scheduler.address} is neither encrypted nor authenticated: whoever reaches it can run "
                "programs on its workers; use tls:// or a network of your own"
            )

    def threads(self, left: int) -> int | None:
        """How many threads a frame is rendered with, where it was not said: all that a worker has to itself."""
        if self._given is not None:
            return self._given
        if self._cluster is not None:
            return shared_threads(_core.available_threads(), max(1, len(self._cluster.workers)), left)
        hosts = {worker["host"] for worker in self._workers.values()}
        alone = len(hosts) == len(self._workers) == sum(map(_threads_of, self._workers.values()))
        return None if alone else 1

    def open(self, package: JobPackage, path: str) -> None:
        """Waits for a worker, asks all who can make frames of the package, and sends it to those that do not see it.

        Raises `OSError` where the scheduler goes meanwhile.
        """
        from .worker_registry import WorkerRegistry

        self._poll()
        while not self._workers:
            if self._client.status in ("closing", "closed"):
                raise OSError(f"the Dask scheduler at {self._client.scheduler.address} has gone")
            time.sleep(POLL_INTERVAL)
            self._poll()
        self._registry = WorkerRegistry(self._client, package, path, self._report_unfit)
        self._poll()
        self._registry.wait(ANSWER_TIMEOUT)  # one that stands still is no reason to wait for longer

    def submit(self, task: FrameTask) -> Future[FrameResult]:
        """Starts a frame."""
        from . import dask_worker

        fit = [] if self._registry is None else self._registry.fit(ANSWER_TIMEOUT)
        # Others are not forbidden: a frame must not wait for ever for workers that have gone.
        where = {"workers": fit, "allow_other_workers": True} if fit else {}
        try:
            theirs = self._executor.submit(dask_worker.render_frame, task, **where)
        except Exception as fault:
            raise PoolLost(str(fault)) from fault
        ours: Future[FrameResult] = Future()
        self._submitted[ours] = (theirs, frozenset(fit))
        theirs.add_done_callback(lambda done: self._collect_result(ours, done))
        return ours

    def slots(self) -> int:
        """Two frames for each thread of the workers there are now."""
        if time.monotonic() - self._polled_at > REFRESH_INTERVAL:
            self._poll()
        return max(1, 2 * sum(map(_threads_of, self._workers.values())))

    def close(self) -> None:
        """Takes back what is under way, and ends a cluster that was started here."""
        with contextlib.suppress(Exception):
            self._executor.shutdown(wait=False)
        with contextlib.suppress(Exception):
            self._client.close(timeout=5)
        if self._cluster is not None:
            self._cluster.close(timeout=10)

    def _poll(self) -> None:
        """Sees who is there now."""
        self._polled_at = time.monotonic()
        with contextlib.suppress(Exception):  # a scheduler that has gone is told by the frames
            self._workers = dict(self._client.scheduler_info(n_workers=-1)["workers"])
            if self._registry is not None:
                self._registry.poll(self._workers)
        self._cancel()
        self._report_waiting()

    def _cancel(self) -> None:
        """Takes back frames that wait for workers which have all gone: Dask gives those to no worker that joins later,
        though others are allowed."""
        for ours, (theirs, fit) in list(self._submitted.items()):
            gone = fit and self._workers and fit.isdisjoint(self._workers)
            if gone and self._submitted.pop(ours, None) is not None:
                theirs.cancel()
                ours.set_exception(WorkerUnfit("all workers that it was meant for have gone"))

    def _report_waiting(self) -> None:
        """Tells where there has been no worker for long, seldom, and then that there is one."""
        if self._workers:
            if self._next_report > SILENCE_TIMEOUT:
                self._tell("there is a worker now: it goes on")
            self._alone_since, self._next_report = None, SILENCE_TIMEOUT
            return
        self._alone_since = self._polled_at if self._alone_since is None else self._alone_since
        seconds = self._polled_at - self._alone_since
        if seconds >= self._next_report:
            self._next_report = 2 * seconds
            self._tell(
                f"no worker is at the Dask scheduler {self._client.scheduler.address}, for {seconds:.0f} s now: "
                f"waiting for one (dask worker {self._client.scheduler.address})"
            )

    def _report_unfit(self, worker: str, reason: str) -> None:
        self.notices.append(f"{worker} makes no frames: {reason}")

    def _collect_result(self, ours: Future[FrameResult], theirs: Future[FrameResult]) -> None:
        """Passes an answer on; of a worker that was not fit it is asked again whether it is."""
        if self._submitted.pop(ours, None) is None:  # it was taken back
            return
        fault = None if theirs.cancelled() else theirs.exception()
        if isinstance(fault, WorkerUnfit) and fault.worker is not None and self._registry is not None:
            self._registry.forget(fault.worker)
            self._polled_at = float("-inf")
        _resolve_future(ours, theirs)


def _resolve_future(ours: Future[FrameResult], theirs: Future[FrameResult]) -> None:
    """Gives ours what theirs has, deaths of workers in our words."""
    from distributed import KilledWorker

    try:
        ours.set_result(theirs.result())
    except KilledWorker as fault:
        # Every frame that waited at the worker is told so, not only the one it was in.
        ours.set_exception(WorkerDied(str(fault), certain=False, deaths=fault.allowed_failures + 1))
    except CancelledError as fault:
        ours.set_exception(PoolLost(f"the scheduler has gone {fault}".rstrip()))
    except BaseException as fault:
        ours.set_exception(fault)


def _threads_of(worker: dict[str, Any]) -> int:
    return int(worker["nthreads"])


def _is_private(address: str) -> bool:
    """Whether nobody else can listen: it is encrypted, or within this machine."""
    parts = urlsplit(address)
    if parts.scheme != "tcp":
        return True
    with contextlib.suppress(ValueError):
        return ip_address(parts.hostname or "").is_loopback
    return parts.hostname == "localhost"
