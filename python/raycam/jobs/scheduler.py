"""Scheduling of frames on workers that may fail.

The scheduler retries frames, and submits speculative copies of stragglers.

A frame is finished when its first result arrives in this process; later results of the same frame are dropped. So
workers may die, stall and recover, or return a result twice.
"""

from __future__ import annotations

import queue
import time
import traceback
from collections import Counter, deque
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from concurrent.futures import BrokenExecutor, CancelledError, Future
from dataclasses import dataclass, field
from typing import Protocol

from ..errors import Error, JobError, Notice
from ..io.temp_stream import TempStreamError
from ..one_line import counted
from .job_package import JobPackage
from .worker import FrameResult, FrameTask, WorkerUnfit

__all__ = ["FailedFrame", "Pool", "PoolLost", "WorkerDied", "schedule", "shared_threads"]

MAX_ATTEMPTS = 3
"""Attempts per frame after transient errors (such as a lack of memory) and after deaths of the frame's workers."""
STRAGGLER_TIMEOUT = 30.0
"""Minimum time in seconds after which a frame is a straggler, which another worker gets too."""
MAX_COPIES = 6
"""Maximum number of workers that have the same frame at a time: the second may stall too."""
STRAGGLER_FACTOR = 5.0
"""A frame is a straggler after this multiple of the longest time so far."""


class WorkerDied(Exception):
    """A worker died while rendering a frame."""

    def __init__(self, message: str, certain: bool = True, deaths: int = 1) -> None:
        super().__init__(message)
        self.certain = certain
        """True if the worker was rendering this frame; False if the frame may only have waited there."""
        self.deaths = deaths
        """The number of workers that died."""


class PoolLost(Exception):
    """All workers are lost for good."""


class Pool(Protocol):
    """Workers that render frames."""

    apart: bool
    """True if workers fail independently, so that a second worker may replace a worker that does not answer."""

    @property
    def notices(self) -> Sequence[Notice]:
        """The notices about the pool so far, for the user."""

    def threads(self, left: int) -> int | None:
        """Returns the number of threads for the next frame; None for all threads.

        `left` is the number of frames that remain to be submitted, including the next frame.
        """

    def open(self, package: JobPackage, path: str) -> None:
        """Prepares for the frames of a job whose package is in the file `path`."""

    def submit(self, task: FrameTask) -> Future[FrameResult]:
        """Starts a frame, and returns the future of its result.

        For faults of workers, the future raises `WorkerDied`, `WorkerUnfit` or `PoolLost`. After
        `WorkerUnfit` the frame is submitted again. A pool without a fit worker eventually raises `PoolLost`.
        """

    def slots(self) -> int:
        """The maximum number of frames that are submitted at the same time."""

    def close(self) -> None:
        """Stops running frames and closes the pool."""


@dataclass
class FailedFrame:
    """A frame that failed for good."""

    frame: int
    """The frame's number."""
    error: str
    """The frame's error, in one line."""
    log: str
    """The tracebacks of all attempts."""


