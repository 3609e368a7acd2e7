"""Simulated faults of a cluster.

The tests of Dask use them, and `benchmarks/bench_cluster.py` uses them for longer. Each function runs a job
on one machine and on the cluster, and raises if a byte differs or a frame is lost.
"""

from __future__ import annotations

import math
import os
import random
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
import warnings
from collections.abc import Callable
from concurrent.futures import Future
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from raycam.cluster import dask_pool
from raycam.errors import JobError
from raycam.jobs import Job, scheduler
from raycam.jobs.worker import FrameResult, FrameTask

from support.job_frames import Pool, check_intact, film, results
from support.patience import PATIENCE
from support.raises import raises

SHARE = 0.3
"""The share of the workers that are killed in each round of `storm`."""


class Twice(Future):  # type: ignore[type-arg]
    """A future that reports its result twice, like engines that repeat messages."""

    def add_done_callback(self, tell: Callable[[Future[FrameResult]], object]) -> None:
        super().add_done_callback(tell)
        super().add_done_callback(tell)


class Stormy:
    """A Dask pool with slow frames that delivers every result twice.

    Each frame takes `pause` seconds longer.
    """

    apart = True

    def __init__(self, pool: dask_pool.DaskPool, pause: float) -> None:
        self._pool, self._pause = pool, pause
        self.threads = pool.threads
        self.asked = 0

    def open(self, package: Any, path: str) -> None:
        self._pool.open(package, path)

    def submit(self, task: FrameTask) -> Future[FrameResult]:
        pause = self._pause

        def slowly(task: Any) -> Any:
            import time

            from raycam.jobs import worker

            time.sleep(pause)
            return worker.render_frame(task)

        self.asked += 1
        theirs = self._pool._executor.submit(slowly, task)
        ours: Future[FrameResult] = Twice()
        theirs.add_done_callback(lambda done: dask_pool._resolve_future(ours, done))
        return ours

    def slots(self) -> int:
        return self._pool.slots()

    def close(self) -> None: ...


@dataclass
class Storm:
    """The outcome of `storm`."""

    frames: int
    killed: int
    paused: float
    """Seconds for which one worker was suspended."""
    returned: bool
    """True if the job was still running when the suspended worker continued."""
    asked: int
    """Number of submitted frames, which exceeds `frames` if frames were lost or late."""
    seconds: float


def storm(
    folder: Path,
    pool: dask_pool.DaskPool,
    *,
    frames: int,
    each: float,
    pause: float,
    rounds: int = 1,
    seed: int = 0,
) -> Storm:
    """Kills and suspends workers at random times during a job.

    In each of `rounds` rounds, the share `SHARE` of the workers is killed. One worker is suspended for
    `pause` seconds, and results arrive twice. The function checks that the frames equal those of one machine.
    """
    one = film(seconds=1.0, fps=frames, samples=2).package()
    Job(folder / "one", one).run(Pool())
    chance = random.Random(seed)
    happened = Storm(frames, 0, pause, False, 0, 0.0)
    over = threading.Event()
    lasts = max(pause, 1.0)

    def pids() -> list[int]:
        return list(pool._client.run(os.getpid, on_error="ignore", wait=True).values())

    first = pids()
    victim = first[0]
    count = math.ceil(SHARE * len(first))

    def kill() -> None:
        wait = [chance.uniform(0, lasts * 0.8) for _ in range(count * rounds)]
        start = time.monotonic()
        for moment in sorted(wait):
            if over.wait(max(0.0, start + moment - time.monotonic())):
                return
            with suppress(Exception):
                known = [worker.pid for worker in _nannies(pool) if worker.pid not in (None, victim)]
                os.kill(chance.choice(known), signal.SIGKILL)
                happened.killed += 1

    def stop() -> None:
        os.kill(victim, signal.SIGSTOP)
        over.wait(pause)
        with suppress(ProcessLookupError):
            os.kill(victim, signal.SIGCONT)
            happened.returned = not over.is_set()

    stormy = Stormy(pool, each)
    threads = [threading.Thread(target=kill), threading.Thread(target=stop)]
    start = time.monotonic()
    for thread in threads:
        thread.start()
    try:
        Job(folder / "many", one).run(stormy)
        happened.seconds = time.monotonic() - start
    finally:
        over.set()
        for thread in threads:
            thread.join()
    time.sleep(0.5)  # the suspended worker has answered by now, and the answer was ignored
    assert results(folder / "many") == results(folder / "one")
    assert Job(folder / "many").verify() == {}
    happened.asked = stormy.asked
    return happened


def _nannies(pool: dask_pool.DaskPool) -> list[Any]:
    """The nannies of the workers, which have the process ids even during startup or suspension."""
    return list(pool._cluster.workers.values())


