"""Frames have the same bytes on every kind of worker."""

from __future__ import annotations

import os
import signal
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from functools import partial
from multiprocessing import get_context
from pathlib import Path

import pytest
from raycam.cluster import InProcessPool, make_pool
from raycam.errors import JobError, SettingsError
from raycam.jobs import Job, worker
from support.job_frames import Pool, blind, film, package, results
from support.patience import once_at_work
from support.raises import raises


def make(folder: Path, where: object) -> dict[str, bytes]:
    job = Job(folder, package())
    with make_pool(where) as pool:  # type: ignore[arg-type]
        job.run(pool)
    return results(folder)


def test_frames_have_the_same_bytes_for_every_kind_of_worker(tmp_path: Path) -> None:
    Job(tmp_path / "0", package()).run(Pool())
    whole = results(tmp_path / "0")
    assert make(tmp_path / "here", None) == whole
    assert make(tmp_path / "two", 2) == whole
    with ThreadPoolExecutor(3) as executor:
        assert make(tmp_path / "threads", executor) == whole
        assert executor.submit(int).result() == 0  # the job has not closed the executor
    spawned = partial(ProcessPoolExecutor, 2, mp_context=get_context("spawn"))
    assert make(tmp_path / "spawned", spawned) == whole


def test_broken_executor_is_replaced(tmp_path: Path) -> None:
    executors: list[ProcessPoolExecutor] = []

    def spawn() -> ProcessPoolExecutor:
        executors.append(ProcessPoolExecutor(2, mp_context=get_context("spawn")))
        return executors[-1]

    one = film(seconds=2.0, samples=256).package()
    Job(tmp_path / "one", one).run(Pool())
    job = Job(tmp_path / "two", one)

    killed: list[int] = []

    def kill(done: int, total: int, failed: int) -> None:
        if done >= 3 and not killed:
            killed.append(next(iter(executors[0]._processes)))
            os.kill(killed[0], signal.SIGKILL)

    with make_pool(spawn) as pool:
        job.run(pool, progress=kill)
    assert len(executors) == 2
    assert results(tmp_path / "two") == results(tmp_path / "one")


def test_broken_user_executor_ends_the_run_without_losing_frames(tmp_path: Path) -> None:
    job = Job(tmp_path, package())
    with ThreadPoolExecutor(1) as executor:
        executor.shutdown()
        with make_pool(executor) as pool, raises(JobError, code="workers_lost"):
            job.run(pool)


def test_workers_without_access_to_the_folder_receive_the_package(tmp_path: Path) -> None:
    job = Job(tmp_path / "a", package())
    spawned = partial(
        ProcessPoolExecutor,
        2,
        mp_context=get_context("spawn"),
        initializer=blind,
        initargs=(job.folder.resolve(),),
    )
    with make_pool(spawned) as pool:
        job.run(pool)
    Job(tmp_path / "one", package()).run(Pool())
    assert results(job.folder) == results(tmp_path / "one")


def test_workers_of_another_version_end_the_run_without_failed_frames(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    job = Job(tmp_path, package())
    worker.clear_cache()
    monkeypatch.setattr("raycam.jobs.job_package.__version__", "99.0")
    error = raises(JobError, code="workers_lost", mentions=["99.0"])
    with ThreadPoolExecutor(2) as executor, make_pool(executor) as pool, error:
        job.run(pool)
    assert Job(tmp_path).status().failed == {}


def test_in_process_pool_stops_during_a_frame(tmp_path: Path) -> None:
    job = Job(tmp_path, film(samples=1_000_000).package())
    pool = InProcessPool()
    once_at_work(pool.close)
    with raises(JobError, code="workers_lost"):
        job.run(pool)  # the whole frame would take hours


@pytest.mark.parametrize("where", [0, -1, True, "local:", "local:0", "udp://a:1", "tcp://a", "nonsense"])
def test_invalid_worker_addresses_are_refused(where: object) -> None:
    with raises(SettingsError, mentions=[where]) as caught:
        make_pool(where)  # type: ignore[arg-type]
    codes = {str: "invalid_value", bool: "wrong_type", int: "out_of_range"}
    assert caught.value.code == codes[type(where)]
