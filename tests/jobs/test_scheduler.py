"""Distribution of frames: every frame is returned once, whatever the workers do."""

from __future__ import annotations

import threading
import weakref
from collections import Counter
from collections.abc import Callable, Iterable
from concurrent.futures import BrokenExecutor, CancelledError, Future
from typing import Any

import pytest
from raycam.errors import JobError, WorldError
from raycam.jobs import scheduler as module
from raycam.jobs.scheduler import FailedFrame, PoolLost, WorkerDied, schedule, shared_threads
from raycam.jobs.worker import FrameResult, FrameTask, WorkerUnfit
from support.patience import PATIENCE
from support.raises import raises


class Pool:
    """Returns `answer(frame, attempt)` for each frame; None is a future that stays open."""

    apart = True

    def __init__(self, answer: Callable[[int, int], Any], slots: int = 3) -> None:
        self.answer, self.size = answer, slots
        self.attempts: Counter[int] = Counter()
        self.open_futures: dict[int, list[Future[FrameResult]]] = {}
        self.most = 0

    def open(self, package: object, path: str) -> None: ...

    def threads(self, left: int) -> None:
        return None

    def slots(self) -> int:
        return self.size

    def submit(self, task: FrameTask) -> Future[FrameResult]:
        self.attempts[task.frame] += 1
        future: Future[FrameResult] = Future()
        answer = self.answer(task.frame, self.attempts[task.frame])
        if answer is None:
            self.open_futures.setdefault(task.frame, []).append(future)
            self.most = max(self.most, sum(map(len, self.open_futures.values())))
        elif isinstance(answer, Exception):
            future.set_exception(answer)
        else:
            future.set_result(made(task.frame, answer))
        return future

    def close(self) -> None: ...


def made(frame: int, text: str = "x") -> FrameResult:
    return FrameResult(frame, {"f": text.encode()}, [], 0.0)


def tasks(frames: Iterable[int]) -> list[FrameTask]:
    return [FrameTask("job", "package", frame) for frame in frames]


def outcomes(pool: Pool, frames: Iterable[int], **options: Any) -> dict[int, FrameResult | FailedFrame]:
    found: dict[int, FrameResult | FailedFrame] = {}
    for outcome in schedule(pool, tasks(frames), **options):
        assert outcome.frame not in found
        found[outcome.frame] = outcome
    return found


def failed(found: dict[int, FrameResult | FailedFrame]) -> dict[int, str]:
    return {frame: outcome.error for frame, outcome in found.items() if isinstance(outcome, FailedFrame)}


class Files(dict[str, bytes]):
    """Files that can be weakly referenced."""


class WatchedPool(Pool):
    """Counts, at each submission, how many earlier results are still in memory."""

    def __init__(self) -> None:
        super().__init__(lambda *_: "x", slots=1)
        self.made: list[weakref.ref[Files]] = []
        self.held: list[int] = []

    def submit(self, task: FrameTask) -> Future[FrameResult]:
        self.held.append(sum(files() is not None for files in self.made))
        files = Files(f=b"x")
        self.made.append(weakref.ref(files))
        future: Future[FrameResult] = Future()
        future.set_result(FrameResult(task.frame, files, [], 0.0))
        return future


def test_delivered_results_are_released_from_memory() -> None:
    pool = WatchedPool()
    for outcome in schedule(pool, tasks(range(5))):
        assert isinstance(outcome, FrameResult)
        del outcome
    assert pool.held == [0] * 5


def test_every_frame_is_returned_once() -> None:
    assert sorted(outcomes(Pool(lambda *_: "x"), range(50))) == list(range(50))
    assert outcomes(Pool(lambda *_: "x"), []) == {}


def test_frames_in_progress_are_limited_by_the_slots_of_workers() -> None:
    pool = Pool(lambda *_: None, slots=4)

    def finish() -> None:
        done = 0
        while done < 40:
            for frame, futures in list(pool.open_futures.items()):
                if futures:
                    futures.pop().set_result(made(frame))
                    done += 1

    thread = threading.Thread(target=finish)
    thread.start()
    assert len(outcomes(pool, range(40))) == 40
    thread.join()
    assert pool.most <= 4


def test_raycam_errors_are_final_and_other_errors_are_retried() -> None:
    def answer(frame: int, attempt: int) -> Any:
        if frame == 1:
            return WorldError("impossible")
        if frame == 2:
            return MemoryError("full") if attempt < 3 else "x"
        if frame == 3:
            return ZeroDivisionError("always\nin detail")
        return "x"

    pool = Pool(answer)
    found = outcomes(pool, range(6))
    assert failed(found) == {1: "WorldError: impossible", 3: "ZeroDivisionError: always"}
    assert pool.attempts == {0: 1, 1: 1, 2: 3, 3: 3, 4: 1, 5: 1}
    log = found[3]
    assert isinstance(log, FailedFrame)
    assert log.log.count("attempt ") == 3
    assert "in detail" in log.log


