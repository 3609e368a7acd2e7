"""Workers: they read the package once, render the requested frames, and report errors."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from raycam.errors import JobError
from raycam.jobs import worker
from raycam.jobs.job_package import JobPackage
from raycam.jobs.kinds import KINDS
from raycam.jobs.worker import FrameTask, PackageNotFound, WorkerUnfit, render_frame
from raycam.video import video
from support.job_frames import film, package
from support.raises import raises


@pytest.fixture(autouse=True)
def forgetful() -> Iterator[None]:
    worker.clear_cache()
    yield
    worker.clear_cache()


def put(folder: Path, one: JobPackage) -> str:
    path = folder / "package"
    path.write_bytes(one.to_bytes())
    return str(path)


def test_worker_reads_the_package_once_for_all_frames(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    one = package()
    path = put(tmp_path, one)
    makers = []
    real = video.frame_maker
    monkeypatch.setitem(KINDS, "video", lambda *given: makers.append(given) or real(*given))
    for frame in (5, 2):
        made = render_frame(FrameTask(one.id, path, frame))
        assert made.frame == frame
        assert dict(made.files) == {f"frame_000{frame}.png": film().frame(frame).to_png()}
        Path(path).unlink(missing_ok=True)
    assert len(makers) == 1
    other = package(seed=3)
    put(tmp_path, other)
    render_frame(FrameTask(other.id, path, 0))
    render_frame(FrameTask(one.id, "nowhere", 0))
    assert len(makers) == 2


def test_worker_finds_delivered_packages(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    one = package()
    (tmp_path / one.id).write_bytes(one.to_bytes())
    monkeypatch.setattr(worker, "PACKAGE_PATHS", [tmp_path])
    assert render_frame(FrameTask(one.id, "nowhere", 1)).frame == 1


def test_package_passed_with_a_frame_is_cached(tmp_path: Path) -> None:
    one = package()
    assert render_frame(FrameTask(one.id, "nowhere", 1), package=one.to_bytes()).frame == 1
    assert render_frame(FrameTask(one.id, "nowhere", 2)).frame == 2  # the worker has kept the package


def test_missing_packages_and_packages_of_other_versions_are_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    one = package()
    with raises(PackageNotFound, mentions=[one.id[:12], "nowhere"]):
        render_frame(FrameTask(one.id, "nowhere", 1))
    path = put(tmp_path, one)
    with raises(PackageNotFound, mentions=["000000000000"]):
        render_frame(FrameTask("0" * 64, path, 1))
    strange = JobPackage("vidoe", 1, {}, one.world)
    with raises(JobError, code="unknown_name", mentions=["'vidoe'", "'video'"]):
        render_frame(FrameTask(strange.id, put(tmp_path, strange), 0))
    path = put(tmp_path, one)
    monkeypatch.setattr("raycam.jobs.job_package.__version__", "99.0")
    with raises(WorkerUnfit, mentions=["99.0"]):
        render_frame(FrameTask(one.id, path, 1))


def test_exception_raised_by_the_progress_callback_stops_the_worker() -> None:
    one = package(samples=4096)
    worker.cache_package(one)

    def stop(done: int, total: int) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        render_frame(FrameTask(one.id, "nowhere", 1), stop)
