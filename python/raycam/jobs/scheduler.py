"""Hands frames to workers and gets them back, whatever happens to the workers.

What counts is on the side of whoever calls: a frame is finished when its result is here, the first result counts,
and later ones of the same frame are dropped. So workers may die, stand still and come back, or answer twice.
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

from ..errors import Error, JobError
from ..io.temp_stream import TempStreamError
from .job_package import JobPackage
from .worker import FrameResult, FrameTask, WorkerUnfit

__all__ = ["FailedFrame", "Pool", "PoolLost", "WorkerDied", "schedule", "shared_threads"]

MAX_ATTEMPTS = 3
"""How often a frame is tried that raises what may pass, such as running out of memory; and how many workers a frame
may kill."""
STRAGGLER_TIMEOUT = 30.0
"""Seconds, at least, after which a frame that is late is given to another worker."""
MAX_COPIES = 6
"""How many workers a frame is given to at a time, at most: the second may be standing still too."""
STRAGGLER_FACTOR = 5.0
"""How many times as long as the others take is late."""


class WorkerDied(Exception):
    """A worker ended in the middle of a frame."""

    def __init__(self, message: str, certain: bool = True, deaths: int = 1) -> None:
        super().__init__(message)
        self.certain = certain
        """Whether this very frame was in it, not only waiting beside another."""
        self.deaths = deaths
        """How many workers ended so."""


class PoolLost(Exception):
    """There are no workers any more, nor will there be."""


class Pool(Protocol):
    """Where frames are made."""

    apart: bool
    """Whether its workers fail one by one, so that a second one may help where the first does not answer."""

    @property
    def notices(self) -> Sequence[str]:
        """What the one who uses it should know, so far."""

    def threads(self, left: int) -> int | None:
        """How many threads a frame is rendered with after which `left - 1` are to be handed over; None for all."""

    def open(self, package: JobPackage, path: str) -> None:
        """Prepares for the frames of a job, whose package is in the file `path`."""

    def submit(self, task: FrameTask) -> Future[FrameResult]:
        """Starts a frame; the future raises `WorkerDied`, `WorkerUnfit` or `PoolLost` where it is not the frame's own fault.

        After `WorkerUnfit` the frame is submitted again: a pool without a fit worker raises `PoolLost` sooner or later.
        """

    def slots(self) -> int:
        """How many frames to hand over at a time, now."""

    def close(self) -> None:
        """Ends it, and what still runs."""


@dataclass
class FailedFrame:
    """A frame that was given up."""

    frame: int
    """Its number."""
    error: str
    """Why, in one line."""
    log: str
    """Every attempt, with its traceback."""


def shared_threads(cores: int, workers: int, left: int) -> int:
    """`Pool.threads` of workers on one machine: the cores shared out.

    At the end, when there are more workers than frames, each frame gets more: no core waits while others work.
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
    """Every frame once, as they are finished: made, or given up.

    At most `pool.slots()` are under way, so what waits here stays small. A frame that raises an error of raycam's own
    is given up at once, since it would raise it again; other errors and deaths of workers are tried `attempts` times.
    Where a pool cannot tell which of several frames killed a worker, the suspects are tried again at the end, each
    alone, so that no frame is given up for another's fault. A frame that takes very long while nothing else is left
    to do is given to a second worker too.

    Raises `JobError` where the workers are gone for good, and `OSError` where the job's disk takes no more.
    """
    return _Scheduler(pool, iter(tasks), attempts, now).run()


@dataclass
class _FrameHistory:
    """What happened to a frame so far."""

    tries: int = 0
    deaths: int = 0
    logs: list[str] = field(default_factory=list)


class _Scheduler:
    """The state of one `schedule`."""

    def __init__(
        self, pool: Pool, tasks: Iterator[FrameTask], attempts: int, now: Callable[[], float]
    ) -> None:
        self._pool, self._tasks, self._attempts, self._now = pool, tasks, attempts, now
        self._again: deque[FrameTask] = deque()
        self._suspects: deque[FrameTask] = deque()
        self._histories: dict[int, _FrameHistory] = {}
        self._under_way: dict[Future[FrameResult], tuple[FrameTask, float]] = {}
        self._copies: Counter[int] = Counter()
        self._settled: set[int] = set()  # while another copy of them is under way
        self._arrived: queue.SimpleQueue[Future[FrameResult]] = queue.SimpleQueue()
        self._usual = 0.0
        self._alone = False  # whether the one that is under way is a suspect

    def run(self) -> Generator[FrameResult | FailedFrame, None, None]:
        """See `schedule`."""
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
                outcome = None  # what was made may be large, and the next one takes its time

    def _fill(self) -> None:
        """Hands over frames as long as there is room: new ones, then those to be tried again, then suspects."""
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
        except (PoolLost, RuntimeError) as fault:  # a broken or closed executor raises a RuntimeError
            raise _lost_worker_error(fault) from fault
        self._alone = alone
        self._copies[task.frame] += 1
        self._under_way[future] = (task, self._now())
        future.add_done_callback(self._arrived.put)

    def _complete(self, future: Future[FrameResult]) -> FrameResult | FailedFrame | None:
        """What a future means that is done."""
        if future not in self._under_way:  # told twice
            return None
        task, started = self._under_way.pop(future)
        alone, self._alone = self._alone, self._alone and bool(self._under_way)
        frame = task.frame
        self._copies[frame] -= 1
        another = self._copies[frame] > 0
        if not another:
            del self._copies[frame]
        if frame in self._settled:  # the first result counts
            if not another:
                self._settled.discard(frame)
            return None
        try:
            made = future.result()
        except (PoolLost, CancelledError) as fault:
            raise _lost_worker_error(fault) from fault
        except TempStreamError:  # the job's own disk, which no frame goes through
            raise
        except WorkerUnfit:  # whose turn it is next is the pool's to say
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
        """Whether a fault is the end of a frame; if not, it is tried again."""
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
            killed = f"{story.deaths} workers died of it, the last: " if died else ""
            return FailedFrame(
                task.frame, f"{killed}{name}: {text}" if text else f"{killed}{name}", "\n".join(story.logs)
            )
        if not another:
            (self._suspects if died and not named else self._again).append(task)
        return None

    def _speculate_stragglers(self) -> None:
        """Gives late frames to a second worker, where one has nothing else to do."""
        slots = self._pool.slots()  # asked in any case: a pool sees there who has gone
        if not self._pool.apart or self._again:
            return
        late = max(STRAGGLER_TIMEOUT, STRAGGLER_FACTOR * self._usual)
        latest = dict(self._under_way.values())  # they are in the order in which they were handed over
        for task, started in latest.items():
            if self._pending() >= slots:
                return
            more = task.frame not in self._settled and self._copies[task.frame] < MAX_COPIES
            if more and self._now() - started > late:
                self._submit(task, self._alone)

    def _pending(self) -> int:
        """How many are under way whose answer still matters."""
        return len(self._under_way) - sum(self._copies[frame] for frame in self._settled)


def _lost_worker_error(fault: BaseException) -> JobError:
    return JobError(
        f"the workers are gone ({type(fault).__name__}: {fault}); what is finished is kept, and the same command goes "
        "on"
    )
