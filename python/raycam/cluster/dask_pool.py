"""Pool of the workers of a Dask cluster: the `raycam[cluster]` extra.

Tasks are plain data. A worker reads the package from the job's folder, or receives it once through the scheduler if it
has no access to the folder. The package is never scattered, because scattered data is lost with the worker that holds
it. Results return to this process; the scheduler does not keep results.
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
from ..errors import NetworkError, Notice, SettingsError
from ..jobs.job_package import JobPackage
from ..jobs.scheduler import PoolLost, WorkerDied, shared_threads
from ..jobs.worker import FrameResult, FrameTask, WorkerUnfit
from ..notices import warn

if TYPE_CHECKING:
    from .worker_registry import WorkerRegistry

__all__ = ["DaskPool", "connect"]

CONNECT_TIMEOUT = 20.0  # seconds to wait for a scheduler
ANSWER_TIMEOUT = 5.0  # seconds to wait for the probe of a worker
REFRESH_INTERVAL = 2.0  # seconds between updates of the list of workers
SILENCE_TIMEOUT = (
    5.0  # seconds without a worker until the first notice; each further notice takes twice as long
)
POLL_INTERVAL = 0.2  # seconds between polls for a first worker


def connect(address: str, threads: int | None = None, tell: Callable[[Notice], object] = warn) -> DaskPool:
    """Connects to the Dask cluster at "tcp://HOST:PORT" or "tls://HOST:PORT".

    The address "local:N" starts a cluster of N processes. `tell` is called with notices while the pool waits for
    workers.

    Raises `SettingsError` for an invalid address and if Dask is not installed, `NetworkError` if no scheduler answers.
    """
    try:
        import distributed
    except ImportError:
        raise SettingsError(
            f"{address}: Dask is not installed; pip install 'raycam[cluster]'", code="missing_dependency"
        ) from None
    kind, _, rest = address.partition(":")
    if kind == "local":
        if not rest.isdigit() or int(rest) < 1:
            raise SettingsError(
                f"{address!r}: expected local:N with N processes, as in local:4", code="invalid_value"
            )
        cluster = _local(address, int(rest))
        return DaskPool(distributed.Client(cluster), threads, cluster, tell)
    if kind not in ("tcp", "tls") or not urlsplit(address).port:
        raise SettingsError(
            f"{address!r}: expected tcp://HOST:PORT, tls://HOST:PORT or local:N", code="invalid_value"
        )
    try:
        return DaskPool(
            distributed.Client(address, timeout=CONNECT_TIMEOUT, set_as_default=False), threads, tell=tell
        )
    except OSError as fault:
        raise NetworkError(
            f"no Dask scheduler found at {address}: {fault}", code="cluster_unreachable"
        ) from None


def _local(address: str, count: int) -> Any:
    """Starts a cluster of processes on this machine.

    Raises `SettingsError` if the main script lacks a guard.
    """
    import dask
    import distributed

    # A new process imports the main script first, so code without a guard would run again in each new process.
    if getattr(multiprocessing.current_process(), "_inheriting", False):
        raise SystemExit(1)
    # The job's own scheduler counts the deaths of workers for each frame, so Dask must not count them.
    rules = {
        "distributed.scheduler.allowed-failures": 0,
        "distributed.scheduler.worker-ttl": "60s",
        "distributed.worker.preload": ["raycam.cluster.dask_worker"],
    }
    with dask.config.set(rules), warnings.catch_warnings():
        warnings.filterwarnings("ignore", r"\s*Port \d+ is already in use")  # Dask then uses another port
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
                f"{address}: the worker processes do not start ({fault}). They import the script that starts them, "
                "so the script's actions must be inside: if __name__ == '__main__':",
                code="cluster_unreachable",
            ) from None


class DaskPool:
    """The workers of a Dask scheduler."""

    apart = True

    def __init__(
        self,
        client: Any,
        threads: int | None = None,
        cluster: Any = None,
        tell: Callable[[Notice], object] = warn,
    ) -> None:
        self._client, self._cluster, self._tell = client, cluster, tell
        self._processes = 0 if cluster is None else len(cluster.workers)
        self._alone_since: float | None = None
        self._next_report = SILENCE_TIMEOUT
        self._polled_at = float("-inf")
        self._workers: dict[str, dict[str, Any]] = {}  # worker information by address, as of the last poll
        self._registry: WorkerRegistry | None = None
        self._submitted: dict[Future[FrameResult], tuple[Future[FrameResult], frozenset[str]]] = {}
        """Futures of submitted frames: for each frame, Dask's future and the addresses of the workers to which the
        frame was sent.
        """
        self._given = threads
        self._executor = client.get_executor(pure=False, retries=0)
        self.notices: list[Notice] = []
        """Notices for the user."""
        if not _is_private(client.scheduler.address):
            message = (
                f"{client.scheduler.address} is neither encrypted nor authenticated, so anyone who can connect "
                "to it can run programs on its workers; use tls:// or a private network"
            )
            self.notices.append(Notice(message, "insecure_cluster"))

    def threads(self, left: int) -> int | None:
        """Returns the number of threads for the next frame.

        This is the number given to the pool, if any. Otherwise, a cluster started by "local:N" divides the cores among
        its workers. In other clusters, the number is None (all) if each machine has a single worker with one thread,
        and 1 if not.
        """
        if self._given is not None:
            return self._given
        if self._cluster is not None:
            return shared_threads(_core.available_threads(), max(1, len(self._cluster.workers)), left)
        hosts = {worker["host"] for worker in self._workers.values()}
        alone = len(hosts) == len(self._workers) == sum(map(_threads_of, self._workers.values()))
        return None if alone else 1

    def open(self, package: JobPackage, path: str) -> None:
        """Waits for a worker, probes all workers, and sends out the package.

        Only workers without access to the package receive the package. Raises `NetworkError` if the scheduler
        stops while waiting.
        """
        from .worker_registry import WorkerRegistry

        self._poll()
        while not self._workers:
            if self._client.status in ("closing", "closed"):
                raise NetworkError(
                    f"the Dask scheduler at {self._client.scheduler.address} has stopped",
                    code="cluster_unreachable",
                )
            time.sleep(POLL_INTERVAL)
            self._poll()
        self._registry = WorkerRegistry(self._client, package, path, self._report_unfit)
        self._poll()
        self._registry.wait(ANSWER_TIMEOUT)  # limited, because a worker may be suspended

    def submit(self, task: FrameTask) -> Future[FrameResult]:
        """Starts a frame on the cluster."""
        from . import dask_worker

        fit = [] if self._registry is None else self._registry.fit(ANSWER_TIMEOUT)
        # Other workers are allowed, because otherwise a frame would wait forever if all fit workers are gone.
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
        """The number of frames that may be queued: two for each thread of the current workers."""
        if time.monotonic() - self._polled_at > REFRESH_INTERVAL:
            self._poll()
        return max(1, 2 * sum(map(_threads_of, self._workers.values())))

    def close(self) -> None:
        """Cancels submitted frames, and ends a cluster that this pool started."""
        with contextlib.suppress(Exception):
            self._executor.shutdown(wait=False)
        with contextlib.suppress(Exception):
            self._client.close(timeout=5)
        if self._cluster is not None:
            self._cluster.close(timeout=10)

    def _poll(self) -> None:
        """Updates the list of workers."""
        self._polled_at = time.monotonic()
        with contextlib.suppress(Exception):  # if the scheduler has stopped, the frames fail
            self._workers = dict(self._client.scheduler_info(n_workers=-1)["workers"])
            if self._registry is not None:
                self._registry.poll(self._workers)
        self._restart()
        self._cancel()
        self._report_waiting()

    def _restart(self) -> None:
        """Restarts processes of this pool's own cluster that Dask has abandoned.

        A nanny restarts a dead process, but exits if the restart takes longer than the nanny's timeout, for example
        under heavy load. If a new nanny does not start in time either, Dask removes it from the cluster.
        """
        if self._cluster is None:
            return
        nannies = self._cluster.workers
        ended = [name for name, nanny in nannies.items() if nanny.status.name in ("closed", "failed")]
        if ended or len(nannies) < self._processes:
            with contextlib.suppress(Exception):  # the next poll tries again
                self._cluster.sync(self._cluster.scale_down, ended)
                self._cluster.scale(self._processes)

    def _cancel(self) -> None:
        """Cancels frames whose workers have all gone.

        Dask does not give these frames to workers that join later, although other workers are allowed.
        """
        for ours, (theirs, fit) in list(self._submitted.items()):
            gone = fit and self._workers and fit.isdisjoint(self._workers)
            if gone and self._submitted.pop(ours, None) is not None:
                theirs.cancel()
                ours.set_exception(
                    WorkerUnfit("all workers that can render this frame have left the cluster")
                )

    def _report_waiting(self) -> None:
        """Reports at growing intervals that no worker is available.

        The last notice reports that a worker has joined.
        """
        if self._workers:
            if self._next_report > SILENCE_TIMEOUT:
                self._tell(Notice("a worker is available: rendering continues", "waiting_for_workers"))
            self._alone_since, self._next_report = None, SILENCE_TIMEOUT
            return
        self._alone_since = self._polled_at if self._alone_since is None else self._alone_since
        seconds = self._polled_at - self._alone_since
        if seconds >= self._next_report:
            self._next_report = 2 * seconds
            message = (
                f"the Dask scheduler {self._client.scheduler.address} has had no workers for {seconds:.0f} s; start "
                f"one with: dask worker {self._client.scheduler.address}"
            )
            self._tell(Notice(message, "waiting_for_workers"))

    def _report_unfit(self, worker: str, reason: str) -> None:
        self.notices.append(Notice(f"{worker} cannot render frames: {reason}", "unusable_worker"))

    def _collect_result(self, ours: Future[FrameResult], theirs: Future[FrameResult]) -> None:
        """Copies a finished frame's result to the job's future; an unfit worker is probed again."""
        if self._submitted.pop(ours, None) is None:  # the frame was cancelled
            return
        fault = None if theirs.cancelled() else theirs.exception()
        if isinstance(fault, WorkerUnfit) and fault.worker is not None and self._registry is not None:
            self._registry.forget(fault.worker)
            self._polled_at = float("-inf")
        _resolve_future(ours, theirs)


def _resolve_future(ours: Future[FrameResult], theirs: Future[FrameResult]) -> None:
    """Copies the outcome of Dask's future `theirs` to the job's future `ours`.

    Dask's exceptions become the exceptions of `jobs.scheduler`.
    """
    from distributed import KilledWorker

    try:
        ours.set_result(theirs.result())
    except KilledWorker as fault:
        # All frames that waited at the dead worker get this exception, not only the frame that it was rendering.
        ours.set_exception(WorkerDied(str(fault), certain=False, deaths=fault.allowed_failures + 1))
    except CancelledError as fault:
        ours.set_exception(PoolLost(f"the scheduler has stopped {fault}".rstrip()))
    except BaseException as fault:
        ours.set_exception(fault)


def _threads_of(worker: dict[str, Any]) -> int:
    return int(worker["nthreads"])


def _is_private(address: str) -> bool:
    """True for a connection that is encrypted or stays within this machine."""
    parts = urlsplit(address)
    if parts.scheme != "tcp":
        return True
    with contextlib.suppress(ValueError):
        return ip_address(parts.hostname or "").is_loopback
    return parts.hostname == "localhost"
