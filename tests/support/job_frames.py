"""Small videos as jobs, and pools that fail on demand, for the tests of jobs."""

from __future__ import annotations

import contextlib
import os
import signal
from collections.abc import Callable
from concurrent.futures import Future
from pathlib import Path
from typing import Any

import raycam
from raycam.jobs import Job, worker
from raycam.jobs.job_package import JobPackage
from raycam.jobs.worker import FrameResult, FrameTask
from raycam.video import VideoPlan


def world() -> raycam.World:
    world = raycam.World()
    world.add_object(box={"size": [1, 1, 1]}, name="box", color=[0.8, 0.1, 0.1])
    world.add_camera(raycam.Camera.look_at([3, -2, 2], [0, 0, 0], size=(16, 12), fov=45))
    world.set_video(fps=10, seconds=0.8, orbit={"target": [0, 0, 0]})
    return world


def film(**options: Any) -> VideoPlan:
    return VideoPlan(world(), **({"integrator": "flat", "samples": 1} | options))


def package(**options: Any) -> JobPackage:
    return film(**options).package()


class Pool:
    """A pool that renders frames at once in this process; `before(frame)` may raise."""

    apart = False
    notices = ()

    def __init__(self, before: Callable[[int], object] = lambda _: None, slots: int = 2) -> None:
        self.before, self._slots = before, slots
        self.made: list[int] = []

    def open(self, package: JobPackage, path: str) -> None:
        self.path = path
        worker.cache_package(package)

    def threads(self, left: int) -> int:
        return 1

    def submit(self, task: FrameTask) -> Future[FrameResult]:
        future: Future[FrameResult] = Future()
        try:
            self.before(task.frame)
            self.made.append(task.frame)
            future.set_result(worker.render_frame(task))
        except Exception as fault:
            future.set_exception(fault)
        return future

    def slots(self) -> int:
        return self._slots

    def close(self) -> None: ...


def results(folder: Path) -> dict[str, bytes]:
    """The files of a folder by name, without the job's own files."""
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and ".raycam" not in path.parts
    }


BLIND = """
import sys
def forbid(event, arguments):
    if event == "open" and str(arguments[0]).startswith({folder!r}):
        raise FileNotFoundError(arguments[0])
sys.addaudithook(forbid)
"""


def blind(folder: Path) -> None:
    """Hides a folder from this process permanently, as if its disk were missing."""
    exec(BLIND.format(folder=str(folder)))


def in_child(work: Callable[[], object]) -> int:
    """Runs a function in a forked process; returns its exit status."""
    pid = os.fork()
    if pid == 0:
        try:
            work()
            os._exit(0)
        except BaseException:
            os._exit(1)
    return os.waitpid(pid, 0)[1]


def killing_at(step: int, part: bool) -> None:
    """Kills this process at the `step`-th file operation.

    Operations are writes, syncs, renames and creations of folders. With `part`, the operation takes place
    first; of a write, only the first half.
    """
    count = 0

    def counted(name: str, module: Any) -> None:
        real = getattr(module, name)

        def call(*arguments: Any, **keys: Any) -> Any:
            nonlocal count
            count += 1
            if count == step:
                if part and name == "write":
                    real(arguments[0], arguments[1][: len(arguments[1]) // 2])
                elif part:
                    with contextlib.suppress(OSError):
                        real(*arguments, **keys)
                os.kill(os.getpid(), signal.SIGKILL)
            return real(*arguments, **keys)

        setattr(module, name, call)

    counted("fsync", os)
    counted("replace", os)
    counted("write", os)
    counted("mkdir", os)


def check_intact(folder: Path, whole: dict[str, bytes]) -> int:
    """Asserts that every final file is correct and every frame of the journal exists.

    Returns the number of frames.
    """
    found = {name: data for name, data in results(folder).items() if not Path(name).name.startswith(".")}
    assert found.items() <= whole.items()
    if not (folder / ".raycam/job.json").exists():
        return 0
    finished = dict(Job(folder).finished())
    assert {name: data for one in finished.values() for name, data in one.items()}.items() <= whole.items()
    return len(finished)
