"""Pool of worker processes on this machine, and the protocol of their pipes.

Each worker is `python -m raycam.cluster.process_worker`. It reads tasks as lines of JSON and answers each with a line
of JSON and the bytes of the files. Files that are sent in pieces come before the answer's line; each piece follows a
line with its size. Nothing is pickled. If a worker dies, the frame that it was rendering is known exactly.
"""

from __future__ import annotations

import contextlib
import json
import os
import queue
import signal
import subprocess
import sys
import tempfile
import threading
from concurrent.futures import Future
from typing import IO, Any

from .. import _core, errors
from ..errors import Error, Notice
from ..io import memory_limits
from ..io.temp_stream import TempStream, TempStreamError
from ..jobs.job_package import JobPackage
from ..jobs.scheduler import PoolLost, WorkerDied, shared_threads
from ..jobs.worker import FrameResult, FrameTask, PackageNotFound, WorkerUnfit

__all__ = ["FrameError", "ProcessPool"]

# Memory estimate of a worker: a base, and bytes per byte of the packed world for the world and its BVH.
MEMORY_PER_WORLD_BYTE = 20
WORKER_BASE_BYTES = 150 << 20
MAX_MEMORY_FRACTION = 0.9
"""The fraction of the memory that workers may fill."""


class FrameError(Exception):
    """An exception in a worker's frame that is not one of raycam's own errors."""


class ProcessPool:
    """Renders in `count` processes on this machine with `threads` each.

    By default, the cores are divided among the processes. Fewer processes are started if memory is
    insufficient.
    """

    apart = True

    def __init__(self, count: int, threads: int | None = None) -> None:
        self._given = threads
        self._count = count
        self._tasks: queue.SimpleQueue[tuple[FrameTask, Future[FrameResult]] | None] = queue.SimpleQueue()
        self._servants: list[threading.Thread] = []
        self._workers: list[_Worker] = []
        self._closing = False
        self._expected = WORKER_BASE_BYTES

    def open(self, package: JobPackage, path: str) -> None:
        """Estimates the memory of a worker."""
        self._expected = WORKER_BASE_BYTES + MEMORY_PER_WORLD_BYTE * len(package.world_bytes)

    def threads(self, left: int) -> int | None:
        """The given threads, or else the cores divided among the workers."""
        return self._given or shared_threads(_core.available_threads(), self._count, left)

    def submit(self, task: FrameTask) -> Future[FrameResult]:
        """Queues a frame."""
        future: Future[FrameResult] = Future()
        self._tasks.put((task, future))
        return future

    def slots(self) -> int:
        """Returns two frames per worker, so that no worker waits.

        Starts more workers if they fit into memory.
        """
        while len(self._servants) < self._count and (not self._servants or self._has_room()):
            thread = threading.Thread(target=self._serve, name="raycam-worker", daemon=True)
            self._servants.append(thread)
            thread.start()
        return 2 * len(self._servants)

    @property
    def notices(self) -> list[Notice]:
        """A notice if fewer workers than requested were started."""
        started = len(self._servants)
        if not 0 < started < self._count:
            return []
        message = f"only {started} of {self._count} workers were started, because there is no memory for more"
        return [Notice(message, "unusable_worker")]

    def pids(self) -> list[int]:
        """The process ids of the running workers."""
        return [worker.process.pid for worker in self._workers]

    def close(self) -> None:
        """Kills all workers."""
        self._closing = True
        for _ in self._servants:
            self._tasks.put(None)
        for each in list(self._workers):
            each.process.kill()
        for thread in self._servants:
            thread.join()

    def _has_room(self) -> bool:
        """Returns True if another worker fits into memory.

        The estimate assumes that each worker grows to the largest worker's size.
        """
        sizes = [memory_limits.peak_bytes(pid) for pid in self.pids()]
        expected = max([self._expected, *sizes])
        growing = sum(expected - size for size in sizes) + expected * (len(self._servants) - len(sizes))
        return growing + expected <= memory_limits.available_bytes(MAX_MEMORY_FRACTION)

    def _serve(self) -> None:
        """Thread for one worker: sends tasks to the worker, and replaces the worker if it dies."""
        worker: _Worker | None = None
        while (item := self._tasks.get()) is not None and not self._closing:
            task, future = item
            if not future.set_running_or_notify_cancel():
                continue
            try:
                if worker is None:
                    worker = _Worker()
                    self._workers.append(worker)
                    if self._closing:
                        worker.process.kill()
                made = worker.make(task)
            except BaseException as fault:
                if worker is not None and isinstance(fault, WorkerDied):
                    self._workers.remove(worker)
                    worker = None
                future.set_exception(PoolLost("stopped") if self._closing else fault)
            else:
                future.set_result(made)
        if worker is not None:
            self._workers.remove(worker)
            worker.end()


