"""Jobs keep finished frames, write the same files after resuming, and report faults."""

from __future__ import annotations

import errno
import json
import os
import signal
import threading
import time
from pathlib import Path
from typing import Any

import pytest
import raycam
from raycam.errors import JobError
from raycam.io.file_lock import hold_lock
from raycam.jobs import Job, Status
from support.job_frames import Pool, check_intact, film, in_child, killing_at, package, results
from support.raises import fault, raises

COUNT = 8


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """The files of an uninterrupted run."""
    folder = tmp_path_factory.mktemp("whole")
    Job(folder, package()).run(Pool())
    return results(folder)


def test_job_writes_the_frames_of_the_video(whole: dict[str, bytes]) -> None:
    assert list(whole) == [f"frame_{number:04}.png" for number in range(COUNT)]
    assert whole["frame_0003.png"] == film().frame(3).to_png()
    assert len(set(whole.values())) > 1


def test_interrupted_job_resumes_with_the_missing_frames(tmp_path: Path, whole: dict[str, bytes]) -> None:
    first, second = Pool(), Pool()
    Job(tmp_path / "a", package()).run(first, frames=range(2, 5))
    assert sorted(first.made) == [2, 3, 4]
    job = Job(tmp_path / "a", package())
    assert job.status() == Status(COUNT, 3, {})
    calls: list[tuple[int, int, int]] = []
    job.run(second, progress=lambda *call: calls.append(call))
    assert sorted(second.made) == [0, 1, 5, 6, 7]
    assert calls == [(done, COUNT, 0) for done in range(3, COUNT + 1)]
    assert results(tmp_path / "a") == whole
    assert dict(Job(tmp_path / "a").finished()) == {
        number: {name: data} for number, (name, data) in enumerate(whole.items())
    }
    assert job.status() == Job(tmp_path / "a").status() == Status(COUNT, COUNT, {})


def test_shards_together_write_all_frames(tmp_path: Path, whole: dict[str, bytes]) -> None:
    taken = []
    for i in (3, 1, 2):
        pool = Pool()
        Job(tmp_path / "a", package()).run(pool, shard=(i, 3))
        taken.append(sorted(pool.made))
    assert taken == [[2, 5], [0, 3, 6], [1, 4, 7]]
    assert results(tmp_path / "a") == whole
    assert sorted(path.name for path in (tmp_path / "a/.raycam").glob("journal*")) == [
        f"journal-{i}-of-3.jsonl" for i in (1, 2, 3)
    ]
    late = Pool()
    job = Job(tmp_path / "a", package())
    job.run(late)
    assert late.made == []
    assert [number for number, _ in job.finished()] == list(range(COUNT))


CHANGES: dict[str, tuple[dict[str, Any], list[str]]] = {
    "samples": ({"samples": 2}, ["settings.render.samples", "1", "2"]),
    "one more": ({"seed": 5}, ["settings.render.seed", "5"]),
    "length": ({"seconds": 1.0}, ["frames", "8", "10", "settings.seconds", "0.8", "1.0"]),
}


@pytest.mark.parametrize("change", CHANGES)
def test_folder_of_another_job_is_refused_with_the_difference(tmp_path: Path, change: str) -> None:
    options, facts = CHANGES[change]
    Job(tmp_path / "a", package()).run(Pool(), frames=[1])
    before = results(tmp_path / "a")
    with raises(JobError, code="changed_input", mentions=[*facts, "resume=False"]):
        Job(tmp_path / "a", package(**options))
    assert results(tmp_path / "a") == before
    (tmp_path / "a" / "notes.txt").write_text("mine")
    pool = Pool()
    Job(tmp_path / "a", package(**options), resume=False).run(pool, frames=[0])
    assert list(results(tmp_path / "a")) == ["frame_0000.png", "notes.txt"]


def test_changed_world_or_version_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    Job(tmp_path / "a", package())
    other = film()
    other._world.add_light({"type": "sky", "radiance": [1, 1, 1]})
    with raises(JobError, code="changed_input", mentions=["world", "light.", '{"type": "sky"']):
        Job(tmp_path / "a", other.package())
    monkeypatch.setattr("raycam.jobs.job_package.__version__", "99.0")
    with raises(JobError, code="changed_input", mentions=['", is "', "99.0"]):
        Job(tmp_path / "a", package())


