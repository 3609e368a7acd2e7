"""Frames made by Dask: workers killed, stopped, without the job's folder; answers that come twice."""

from __future__ import annotations

import os
import signal
import threading
import time
import warnings
from pathlib import Path
from typing import Any

import pytest
from job_frames import Pool, film, package, results
from raycam import dask_cluster, dispatch, workers
from raycam.dask_worker import Delivery
from raycam.errors import JobError
from raycam.jobs import Job

pytestmark = pytest.mark.filterwarnings("ignore")


@pytest.fixture(scope="module")
def dask_pool() -> Any:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        pool = dask_cluster.connect("local:3")
        yield pool
        pool.close()


def processes_of(pool: dask_cluster.Dask) -> list[int]:
    return list(pool._client.run(os.getpid).values())


def test_it_listens_to_this_machine_alone(dask_pool: dask_cluster.Dask) -> None:
    addresses = [dask_pool._client.scheduler.address, *dask_pool._client.run(os.getpid)]
    assert all(address.startswith("tcp://127.0.0.1:") for address in addresses)
    assert dask_pool.notices == []
    assert not dask_cluster._is_private("tcp://10.0.0.8:8786")
    assert dask_cluster._is_private("tls://10.0.0.8:8786")
    assert dask_cluster._is_private("tcp://localhost:8786")


def test_killed_and_stopped_workers_change_no_byte(
    tmp_path: Path, dask_pool: dask_cluster.Dask, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(dispatch, "PATIENCE", 1.0)
    one = film(seconds=4.0, samples=64).package()
    Job(tmp_path / "one", one).run(Pool())
    first, second, _ = processes_of(dask_pool)
    os.kill(first, signal.SIGSTOP)
    killer = threading.Timer(0.3, os.kill, (second, signal.SIGKILL))
    killer.start()
    try:
        Job(tmp_path / "many", one).run(dask_pool)
    finally:
        killer.join()
        os.kill(first, signal.SIGCONT)
    # The one that was stopped has answered by now, and nobody listened.
    time.sleep(0.5)
    assert results(tmp_path / "many") == results(tmp_path / "one")


def test_a_package_that_workers_do_not_see_is_brought_to_them_once(
    tmp_path: Path, dask_pool: dask_cluster.Dask, monkeypatch: pytest.MonkeyPatch
) -> None:
    one = package(seed=9)
    sent: list[Delivery] = []
    real = dask_pool._client.register_plugin
    monkeypatch.setattr(
        dask_pool._client, "register_plugin", lambda plugin, name: sent.append(plugin) or real(plugin, name=name)
    )  # fmt: skip
    dask_pool.open(one, str(tmp_path / "not there"))
    dask_pool.open(one, str(tmp_path / "not there"))
    assert len(sent) == 1
    made = dask_pool.submit(workers.Task(one.id, str(tmp_path / "not there"), 2, 1)).result(30)
    assert dict(made.files) == {"frame_0002.png": film(seed=9).frame(2).to_png()}


def test_a_poison_frame_is_given_up_alone(tmp_path: Path, dask_pool: dask_cluster.Dask) -> None:
    def poison() -> None:
        from raycam import video

        real = video.Film.frame

        def frame(self: Any, number: int, progress: Any = None) -> Any:
            if number == 3:
                os.kill(os.getpid(), 9)
            return real(self, number, progress)

        video.Film.frame = frame  # type: ignore[method-assign]

    def poisoned(poison: Any, task: workers.Task) -> Any:
        from raycam import video

        if video.Film.frame.__module__ == "raycam.video":
            poison()
        return workers.make(task)

    real = dask_pool._executor.submit
    job = Job(tmp_path, package(seed=4))
    try:
        dask_pool._executor.submit = lambda _, task: real(poisoned, poison, task)
        with pytest.raises(JobError, match=r"frame 3: 3 workers died of it"):
            job.run(dask_pool)
    finally:
        dask_pool._executor.submit = real
    assert job.status().finished == 7


def test_a_scheduler_that_does_not_answer_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(dask_cluster, "CONNECT", 0.5)
    with pytest.raises(OSError, match=r"no Dask scheduler answers at tcp://127"):
        dask_cluster.connect("tcp://127.0.0.1:1")