def shared_threads(cores: int, workers: int, left: int) -> int:
    """Returns `Pool.threads` for workers on one machine: the cores divided among the workers.

    `left` is as in `Pool.threads`. If fewer frames than workers remain, each remaining frame gets more threads, so
    that no core idles.
    """
    share = max(1, cores // workers)
    return share if left > workers else max(share, min(cores, -(-2 * cores // left)))


def schedule(
    pool: Pool,
    tasks: Iterable[FrameTask],
    *,
    attempts: int = MAX_ATTEMPTS,
    now: Callable[[], float] = time.monotonic,
) -> Generator[FrameResult | FailedFrame, None, None]:
    """Yields the outcome of every frame once, in the order of completion: a result or a failure.

    `now` returns the current time in seconds. At most `pool.slots()` frames are submitted at a time. A frame that
    raises an error of raycam itself fails at once, because the error would occur again; after other errors and deaths
    of workers it is tried `attempts` times. If a pool cannot determine which of several frames killed a worker, these
    frames are retried at the end, one at a time. So no frame fails because of another frame. When no other frames are
    left, a straggler is also given to a second worker.

    Raises `JobError` if all workers are lost, and `OSError` if the job's disk fails.
    """
    return _Scheduler(pool, iter(tasks), attempts, now).run()


@dataclass
class _FrameHistory:
    """The attempts of a frame so far."""

    tries: int = 0
    deaths: int = 0
    logs: list[str] = field(default_factory=list)


class _Scheduler:
    """The state of one call of `schedule`."""

    def __init__(
        self, pool: Pool, tasks: Iterator[FrameTask], attempts: int, now: Callable[[], float]
    ) -> None:
        self._pool, self._tasks, self._attempts, self._now = pool, tasks, attempts, now
        self._again: deque[FrameTask] = deque()
        self._suspects: deque[FrameTask] = deque()
        self._histories: dict[int, _FrameHistory] = {}
        self._under_way: dict[Future[FrameResult], tuple[FrameTask, float]] = {}
        self._copies: Counter[int] = Counter()
        self._settled: set[int] = set()  # completed frames of which another copy is still running
        self._arrived: queue.SimpleQueue[Future[FrameResult]] = queue.SimpleQueue()
        self._usual = 0.0
        self._alone = False  # True while a suspect frame is rendered alone

    def run(self) -> Generator[FrameResult | FailedFrame, None, None]:
        """Runs all tasks; see `schedule`."""
        while True:
            self._fill()
            if not self._pending():
                return
            try:
                outcome = self._complete(self._arrived.get(timeout=1.0))
            except queue.Empty:
                self._speculate_stragglers()
                continue
            if outcome is not None:
                yield outcome
                outcome = None  # frees the files while waiting for the next frame

    def _fill(self) -> None:
        """Submits frames while slots are free: new frames, then retries, then suspect frames.

        A suspect frame may have killed a worker, and is therefore rendered alone.
        """
        while not self._alone and self._pending() < max(1, self._pool.slots()):
            task = next(self._tasks, None)
            if task is None and self._again:
                task = self._again.popleft()
            if task is None and self._suspects and not self._pending():
                self._submit(self._suspects.popleft(), alone=True)
                return
            if task is None:
                return
            self._submit(task)

    def _submit(self, task: FrameTask, alone: bool = False) -> None:
        try:
            future = self._pool.submit(task)
        except (PoolLost, RuntimeError) as fault:  # a broken or closed executor raises RuntimeError
            raise _lost_worker_error(fault) from fault
        self._alone = alone
        self._copies[task.frame] += 1
        self._under_way[future] = (task, self._now())
        future.add_done_callback(self._arrived.put)

    def _complete(self, future: Future[FrameResult]) -> FrameResult | FailedFrame | None:
        """Returns the outcome of the frame of a finished future.

        The result is None if the frame has no outcome yet, or already had an outcome.
        """
        if future not in self._under_way:  # a future that was reported twice
            return None
        task, started = self._under_way.pop(future)
        alone, self._alone = self._alone, self._alone and bool(self._under_way)
        frame = task.frame
        self._copies[frame] -= 1
        another = self._copies[frame] > 0
        if not another:
            del self._copies[frame]
        if frame in self._settled:  # another copy of the frame was finished first
            if not another:
                self._settled.discard(frame)
            return None
        try:
            made = future.result()
        except (PoolLost, CancelledError) as fault:
            raise _lost_worker_error(fault) from fault
        except TempStreamError:  # an error of the job's own disk, not of a frame
            raise
        except WorkerUnfit:  # the pool chooses another worker
            outcome: FrameResult | FailedFrame | None = None
            if not another:
                self._again.append(task)
        except Exception as fault:
            outcome = self._retry_or_fail(task, fault, alone, another)
        else:
            self._usual = max(self._usual, self._now() - started)
            outcome = made
        if outcome is not None:
            self._histories.pop(frame, None)
            if another:
                self._settled.add(frame)
        return outcome

    def _retry_or_fail(
        self, task: FrameTask, fault: Exception, alone: bool, another: bool
    ) -> FailedFrame | None:
        """Schedules a retry after a fault, or returns the failure after too many faults."""
        story = self._histories.setdefault(task.frame, _FrameHistory())
        story.tries += 1
        story.logs.append(f"attempt {story.tries}:\n" + "".join(traceback.format_exception(fault)))
        died = isinstance(fault, WorkerDied | BrokenExecutor)
        named = isinstance(fault, WorkerDied) and fault.certain
        if died:
            story.deaths += fault.deaths if isinstance(fault, WorkerDied) else 1
            enough = (named or alone) and story.deaths >= self._attempts
        else:
            enough = isinstance(fault, Error) or story.tries - story.deaths >= self._attempts
        if enough:
            text = str(fault).strip().partition("\n")[0]
            name = type(fault).__name__
            killed = (
                f"{counted(story.deaths, 'worker')} ended while rendering this frame; last error: "
                if died
                else ""
            )
            return FailedFrame(
                task.frame, f"{killed}{name}: {text}" if text else f"{killed}{name}", "\n".join(story.logs)
            )
        if not another:
            (self._suspects if died and not named else self._again).append(task)
        return None

    def _speculate_stragglers(self) -> None:
        """Submits copies of stragglers if slots are free."""
        slots = self._pool.slots()  # always called, because pools check their workers there
        if not self._pool.apart or self._again:
            return
        late = max(STRAGGLER_TIMEOUT, STRAGGLER_FACTOR * self._usual)
        latest = dict(self._under_way.values())  # in the order of submission, so the last copy wins
        for task, started in latest.items():
            if self._pending() >= slots:
                return
            more = task.frame not in self._settled and self._copies[task.frame] < MAX_COPIES
            if more and self._now() - started > late:
                self._submit(task, self._alone)

    def _pending(self) -> int:
        """The number of submitted frames without an outcome, copies included."""
        return len(self._under_way) - sum(self._copies[frame] for frame in self._settled)


def _lost_worker_error(fault: BaseException) -> JobError:
    return JobError(
        f"the connection to the workers was lost ({type(fault).__name__}: {fault}); finished frames are kept, and the "
        "same command continues the job",
        code="workers_lost",
    )