def test_failed_frames_are_reported_and_other_frames_finished(
    tmp_path: Path, whole: dict[str, bytes]
) -> None:
    def before(frame: int) -> None:
        if frame in (2, 5):
            raise raycam.WorldError("no such thing\nat all")

    job = Job(tmp_path / "a", package())
    calls: list[tuple[int, int, int]] = []
    with raises(JobError, code="failed_frames", mentions=["WorldError"]) as fault:
        job.run(Pool(before), progress=lambda *call: calls.append(call))
    assert calls[-1] == (6, 8, 2)
    assert job.status() == Status(8, 6, {2: "WorldError: no such thing", 5: "WorldError: no such thing"})
    log = tmp_path / "a/.raycam/failed/frame_0002.log"
    assert str(log) in str(fault.value)
    assert "at all" in log.read_text()
    assert "Traceback" in log.read_text()

    # The failed frames are not rendered again until they are requested.
    pool = Pool()
    with raises(JobError, code="failed_frames", mentions=["retry_failed=True"]):
        Job(tmp_path / "a", package()).run(pool)
    assert pool.made == []
    Job(tmp_path / "a", package()).run(pool, frames=[0, 1])
    Job(tmp_path / "a", package()).run(pool, retry_failed=True)
    assert sorted(pool.made) == [2, 5]
    assert results(tmp_path / "a") == whole
    assert Job(tmp_path / "a").status().failed == {}


def test_verify_finds_damaged_results_and_the_next_run_renders_them_again(
    tmp_path: Path, whole: dict[str, bytes]
) -> None:
    job = Job(tmp_path / "a", package())
    job.run(Pool())
    assert job.verify() == {}
    path = tmp_path / "a/frame_0003.png"
    path.write_bytes(path.read_bytes()[:-1] + b"x")  # the damaged content has the same length
    (tmp_path / "a/frame_0006.png").unlink()
    with (tmp_path / "a/frame_0001.png").open("ab") as file:
        file.write(b"x")
    with raises(JobError, code="damaged_job", mentions=["frame_0003.png"]):
        Job(tmp_path / "a").read(3)
    job = Job(tmp_path / "a")
    assert job.status().finished == 6
    wrong = job.verify()
    assert list(wrong) == ["frame_0001.png", "frame_0003.png", "frame_0006.png"]
    assert "frame_0006.png: " in wrong["frame_0006.png"]
    damaged = [tmp_path / f"a/frame_000{number}.png.damaged" for number in (1, 3)]
    assert sorted((tmp_path / "a").glob("*.damaged")) == damaged
    # Damaged files stay missing until they are rendered again.
    assert list(Job(tmp_path / "a").verify()) == list(wrong)
    pool = Pool()
    Job(tmp_path / "a", package()).run(pool)
    assert sorted(pool.made) == [1, 3, 6]
    assert Job(tmp_path / "a").verify() == {}
    for path in damaged:
        path.unlink()
    assert results(tmp_path / "a") == whole


@pytest.mark.parametrize("shard", [None, (2, 2)])
def test_damaged_journal_line_is_reported_and_its_frame_rendered_again(
    tmp_path: Path, whole: dict[str, bytes], shard: tuple[int, int] | None
) -> None:
    folder = tmp_path / "a"
    Job(folder, package()).run(Pool(), shard=shard)
    Job(folder, package()).run(Pool())
    book = folder / ".raycam" / ("journal.jsonl" if shard is None else "journal-2-of-2.jsonl")
    lines = book.read_bytes().splitlines(keepends=True)
    book.write_bytes(b"".join([lines[0], b"x" + lines[1][1:], *lines[2:]]))
    for _ in range(2):  # the frame stays missing until it is rendered again
        job = Job(folder)
        assert job.status().finished == COUNT - 1
        (told,) = job.status().damaged
        assert told.startswith(f"{book}: the line at byte {len(lines[0])} is damaged")
        assert list(job.verify().values()) == [told]
    with hold_lock(book.with_name("lock-2-of-2"), folder):  # another process is writing this file
        Job(folder, package()).run(Pool(), frames=[])
        assert len(Job(folder).status().damaged) == (0 if shard is None else 1)
    pool = Pool()
    Job(folder, package()).run(pool)
    assert len(pool.made) == 1
    assert Job(folder).status().damaged == ()
    assert Job(folder).verify() == {}
    assert results(folder) == whole


def test_assembled_files_are_verified(tmp_path: Path, whole: dict[str, bytes]) -> None:
    job = Job(tmp_path / "a", package())
    job.run(Pool())
    index, film = tmp_path / "a/lists/index.json", tmp_path / "a.mp4"
    index.parent.mkdir()
    for path in (index, film):
        path.write_bytes(b"whole")
    job.mark_assembled(["lists/index.json", "../a.mp4"])
    assert Job(tmp_path / "a").verify() == {}
    index.write_bytes(b"whale")
    film.unlink()
    wrong = Job(tmp_path / "a").verify()
    assert list(wrong) == ["lists/index.json", "../a.mp4"]
    assert wrong["lists/index.json"].startswith(f"{index}: the result was created with 5 bytes")
    assert wrong["../a.mp4"].startswith(f"{film}: ")
    assert index.with_name("index.json.damaged").read_bytes() == b"whale"
    for path in (index, film):
        path.write_bytes(b"whole")
    assert Job(tmp_path / "a").verify() == {}
    note = tmp_path / "a/.raycam/joined.json"
    right = note.read_bytes()
    elsewhere = [json.dumps({name: [5, "0"]}).encode() for name in ("../../x", "/x", "../b/../x", "..")]
    for damaged in (b"{", b"[]", b'{"a": 3}', b"\xff", *elsewhere):
        note.write_bytes(damaged)
        assert list(Job(tmp_path / "a").verify()) == [".raycam/joined.json"], damaged
    note.write_bytes(right)
    index.with_name("index.json.damaged").unlink()
    job.remove()
    # Files that other programs wrote into the folder are not removed.
    assert [path.name for path in tmp_path.iterdir()] == ["a.mp4"]


