"""Frames made by processes of their own on this machine, and how they are talked to.

Each worker is `python -m raycam.cluster.process_worker`. It reads tasks as lines of JSON and answers each with a line
of JSON and the bytes of the files. Files in pieces come before that line, each piece after a line with its size.
Nothing is pickled. A worker that dies takes one frame with it, which is known exactly.
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
from ..errors import Error
from ..io import memory_limits
from ..io.temp_stream import TempStream, TempStreamError
from ..jobs.job_package import JobPackage
from ..jobs.scheduler import PoolLost, WorkerDied, shared_threads
from ..jobs.worker import FrameResult, FrameTask, PackageNotFound, WorkerUnfit

__all__ = ["FrameError", "ProcessPool"]

# A world in memory with what is built of it, beside its bytes; and a worker without any.
MEMORY_PER_WORLD_BYTE = 20
WORKER_BASE_BYTES = 150 << 20
MAX_MEMORY_FRACTION = 0.9
"""The share of the memory that workers may fill."""


class FrameError(Exception):
    """What a frame raised in a worker, where it is no error of raycam's own."""


class ProcessPool:
    """Workers on this machine, `count` processes with `threads` each (default: the cores shared out).

    Where the memory would not do for all of them, fewer are started.
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
        """Thinks about how much memory a worker will need."""
        self._expected = WORKER_BASE_BYTES + MEMORY_PER_WORLD_BYTE * len(package.world_bytes)

    def threads(self, left: int) -> int | None:
        """As was said, or else the cores shared out."""
        return self._given or shared_threads(_core.available_threads(), self._count, left)

    def submit(self, task: FrameTask) -> Future[FrameResult]:
        """Starts a frame."""
        future: Future[FrameResult] = Future()
        self._tasks.put((task, future))
        return future

    def slots(self) -> int:
        """Two for each worker, so that none waits for the next frame; starts more workers where they fit."""
        while len(self._servants) < self._count and (not self._servants or self._has_room()):
            thread = threading.Thread(target=self._serve, name="raycam-worker", daemon=True)
            self._servants.append(thread)
            thread.start()
        return 2 * len(self._servants)

    @property
    def notices(self) -> list[str]:
        """Whether fewer workers than asked for were started."""
        started = len(self._servants)
        if not 0 < started < self._count:
            return []
        return [
            f"{started} of {self._count} workers were started: the memory that is left would not hold more"
        ]

    def pids(self) -> list[int]:
        """The process numbers of the workers."""
        return [worker.process.pid for worker in self._workers]

    def close(self) -> None:
        """Ends all workers at once, whatever they do."""
        self._closing = True
        for _ in self._servants:
            self._tasks.put(None)
        for each in list(self._workers):
            each.process.kill()
        for thread in self._servants:
            thread.join()

    def _has_room(self) -> bool:
        """Whether one more worker fits into the memory, those that still grow taken as large as the largest."""
        sizes = [memory_limits.peak_bytes(pid) for pid in self.pids()]
        expected = max([self._expected, *sizes])
        growing = sum(expected - size for size in sizes) + expected * (len(self._servants) - len(sizes))
        return growing + expected <= memory_limits.available_bytes(MAX_MEMORY_FRACTION)

    def _serve(self) -> None:
        """Hands tasks to one worker after the other, and a new worker in place of one that died."""
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
        """Makes a frame; raises `WorkerDied` where the worker does not live to answer."""
        to, back = self.process.stdin, self.process.stdout
        if to is None or back is None:  # they are pipes
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
                except TempStreamError as fault:  # told when the worker has answered, who is heard to the end
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
        return FrameResult(task.frame, files, answer["notices"], answer["seconds"])

    def end(self) -> str:
        """Ends the process; how it ended, and the last that it said."""
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
            how = f"signal {name}" + (" (perhaps for want of memory)" if name == "SIGKILL" else "")
        return f"a worker ended with {how}" + (f"\n{words}" if words else "")


def _worker_error(answer: dict[str, Any]) -> Exception:
    """What the worker raised."""
    if answer["error"] in (WorkerUnfit.__name__, PackageNotFound.__name__):
        return PoolLost(answer["text"])  # and all others are as this one
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