def test_unfit_worker_does_not_count_as_an_attempt() -> None:
    pool = Pool(lambda frame, attempt: WorkerUnfit("blind") if attempt <= 9 and frame % 2 else "x")
    found = outcomes(pool, range(6))
    assert failed(found) == {}
    assert pool.attempts == {frame: 10 if frame % 2 else 1 for frame in range(6)}


def test_frame_that_kills_three_workers_fails() -> None:
    pool = Pool(lambda frame, _: WorkerDied("signal SIGSEGV") if frame == 4 else "x")
    found = outcomes(pool, range(9))
    assert list(failed(found)) == [4]
    assert failed(found)[4].startswith("3 workers ")
    assert failed(found)[4].endswith("WorkerDied: signal SIGSEGV")
    assert pool.attempts[4] == 3
    assert sum(pool.attempts.values()) == 11


def test_frames_survive_temporary_deaths_of_workers() -> None:
    pool = Pool(lambda frame, attempt: WorkerDied("killed") if attempt <= 2 and frame % 3 == 0 else "x")
    assert failed(outcomes(pool, range(30))) == {}


def test_suspected_frames_are_retried_alone() -> None:
    # The death of one process ends every frame in progress, as in a broken process pool.
    pool = Pool(lambda *_: None, slots=3)
    kills = Counter[int]()
    poison = 7

    def work() -> None:
        finished: set[int] = set()
        while len(finished) < 20:
            frames = [frame for frame, futures in list(pool.open_futures.items()) if futures]
            if poison in frames:
                kills[poison] += 1
                for frame in frames:
                    pool.open_futures[frame].pop().set_exception(BrokenExecutor("gone"))
                if kills[poison] == 3:
                    finished.add(poison)
            elif frames:
                finished.add(frames[0])
                pool.open_futures[frames[0]].pop().set_result(made(frames[0]))

    thread = threading.Thread(target=work, daemon=True)
    thread.start()
    found = outcomes(pool, range(20))
    thread.join(PATIENCE)
    assert list(failed(found)) == [poison]
    assert len(found) == 20
    assert kills[poison] == 3


def test_late_frame_is_started_twice_and_the_first_result_is_used(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "STRAGGLER_TIMEOUT", 0.0)
    monkeypatch.setattr(module, "STRAGGLER_FACTOR", 0.0)
    pool = Pool(
        lambda frame, attempt: "second" if frame == 2 and attempt == 2 else None if frame == 2 else "x"
    )
    clock = iter(range(10**6))
    found = outcomes(pool, range(4), now=lambda: float(next(clock)))
    assert found[2] == made(2, "second")
    # The late worker answers after the end, when nobody waits for it.
    pool.open_futures[2].pop().set_result(made(2, "stale"))


def test_error_of_one_copy_is_ignored_if_the_other_copy_succeeds(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(module, "STRAGGLER_TIMEOUT", 0.0)
    pool = Pool(lambda *_: None, slots=2)
    clock = iter(range(10**6))

    def work() -> None:
        copies = pool.open_futures.setdefault(0, [])
        while len(copies) < 2:
            pass
        copies[0].set_exception(ZeroDivisionError())
        copies[1].set_result(made(0, "second"))

    thread = threading.Thread(target=work)
    thread.start()
    found = outcomes(pool, [0], now=lambda: float(next(clock)))
    thread.join()
    assert found == {0: made(0, "second")}
    assert pool.attempts[0] == 2


@pytest.mark.parametrize("fault", [PoolLost("no scheduler"), CancelledError()])
def test_loss_of_all_workers_ends_the_run(fault: BaseException) -> None:
    def answer(frame: int, _: int) -> Any:
        return fault if frame == 3 else "x"

    pool = Pool(answer)
    with raises(JobError, code="workers_lost"):
        outcomes(pool, range(9))
    assert pool.attempts[8] == 0


def test_broken_pool_ends_the_run() -> None:
    class Broken(Pool):
        def submit(self, task: FrameTask) -> Future[FrameResult]:
            raise BrokenExecutor("broken")

    with raises(JobError, code="workers_lost"):
        list(schedule(Broken(lambda *_: "x"), tasks(range(2))))


def test_last_frames_use_the_idle_cores() -> None:
    assert [shared_threads(2, 2, left) for left in (9, 3, 2, 1)] == [1, 1, 2, 2]
    assert [shared_threads(8, 4, left) for left in (5, 4, 3, 2, 1)] == [2, 4, 6, 8, 8]
    assert [shared_threads(3, 8, left) for left in (9, 8, 6, 5, 1)] == [1, 1, 1, 2, 3]
    for cores in range(1, 40):
        for workers in range(1, 40):
            given = [shared_threads(cores, workers, left) for left in range(1, 100)]
            assert given == sorted(given, reverse=True)
            assert max(given) <= cores
            assert min(given) == max(1, cores // workers)