def test_damaged_package_is_found_and_written_again(tmp_path: Path, whole: dict[str, bytes]) -> None:
    Job(tmp_path / "a", package()).run(Pool(), frames=[1, 2])
    path = tmp_path / "a/.raycam/package"
    right = path.read_bytes()
    for damage in (True, False):
        if damage:
            path.write_bytes(right[:-9] + b"x" + right[-8:])
        else:
            path.unlink(missing_ok=True)
        assert list(Job(tmp_path / "a").verify()) == [".raycam/package"]
        assert not path.exists()
    path.write_bytes(b"x")
    pool = Pool()
    Job(tmp_path / "a", package()).run(pool)
    assert path.read_bytes() == right
    assert len(pool.made) == 6
    assert Job(tmp_path / "a").verify() == {}
    path.with_name("package.damaged").unlink()
    assert results(tmp_path / "a") == whole


def test_damaged_description_raises_with_a_remedy_that_works(tmp_path: Path, whole: dict[str, bytes]) -> None:
    Job(tmp_path / "a", package()).run(Pool(), frames=[1, 2])
    path = tmp_path / "a/.raycam/job.json"
    for text in (b"{", b"\xff\xfe", b'{"job": 1}'):
        path.write_bytes(text)
        with raises(JobError, code="damaged_job", mentions=["job.json"]):
            Job(tmp_path / "a", package())
    path.unlink()
    pool = Pool()
    Job(tmp_path / "a", package()).run(pool)
    assert len(pool.made) == 6
    assert results(tmp_path / "a") == whole
    path.unlink()  # the results of another job are not used
    options, _ = CHANGES["samples"]
    assert Job(tmp_path / "a", package(**options)).status().finished == 0


def test_second_run_on_the_same_shard_is_refused(tmp_path: Path) -> None:
    def again(frame: int) -> None:
        if frame == 1:
            with raises(JobError, code="folder_in_use", mentions=[os.getpid()]):
                Job(tmp_path / "a", package()).run(Pool())
            Job(tmp_path / "a", package()).run(Pool(), shard=(1, 4))

    Job(tmp_path / "a", package()).run(Pool(again))


def test_shards_that_end_together_assemble_the_result_once(tmp_path: Path) -> None:
    first, second = Job(tmp_path / "a", package()), Job(tmp_path / "a")
    seen: list[bool] = []

    def join() -> None:
        with second.assembling() as there:
            seen.append(there)

    thread = threading.Thread(target=join)
    first.run(Pool())
    with first.assembling() as there:
        assert there
        thread.start()
        time.sleep(0.2)
        assert seen == []
        first.remove()
    thread.join()
    assert seen == [False]
    with second.assembling() as there:  # a later call does not find the removed job either
        assert not there


# Interruptions ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("part", [False, True])
def test_job_killed_at_every_step_loses_no_finished_frame(
    tmp_path: Path, whole: dict[str, bytes], part: bool
) -> None:
    plan = package()
    for step in range(1, 1000):
        folder = tmp_path / str(step)

        def work(step: int = step, folder: Path = folder) -> None:
            killing_at(step, part)
            Job(folder, plan).run(Pool(), frames=range(2))

        ended = in_child(work)
        finished = check_intact(folder, whole)
        pool = Pool()
        Job(folder, plan).run(pool, frames=range(2))
        assert len(pool.made) == 2 - finished
        assert results(folder) == {name: whole[name] for name in list(whole)[:2]}
        state = sorted(path.name for path in (folder / ".raycam").iterdir() if path.suffix != ".png")
        assert state == ["job.json", "journal.jsonl", "lock", "lock-begin", "package"]
        if ended == 0:
            assert step > 20
            return
        assert os.WTERMSIG(ended) == signal.SIGKILL
    raise AssertionError("it never came to its end")


