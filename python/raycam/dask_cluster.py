"""Frames made by a Dask cluster: `raycam[cluster]`.

Tasks are data; the package of the job is read from the job's folder where a worker sees it, and else comes once to
each worker through the scheduler, as a plugin that workers which join later get too. It is never scattered: scattered
data is lost with the worker that holds it. Results come back to this process; the scheduler keeps none of them.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import time
import warnings
from concurrent.futures import CancelledError, Future
from ipaddress import ip_address
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from . import _core, workers
from .dispatch import PoolLost, WorkerDied, shared_threads
from .errors import SettingsError
from .package import Package
from .workers import Made, Task

__all__ = ["Dask", "connect"]

CONNECT = 20.0  # seconds in which a scheduler answers
ANSWER = 5.0  # seconds in which a worker says whether it sees a file
REFRESH = 2.0  # seconds for which the number of workers is believed


def connect(address: str, threads: int | None = None) -> Dask:
    """The Dask cluster at "tcp://HOST:PORT" or "tls://HOST:PORT", or with "local:N" a new one of N processes here.

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
        return Dask(distributed.Client(cluster), threads, cluster)
    if kind not in ("tcp", "tls") or not urlsplit(address).port:
        raise SettingsError(f"{address!r}: expected tcp://HOST:PORT, tls://HOST:PORT or local:N")
    try:
        return Dask(distributed.Client(address, timeout=CONNECT, set_as_default=False), threads)
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
    rules = {"distributed.scheduler.allowed-failures": 0, "distributed.scheduler.worker-ttl": "60s"}
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


class Dask:
    """The workers of a Dask scheduler."""

    apart = True

    def __init__(self, client: Any, threads: int | None = None, cluster: Any = None) -> None:
        self._client, self._cluster = client, cluster
        self._asked = float("-inf")
        self._slots = 1
        self._plugin: str | None = None
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
        info = self._workers()
        hosts = [worker["host"] for worker in info]
        alone = len(set(hosts)) == len(hosts) and all(worker["nthreads"] == 1 for worker in info)
        return None if alone else 1

    def open(self, package: Package, path: str) -> None:
        """Sends the package to the workers, where one of them does not see it."""
        name = f"raycam-{package.id}"
        self._client.wait_for_workers(1)
        asked = [
            self._client.submit(_sees, package.id, path, workers=[address], pure=False)
            for address in self._client.scheduler_info(n_workers=-1)["workers"]
        ]
        end = time.monotonic() + ANSWER
        for one in asked:
            with contextlib.suppress(TimeoutError):  # one that stands still is no reason to wait
                one.exception(max(0.01, end - time.monotonic()))
        if not all(one.result() for one in asked if one.status == "finished"):
            from .dask_worker import Delivery

            self._client.register_plugin(Delivery(package.id, package.to_bytes()), name=name)
            self._plugin = name

    def submit(self, task: Task) -> Future[Made]:
        """Starts a frame."""
        try:
            theirs = self._executor.submit(workers.make, task)
        except Exception as fault:
            raise PoolLost(str(fault)) from fault
        ours: Future[Made] = Future()
        theirs.add_done_callback(lambda done: _answer(ours, done))
        return ours

    def slots(self) -> int:
        """Two frames for each thread of the workers there are now."""
        if time.monotonic() - self._asked > REFRESH:
            self._asked = time.monotonic()
            self._slots = max(1, 2 * sum(worker["nthreads"] for worker in self._workers()))
        return self._slots

    def close(self) -> None:
        """Takes back what is under way, and ends a cluster that was started here."""
        with contextlib.suppress(Exception):
            if self._plugin is not None and self._cluster is None:
                self._client.unregister_worker_plugin(self._plugin)
        with contextlib.suppress(Exception):
            self._executor.shutdown(wait=False)
        with contextlib.suppress(Exception):
            self._client.close(timeout=5)
        if self._cluster is not None:
            self._cluster.close(timeout=10)

    def _workers(self) -> list[dict[str, Any]]:
        with contextlib.suppress(Exception):
            return list(self._client.scheduler_info(n_workers=-1)["workers"].values())
        return []


def _answer(ours: Future[Made], theirs: Future[Made]) -> None:
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


def _sees(job: str, path: str) -> bool:
    """Whether a worker sees the package."""
    return Path(path).is_file() or any((place / job).is_file() for place in workers.PLACES)


def _is_private(address: str) -> bool:
    """Whether nobody else can listen: it is encrypted, or within this machine."""
    parts = urlsplit(address)
    if parts.scheme != "tcp":
        return True
    with contextlib.suppress(ValueError):
        return ip_address(parts.hostname or "").is_loopback
    return parts.hostname == "localhost"
