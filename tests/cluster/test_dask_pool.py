"""Frames rendered by Dask, with killed and suspended workers and repeated results."""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
import warnings
from pathlib import Path
from typing import Any

import pytest
from raycam.cluster import dask_pool as module
from raycam.jobs import Job, scheduler
from support.cluster_faults import film, poison, scheduler_lost, storm
from support.patience import PATIENCE
from support.raises import raises

pytestmark = pytest.mark.filterwarnings("ignore")


@pytest.fixture(scope="module")
def dask_pool() -> Any:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        pool = module.connect("local:3")
        yield pool
        pool.close()


def test_local_dask_cluster_listens_on_the_loopback_interface_only(dask_pool: module.DaskPool) -> None:
    addresses = [dask_pool._client.scheduler.address, *dask_pool._client.run(os.getpid)]
    assert all(address.startswith("tcp://127.0.0.1:") for address in addresses)
    assert dask_pool.notices == []
    assert not module._is_private("tcp://10.0.0.8:8786")
    assert module._is_private("tls://10.0.0.8:8786")
    assert module._is_private("tcp://localhost:8786")


def test_script_without_a_main_guard_raises_with_the_remedy(tmp_path: Path) -> None:
    script = tmp_path / "script.py"
    script.write_text("from raycam.cluster import make_pool\nwith make_pool('local:1'):\n    pass\n")
    ended = subprocess.run([sys.executable, script], capture_output=True, text=True, timeout=PATIENCE)
    assert ended.returncode == 1
    last = ended.stderr.splitlines()[-1]
    assert last.startswith("raycam.errors.SettingsError: local:1: the worker processes do not start")
    assert "if __name__ == '__main__':" in last
    assert "bootstrapping phase" not in ended.stderr


def test_killed_or_stopped_workers_and_repeated_results_do_not_change_the_bytes(
    tmp_path: Path, dask_pool: module.DaskPool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(scheduler, "STRAGGLER_TIMEOUT", 1.0)
    seen = storm(tmp_path, dask_pool, frames=40, each=0.1, pause=3.0)
    assert seen.killed >= 1


def test_only_the_frame_that_kills_its_workers_is_abandoned(
    tmp_path: Path, dask_pool: module.DaskPool
) -> None:
    poison(tmp_path, dask_pool, frames=8, number=3)


@pytest.mark.parametrize("listed", [True, False], ids=["listed", "removed"])
def test_closed_dask_nannies_are_restarted(tmp_path: Path, listed: bool) -> None:
    # A nanny exits if its process does not start in time, for example on a busy machine. If a new nanny does not start
    # either, Dask removes it from the cluster's list.
    async def end(pool: module.DaskPool) -> None:
        for nanny in pool._cluster.workers.values():
            await nanny.close(reason="nanny-start-failed")
        if not listed:
            pool._cluster.workers.clear()

    with contextlib.closing(module.connect("local:2")) as pool:
        job = Job(tmp_path / "job", film(seconds=1.0, fps=6, seed=4).package())
        pool._cluster.sync(end, pool)
        assert {nanny.status.name for nanny in pool._cluster.workers.values()} <= {"closed"}
        job.run(pool)
        assert job.status().finished == 6
        assert len(pool._cluster.workers) == 2


def test_finished_frames_survive_the_loss_of_the_scheduler(tmp_path: Path) -> None:
    scheduler_lost(tmp_path, frames=16, after=2, count=1)


def test_unreachable_scheduler_raises_with_its_address(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "CONNECT_TIMEOUT", 0.5)
    with raises(OSError, code="cluster_unreachable", mentions=["127.0.0.1:1"]):
        module.connect("tcp://127.0.0.1:1")