def test_job_killed_at_random_times_loses_no_finished_frame(tmp_path: Path, whole: dict[str, bytes]) -> None:
    plan = package()
    start = time.perf_counter()
    assert in_child(lambda: Job(tmp_path / "whole", plan).run(Pool())) == 0
    length = time.perf_counter() - start
    for number in range(10):
        folder = tmp_path / str(number)
        pid = os.fork()
        if pid == 0:
            Job(folder, plan).run(Pool())
            os._exit(0)
        time.sleep(length * number / 8)
        os.kill(pid, signal.SIGKILL)
        os.waitpid(pid, 0)
        finished = check_intact(folder, whole)
        pool = Pool()
        Job(folder, plan).run(pool)
        assert len(pool.made) == COUNT - finished
        assert results(folder) == whole


@pytest.mark.parametrize("code", [errno.ENOSPC, errno.EROFS, errno.EACCES, errno.EIO, errno.EDQUOT])
@pytest.mark.parametrize("place", ["write", "rename", "journal"])
def test_disk_error_stops_the_job_and_the_next_run_resumes(
    tmp_path: Path, whole: dict[str, bytes], monkeypatch: pytest.MonkeyPatch, code: int, place: str
) -> None:
    job = Job(tmp_path / "a", package())
    # The file of each frame is written first, then the journal.
    name, left = {"write": ("write", 4), "rename": ("replace", 3), "journal": ("write", 5)}[place]
    real = getattr(os, name)

    def refuse(*arguments: Any) -> Any:
        nonlocal left
        left -= 1
        if left < 0:
            raise OSError(code, os.strerror(code), "disk")
        return real(*arguments)

    with monkeypatch.context() as patch:
        patch.setattr(os, name, refuse)
        with raises(OSError, mentions=["[Errno"]) as fault:
            job.run(Pool())
    assert fault.value.errno == code
    assert check_intact(tmp_path / "a", whole) >= 2
    pool = Pool()
    Job(tmp_path / "a", package()).run(pool)
    assert len(pool.made) <= COUNT - 2
    assert results(tmp_path / "a") == whole


def test_jumps_of_the_clock_do_not_affect_a_job(
    tmp_path: Path, whole: dict[str, bytes], monkeypatch: pytest.MonkeyPatch
) -> None:
    times = iter([2e9, 0.0, -1e9, 3e9] * 1000)
    monkeypatch.setattr(time, "time", lambda: next(times))
    for frames in ([1, 2], range(COUNT)):
        Job(tmp_path / "a", package()).run(Pool(), frames=frames)
        for path in (tmp_path / "a").iterdir():
            os.utime(path, (0, 0) if len(path.name) % 2 else (4e9, 4e9))
    assert results(tmp_path / "a") == whole


# Faults ------------------------------------------------------------------------------------------------------


def test_invalid_requests_raise_with_the_argument(tmp_path: Path) -> None:
    with raises(JobError, code="file_not_found"):
        Job(tmp_path)
    job = Job(tmp_path / "a", package())
    for options, message in (
        ({"frames": [8]}, fault("index_out_of_range")),
        ({"frames": [-1]}, fault("index_out_of_range", "-1")),
        ({"shard": (0, 3)}, fault("out_of_range", "0/3")),
        ({"shard": (4, 3)}, fault("out_of_range", "4/3")),
    ):
        with raises(JobError, **message):
            job.run(Pool(), **options)  # type: ignore[arg-type]
    with pytest.raises(KeyError):
        job.read(3)
    (tmp_path / "a/.raycam/job.json").write_text("{")
    with raises(JobError, code="damaged_job"):
        Job(tmp_path / "a")
    (tmp_path / "file").write_text("")
    with raises(OSError, mentions=["file"]):
        Job(tmp_path / "file", package())


def test_finished_job_deletes_its_large_package_until_needed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, whole: dict[str, bytes]
) -> None:
    path = tmp_path / "a/.raycam/package"
    job = Job(tmp_path / "a", package())
    job.run(Pool(), frames=[1])
    monkeypatch.setattr("raycam.jobs.job.MAX_KEPT_PACKAGE_BYTES", 0)
    job.release_package()
    assert path.exists()  # frames are missing
    job.run(Pool())
    job.release_package()
    assert not path.exists()
    assert Job(tmp_path / "a").verify() == {}
    pool = Pool()
    Job(tmp_path / "a", package()).run(pool)
    assert (pool.made, path.exists()) == ([], False)
    with pytest.raises(JobError):
        Job(tmp_path / "a", package(samples=2))
    first = next(name for name in whole if name.endswith("0001.png"))
    (tmp_path / "a" / first).unlink()
    with pytest.raises(JobError):  # the job's folder does not contain the world
        Job(tmp_path / "a").run(Pool())
    again = Job(tmp_path / "a", package())
    again.run(pool)
    assert pool.made == [1]
    assert path.exists()
    assert results(tmp_path / "a") == whole
    path.unlink()
    assert list(Job(tmp_path / "a").verify()) == [".raycam/package"]