class _Worker:
    """The parent's side of one worker process."""

    def __init__(self) -> None:
        self._said = tempfile.TemporaryFile()  # noqa: SIM115
        self.process = subprocess.Popen(
            [sys.executable, "-m", "raycam.cluster.process_worker"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._said,
        )

    def make(self, task: FrameTask) -> FrameResult:
        """Renders a frame; raises `WorkerDied` if the worker dies before its answer."""
        to, back = self.process.stdin, self.process.stdout
        if to is None or back is None:  # for mypy: both are pipes
            raise AssertionError
        try:
            to.write(json.dumps(task._asdict()).encode() + b"\n")
            to.flush()
            gathered: list[TempStream] = []
            full: TempStreamError | None = None
            while "piece" in (answer := json.loads(_read_line(back))):
                piece = _read_exactly(back, answer["piece"])
                try:
                    if answer["begins"]:
                        gathered.append(TempStream(os.path.dirname(task.package)))
                    if full is None:
                        gathered[-1].add(piece)
                except (
                    TempStreamError
                ) as fault:  # raised below, after the worker's whole answer has been read
                    full = full or fault
            if full is not None:
                raise full
            if "error" in answer:
                raise _worker_error(answer)
            places = iter(gathered)
            files = {
                name: next(places) if size is None else _read_exactly(back, size)
                for name, size in answer["files"]
            }
        except (EOFError, BrokenPipeError):
            raise WorkerDied(self.end()) from None
        return FrameResult(
            task.frame, files, [Notice(**notice) for notice in answer["notices"]], answer["seconds"]
        )

    def end(self) -> str:
        """Ends the process; returns its exit status and the end of its error output as text."""
        for pipe in (self.process.stdin, self.process.stdout):
            if pipe is not None:
                with contextlib.suppress(OSError):
                    pipe.close()
        try:
            code = self.process.wait(5)
        except subprocess.TimeoutExpired:
            self.process.kill()
            code = self.process.wait()
        with self._said as said:
            said.seek(max(0, said.seek(0, os.SEEK_END) - 2000))
            words = said.read().decode(errors="replace").strip()
        how = f"exit status {code}"
        if code < 0:
            name = signal.Signals(-code).name if -code in signal.Signals._value2member_map_ else str(-code)
            how = f"signal {name}" + (" (possibly out of memory)" if name == "SIGKILL" else "")
        return f"a worker ended with {how}" + (f"\n{words}" if words else "")


def _worker_error(answer: dict[str, Any]) -> Exception:
    """The exception for an error in the worker."""
    if answer["error"] in (WorkerUnfit.__name__, PackageNotFound.__name__):
        return PoolLost(answer["text"])  # other workers on this machine would fail, too
    kind = getattr(errors, answer["error"], None)
    fault: Exception = FrameError(f"{answer['error']}: {answer['text']}")
    if isinstance(kind, type) and issubclass(kind, Error):
        fault = kind(answer["text"])
    fault.add_note("in the worker:\n" + answer["trace"])
    return fault


def _read_line(pipe: IO[bytes]) -> bytes:
    line = pipe.readline()
    if not line.endswith(b"\n"):
        raise EOFError
    return line


def _read_exactly(pipe: IO[bytes], size: int) -> bytes:
    data = pipe.read(size)
    if len(data) != size:
        raise EOFError
    return data
