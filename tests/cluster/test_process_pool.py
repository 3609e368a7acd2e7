"""Worker processes on this machine: killed, stopped and out of memory."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from raycam.cluster import process_pool
from raycam.cluster.process_pool import ProcessPool
from raycam.errors import JobError
from raycam.io import memory_limits
from raycam.jobs import Job, scheduler
from raycam.jobs.scheduler import PoolLost, WorkerDied
from raycam.jobs.worker import FrameTask
from support.job_frames import Pool, film, package, results
from support.patience import PATIENCE, until
from support.raises import raises

# Workers are other processes: a file that Python runs at startup changes their behaviour.
POISON = """
import os, sys
if "raycam.cluster.process_worker" in sys.orig_argv:
    from raycam.video import video
    real = video.VideoPlan.frame
    def frame(self, number, progress=None):
        if number == 3:
            {deed}
        return real(self, number, progress)
    video.VideoPlan.frame = frame
"""


@pytest.fixture
def poison(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    folder = tmp_path / "site"
    folder.mkdir()
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(folder), os.environ.get("PYTHONPATH", "")]))
    return folder / "sitecustomize.py"


def expected(tmp_path: Path) -> dict[str, bytes]:
    Job(tmp_path / "expected", package()).run(Pool())
    return results(tmp_path / "expected")


def test_killed_and_stopped_workers_do_not_change_the_bytes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(scheduler, "STRAGGLER_TIMEOUT", 1.0)
    one = film(seconds=4.0, samples=64).package()
    Job(tmp_path / "one", one).run(Pool())
    pool = ProcessPool(3)
    over = threading.Event()

    def disturb() -> None:
        while len(pool.pids()) < 3:
            time.sleep(0.01)
        # This worker is suspended for ever while it renders its frame.
        os.kill(pool.pids()[2], signal.SIGSTOP)
        for victim in (0, 1):
            if not over.wait(0.2):
                os.kill(pool.pids()[victim], signal.SIGKILL)

    thread = threading.Thread(target=disturb)
    thread.start()
    try:
        Job(tmp_path / "many", one).run(pool)
    finally:
        over.set()
        thread.join()
        pids = pool.pids()
        pool.close()
    assert results(tmp_path / "many") == results(tmp_path / "one")
    assert not [pid for pid in pids if Path(f"/proc/{pid}").exists()]


@pytest.mark.parametrize(
    ("deed", "error"),
    [
        ("os.kill(os.getpid(), 11)", "WorkerDied: a worker ended"),
        ("print('last words', file=sys.stderr); os._exit(7)", r"a worker ended with exit status 7"),
        ("raise ZeroDivisionError('odd')", r"FrameError: ZeroDivisionError: odd"),
    ],
)  # fmt: skip
def test_frame_that_kills_its_workers_is_abandoned_and_other_frames_are_finished(
    tmp_path: Path, poison: Path, deed: str, error: str
) -> None:
    poison.write_text(POISON.format(deed=deed))
    pool = ProcessPool(2)
    job = Job(tmp_path / "a", package())
    try:
        with raises(JobError, code="failed_frames", mentions=["frame 3 ", error]):
            job.run(pool)
    finally:
        pool.close()
    assert job.status().finished == 7
    log = (tmp_path / "a/.raycam/failed/frame_0003.log").read_text()
    assert log.count("attempt ") == 3
    if "last words" in deed:
        assert log.count("last words") == 3
    if "odd" in deed:
        assert "sitecustomize.py" in log  # the log contains the worker's traceback
    poison.write_text("")
    pool = ProcessPool(1)
    job.run(pool, retry_failed=True)
    pool.close()
    assert results(tmp_path / "a") == expected(tmp_path)


def test_missing_package_ends_the_run_without_failed_frames(tmp_path: Path) -> None:
    job = Job(tmp_path, package())
    pool = ProcessPool(1)
    pool.open(job.package, "")
    futures = [pool.submit(FrameTask(job.package.id, str(tmp_path / "gone"), frame)) for frame in range(2)]
    pool.slots()
    assert isinstance(futures[0].exception(PATIENCE), PoolLost)
    pool.close()


def test_output_of_workers_does_not_disturb_the_protocol(tmp_path: Path, poison: Path) -> None:
    poison.write_text(POISON.format(deed="print('hello')"))
    pool = ProcessPool(1)
    Job(tmp_path / "a", package()).run(pool)
    pool.close()
    assert results(tmp_path / "a") == expected(tmp_path)


def test_memory_limits_the_number_of_workers(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(memory_limits, "available_bytes", lambda share: int(share * (1 << 30)) - (500 << 20))
    pool = ProcessPool(8)
    pool.open(package(), "")
    assert pool.slots() == 2 * 2  # two workers of 150 MiB each fit into 90 % of the memory
    pool.close()
    pool = ProcessPool(8)
    monkeypatch.setattr(memory_limits, "available_bytes", lambda share: -1)
    assert pool.slots() == 2  # a machine always has at least one worker
    pool.close()
    assert [notice.code for notice in pool.notices] == ["unusable_worker"]


def test_close_ends_all_workers_at_once(tmp_path: Path) -> None:
    one = film(samples=1_000_000).package()
    job = Job(tmp_path, one)
    pool = ProcessPool(2)
    pool.open(one, "")
    pool.slots()
    futures = [
        pool.submit(FrameTask(one.id, str(job.folder / ".raycam/package"), frame, 1)) for frame in range(2)
    ]
    while len(pool.pids()) < 2:
        time.sleep(0.01)
    time.sleep(0.5)
    pids = pool.pids()
    pool.close()  # the frames would take hours
    for future in futures:
        assert isinstance(future.exception(PATIENCE), PoolLost)
    assert not [pid for pid in pids if Path(f"/proc/{pid}").exists()]


def test_workers_end_with_the_process_that_started_them(tmp_path: Path) -> None:
    one = film(samples=1_000_000).package()
    job = Job(tmp_path, one)
    program = f"""
from raycam.cluster.process_pool import ProcessPool
from raycam.jobs.worker import FrameTask
pool = ProcessPool(2)
pool.slots()
for frame in range(2):
    pool.submit(FrameTask({one.id!r}, {str(job.folder / ".raycam/package")!r}, frame, 1))
while len(pool.pids()) < 2:
    pass
print(*pool.pids(), flush=True)
input()
"""
    with subprocess.Popen(
        [sys.executable, "-c", program], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as parent:
        assert parent.stdout is not None
        pids = [int(pid) for pid in parent.stdout.readline().split()]
        time.sleep(1.0)  # by now the workers are rendering their frames
        parent.kill()
    until(lambda: not any(map(runs, pids)), "workers run still")


def runs(pid: int) -> bool:
    """True if the process has not ended; a zombie does not count as running."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except (FileNotFoundError, ProcessLookupError):
        return False


def test_exit_status_or_signal_of_a_worker_is_reported() -> None:
    worker = process_pool._Worker()
    os.kill(worker.process.pid, signal.SIGKILL)
    with raises(WorkerDied, mentions=["SIGKILL"]):
        worker.make(FrameTask("0", "", 0))
    assert process_pool._Worker().end() == "a worker ended with exit status 0"
