"""Dask workers that cannot render frames, or to which the job's package must be sent."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path

import pytest
import raycam
from raycam.cluster import dask_pool, dask_worker
from raycam.cluster.dask_pool import DaskPool
from raycam.errors import JobError
from raycam.jobs import Job, worker
from support.cluster_faults import Engine, connected
from support.job_frames import BLIND, Pool, package, results
from support.raises import check_mentions, has_notice, raises

NO_RAYCAM = """
import sys
class Hidden:
    def find_spec(self, name, *_):
        if name.partition(".")[0] == "raycam":
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)
sys.meta_path.insert(0, Hidden())
"""
OTHER_VERSION = """
import raycam.jobs.job_package
raycam.jobs.job_package.__version__ = "99.0"
"""


@pytest.fixture(scope="module")
def engine(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Engine]:
    engine = Engine(tmp_path_factory.mktemp("engine"), 0)
    yield engine
    engine.close()


@pytest.fixture(scope="module")
def pool(engine: Engine) -> Iterator[DaskPool]:
    pool = connected(engine.address)
    yield pool
    pool.close()


def wait_for(pool: DaskPool, count: int) -> None:
    while len(pool._client.scheduler_info(n_workers=-1)["workers"]) < count:
        time.sleep(0.05)


def test_cluster_without_workers_gives_a_notice_and_continues_when_one_joins(
    tmp_path: Path, engine: Engine, monkeypatch: pytest.MonkeyPatch
) -> None:
    Job(tmp_path / "one", package()).run(Pool())
    monkeypatch.setattr(dask_pool, "SILENCE_TIMEOUT", 0.3)
    monkeypatch.setattr(dask_pool, "REFRESH_INTERVAL", 0.1)
    told: list[str] = []

    def tell(notice: raycam.Notice) -> None:
        assert notice.code == "waiting_for_workers"
        told.append(str(notice))
        if engine.address in told[-1] and all(worker.poll() is not None for worker in engine.workers):
            engine.workers.append(engine.join())

    job = Job(tmp_path / "many", package())
    pool = connected(engine.address, tell)

    def leave(done: int, total: int, failed: int) -> None:
        # The only worker is killed in the middle of the job.
        if done == 2 and len(engine.workers) == 1:
            engine.workers[0].kill()

    job.run(pool, progress=leave)
    waiting = [text for text in told if engine.address in text]
    # Two notices report that a worker has joined; the interval between the others doubles.
    assert len(told) - len(waiting) == 2
    assert 2 <= len(waiting) < 14
    assert results(job.folder) == results(tmp_path / "one")
    for process in engine.workers:
        process.kill()
        process.wait()
    engine.workers.clear()
    while pool._client.scheduler_info(n_workers=-1)["workers"]:
        time.sleep(0.05)
    pool.close()


def test_loss_of_the_scheduler_while_waiting_for_workers_ends_the_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    engine = Engine(tmp_path, 0)
    pool = connected(engine.address, lambda _: engine.close())
    pool._client._timeout = 1.0  # seconds during which the client tries to reconnect
    monkeypatch.setattr(dask_pool, "SILENCE_TIMEOUT", 0.1)
    try:
        with raises(OSError, code="cluster_unreachable", mentions=[engine.address]):
            Job(tmp_path / "a", package()).run(pool)
    finally:
        pool.close()
        engine.close()


def test_unusable_workers_get_no_frames_and_a_notice(tmp_path: Path, engine: Engine, pool: DaskPool) -> None:
    engine.workers += [engine.join(NO_RAYCAM), engine.join(OTHER_VERSION)]
    wait_for(pool, 2)
    job = Job(tmp_path, package())
    with raises(JobError, code="workers_lost", mentions=["'raycam'"]) as fault:
        job.run(pool)
    for fact in ("'raycam'", "99.0"):
        check_mentions(str(fault.value), [fact])
        assert has_notice(pool.notices, "unusable_worker", fact)
    assert (job.status().finished, job.status().failed) == (0, {})
    assert [worker.poll() for worker in engine.workers] == [
        None,
        None,
    ]  # workers are not ended, because other programs may use the cluster


def test_late_worker_without_access_to_the_folder_receives_the_package(
    tmp_path: Path, engine: Engine, pool: DaskPool
) -> None:
    Job(tmp_path / "one", package()).run(Pool())
    others = len(engine.workers)
    engine.workers.append(engine.join())
    wait_for(pool, others + 1)
    job = Job(tmp_path / "many", package())

    def replace(done: int, total: int, failed: int) -> None:
        if done == 2 and len(engine.workers) == others + 1:
            engine.workers.append(engine.join(BLIND.format(folder=str(job.folder.resolve()))))
            wait_for(pool, others + 2)
            engine.workers[
                others
            ].kill()  # the worker without access to the folder renders all remaining frames

    job.run(pool, progress=replace)
    assert results(job.folder) == results(tmp_path / "one")

    # The worker keeps only the packages of recent jobs: a package deleted during the job is sent again.
    def evict(done: int, total: int, failed: int) -> None:
        if done == 2:
            for number in range(dask_worker.MAX_PACKAGES):
                pool._client.submit(dask_worker.keep_package, f"other{number}", b"").result()
            pool._client.submit(worker.clear_cache).result()

    engine.workers[others].wait()
    for other in engine.workers[:others]:
        other.kill()
    job.remove()
    Job(job.folder, package()).run(pool, progress=evict)
    assert results(job.folder) == results(tmp_path / "one")