def poison(folder: Path, pool: dask_pool.DaskPool, *, frames: int, number: int) -> None:
    """Runs a job in which one frame kills every worker that renders it.

    This frame fails, and all other frames are finished.
    """
    package = film(seconds=1.0, fps=frames, seed=4).package()
    real = pool._executor.submit

    def kills(task: Any) -> Any:
        import os

        from raycam.jobs import worker

        if task.frame == number:
            os.kill(os.getpid(), 9)
        return worker.render_frame(task)

    job = Job(folder / "poison", package)
    try:
        pool._executor.submit = lambda _, task, **where: real(kills, task, **where)
        with raises(JobError, code="failed_frames", mentions=[f"frame {number} ", scheduler.MAX_ATTEMPTS]):
            job.run(pool)
    finally:
        pool._executor.submit = real
    assert job.status().finished == frames - 1
    assert list(job.status().failed) == [number]
    assert job.log(number).read_text().count("attempt ") >= scheduler.MAX_ATTEMPTS
    # Without the fault, the frame is rendered on request, and all files are equal to those that one machine writes.
    Job(folder / "poison").run(pool, retry_failed=True)
    Job(folder / "clean", package).run(Pool())
    assert results(folder / "poison") == results(folder / "clean")


class Engine:
    """A Dask scheduler and workers as separate processes, as on a cluster."""

    def __init__(self, folder: Path, count: int, port: int | None = None) -> None:
        self.port = free_port() if port is None else port
        self.address = f"tcp://127.0.0.1:{self.port}"
        self._folder, self._log = folder, (folder / "engine.log").open("ab")
        options = ["--host", "127.0.0.1", "--port", str(self.port), "--no-dashboard", "--no-show"]
        self.scheduler = self._start(
            "scheduler", options, {"DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES": "0"}
        )
        self.workers = [self.join() for _ in range(count)]

    def join(self, strange: str = "") -> subprocess.Popen[bytes]:
        """Starts another worker, which first runs the Python code `strange`."""
        options = [self.address, "--nthreads", "1", "--no-dashboard", "--no-nanny", "--host", "127.0.0.1"]
        environment = {}
        if strange:
            site = Path(tempfile.mkdtemp(dir=self._folder))
            (site / "sitecustomize.py").write_text(strange)
            environment["PYTHONPATH"] = os.pathsep.join([str(site), os.environ.get("PYTHONPATH", "")])
        return self._start("worker", [*options, "--death-timeout", "60"], environment)

    def _start(self, what: str, options: list[str], environment: dict[str, str]) -> subprocess.Popen[bytes]:
        return subprocess.Popen(
            [sys.executable, "-m", f"distributed.cli.dask_{what}", *options],
            env=os.environ | environment, cwd=self._folder, stdout=self._log, stderr=self._log,
        )  # fmt: skip

    def close(self) -> None:
        for process in (*self.workers, self.scheduler):
            process.kill()
            process.wait()
        self._log.close()


def free_port() -> int:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        return int(free.getsockname()[1])


def scheduler_lost(folder: Path, *, frames: int, after: int, count: int = 2) -> tuple[int, str]:
    """Kills the scheduler during `raycam video`.

    Returns the number of finished frames and the command's output.

    With a new scheduler, the same command resumes and renders only missing frames.
    """
    world = folder / "box.toml"
    world.write_text(WORLD.format(fps=frames))
    command = [
        sys.executable,
        "-m",
        "raycam",
        "video",
        str(world),
        "-o",
        str(folder / "frames"),
        "--samples",
        "64",
    ]
    subprocess.run(
        [*command[:-4], "-o", str(folder / "one"), "--samples", "64"], check=True, capture_output=True
    )
    engine = Engine(folder, count)
    try:
        process = subprocess.Popen(
            [*command, "--cluster", engine.address], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )
        while len(list((folder / "frames").glob("*.png"))) < after:
            time.sleep(0.01)
            assert process.poll() is None, process.communicate()
        engine.scheduler.kill()
        _, said = process.communicate(timeout=PATIENCE)
    finally:
        engine.close()
    assert process.returncode == 1
    assert "Traceback" not in said, said
    assert "finished frames are kept" in said
    whole = results(folder / "one")
    finished = check_intact(folder / "frames", whole)
    assert after <= finished < frames
    before = {path: path.stat().st_mtime_ns for path in (folder / "frames").glob("*.png")}
    engine = Engine(folder, count, engine.port)
    try:
        subprocess.run(
            [*command, "--cluster", engine.address], check=True, capture_output=True, timeout=PATIENCE
        )
    finally:
        engine.close()
    assert results(folder / "frames") == whole
    assert all(path.stat().st_mtime_ns == time for path, time in before.items())
    return finished, said.strip().splitlines()[-1]


WORLD = """
[camera]
size = [160, 120]
fov = 40
location = [3, -4, 2]
target = [0, 0, 0]
[[object]]
name = "box"
box = {{ size = 1 }}
color = "#c83c28"
[video]
fps = {fps}
seconds = 1
orbit = {{ target = [0, 0, 0] }}
"""


def connected(address: str, tell: Callable[[str], object] = print) -> dask_pool.DaskPool:
    """A connected pool; Dask's log messages about killed workers are hidden."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return dask_pool.connect(address, tell=tell)
