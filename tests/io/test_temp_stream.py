"""Streams in temporary files that other processes cannot see, and errors for a full disk."""

from __future__ import annotations

import errno
import os
import signal
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from raycam.cluster import InProcessPool, make_pool
from raycam.cluster.process_pool import ProcessPool
from raycam.io import temp_stream
from raycam.io.temp_stream import TempStream, TempStreamError
from raycam.jobs import Job, scheduler, worker
from raycam.jobs.job_package import JobPackage
from raycam.jobs.kinds import KINDS
from raycam.video import video
from support.job_frames import Pool, package, results
from support.raises import raises

# Each image of a video is written three times: in pieces, at once, and in pieces again. Workers are other processes,
# which read this file at startup.
IN_PIECES = """
from raycam.video import video
from raycam.jobs import kinds
real = video.frame_maker
def maker(*given):
    make = real(*given)
    def pieces(data):
        for first in range(0, len(data), 50):
            yield data[first : first + 50]
    def made(number, progress):
        files, notices = make(number, progress)
        return {
            where + name: data if where == "b/" else pieces(data)
            for where in ("a/", "b/", "c/")
            for name, data in files.items()
        }, notices
    return made
kinds.register("video", maker)
"""


@pytest.fixture
def expected(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[dict[str, bytes]]:
    """The files of a job; from now on, images are sent in pieces."""
    worker.clear_cache()  # removes the frame makers that this test and other tests have cached
    Job(tmp_path / "at once", package()).run(Pool())
    (tmp_path / "site").mkdir()
    (tmp_path / "site/sitecustomize.py").write_text(
        f"import sys\nif 'raycam.cluster.process_worker' in sys.orig_argv:\n    exec({IN_PIECES!r})"
    )
    path = [str(tmp_path / "site"), os.environ.get("PYTHONPATH", "")]
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(path))
    # Monkeypatch restores this entry at the end of the test.
    monkeypatch.setitem(KINDS, "video", video.frame_maker)
    exec(IN_PIECES, {})
    worker.clear_cache()
    found = results(tmp_path / "at once")
    yield {f"{where}/{name}": data for where in "abc" for name, data in found.items()}
    worker.clear_cache()


def run(folder: Path, one: JobPackage, pool: Any) -> Job:
    job = Job(folder, one)
    try:
        job.run(pool)
    finally:
        pool.close()
    return job


def test_stream_restores_its_bytes_and_creates_no_visible_file(tmp_path: Path) -> None:
    kept = TempStream(str(tmp_path), [b"ab", memoryview(b"cde")])
    kept.add(bytes(3 << 20))
    assert not list(tmp_path.iterdir())
    for _ in range(2):
        pieces = list(kept)
        assert b"".join(pieces) == b"abcde" + bytes(3 << 20)
        assert len(pieces) == 4
        assert kept.size == 5 + (3 << 20)


def test_missing_temporary_folder_raises_with_its_name(tmp_path: Path) -> None:
    with pytest.raises(TempStreamError) as found:
        TempStream(str(tmp_path / "none"))
    assert found.value.errno == errno.ENOENT
    assert str(tmp_path / "none") in str(found.value)


@pytest.mark.parametrize("pool", [InProcessPool, Pool, lambda: ProcessPool(2)])
def test_files_sent_in_pieces_equal_whole_files(
    tmp_path: Path, expected: dict[str, bytes], pool: Callable[[], Any]
) -> None:
    job = run(tmp_path / "a", package(), pool())
    assert results(tmp_path / "a") == expected
    assert dict(job.finished())[0]["a/frame_0000.png"] == expected["a/frame_0000.png"]
    assert not job.verify()
    (tmp_path / "a/c/frame_0002.png").write_bytes(b"")
    assert list(job.verify()) == ["c/frame_0002.png"]


def test_files_sent_in_pieces_are_restored_from_executors(tmp_path: Path, expected: dict[str, bytes]) -> None:
    from concurrent.futures import ThreadPoolExecutor

    with ThreadPoolExecutor(2) as executor, make_pool(executor) as pool:
        Job(tmp_path / "a", package()).run(pool)
    assert results(tmp_path / "a") == expected


@pytest.mark.parametrize("pool", [InProcessPool, lambda: ProcessPool(2)])
def test_full_disk_does_not_count_as_a_failed_frame(
    tmp_path: Path, expected: dict[str, bytes], monkeypatch: pytest.MonkeyPatch, pool: Callable[[], Any]
) -> None:
    real, written = temp_stream.TemporaryFile, []

    class Full:
        def __init__(self, **where: Any) -> None:
            self.file = real(**where)

        def __getattr__(self, name: str) -> Any:
            return getattr(self.file, name)

        def write(self, data: bytes) -> int:
            written.append(len(data))
            if len(written) == 20:
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
            return self.file.write(data)

    monkeypatch.setattr(temp_stream, "TemporaryFile", Full)
    with raises(OSError, mentions=[".raycam"]) as caught:
        run(tmp_path / "a", package(), pool())
    assert caught.value.errno == errno.ENOSPC
    job = Job(tmp_path / "a")
    assert not job.status().failed
    assert set(results(tmp_path / "a").items()) < set(expected.items())
    run(tmp_path / "a", package(), pool())  # the same call resumes the job
    assert results(tmp_path / "a") == expected


def test_workers_killed_between_pieces_lose_no_frame(
    tmp_path: Path, expected: dict[str, bytes], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(scheduler, "STRAGGLER_TIMEOUT", 1.0)
    real, killed = TempStream.add, []
    pool = ProcessPool(2)

    def add(self: TempStream, piece: bytes) -> None:
        if len(killed) < 2:
            killed.append(pool.pids()[0])
            os.kill(killed[-1], signal.SIGKILL)
        real(self, piece)

    monkeypatch.setattr(TempStream, "add", add)
    run(tmp_path / "a", package(), pool)
    assert len(killed) == 2
    assert results(tmp_path / "a") == expected
