"""Videos as jobs, from Python and from the command line."""

from __future__ import annotations

import os
import shlex
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import av
import numpy as np
import pytest
from raycam.cli import main
from raycam.errors import FormatError, JobError
from raycam.io import memory_limits
from raycam.jobs import Job, tiled_picture
from raycam.video import write_video
from raycam.video.audio import RATE
from raycam.video.job import job_folder, make_video
from support.job_frames import Pool, film, package, results, world
from support.patience import PATIENCE, until
from support.raises import raises
from support.sound import heard, tone, write_wave

WORLD = """
[camera]
size = [64, 48]
fov = 40
location = [3, -4, 2]
target = [0, 0, 0]
[[object]]
name = "box"
box = { size = 1 }
color = "#c83c28"
[video]
fps = 10
seconds = 0.8
orbit = { target = [0, 0, 0] }
"""


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "box.toml").write_text(WORLD)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def run(command: str) -> int:
    return main(shlex.split(command))


@pytest.mark.parametrize("name", ["a.mp4", "a.gif"])
def test_resumed_video_equals_an_uninterrupted_video_in_any_order(tmp_path: Path, name: str) -> None:
    (tmp_path / "one").mkdir()
    write_video(world(), tmp_path / "one" / name, integrator="flat", samples=1)
    Job(job_folder(tmp_path / name), package()).run(Pool(), frames=[5, 2])
    pool = Pool()
    assert make_video(film(), tmp_path / name, pool) == 8
    assert 5 not in pool.made
    assert (tmp_path / name).read_bytes() == (tmp_path / "one" / name).read_bytes()
    assert not job_folder(tmp_path / name).exists()


def test_interrupted_video_keeps_frames_and_writes_no_file(tmp_path: Path) -> None:
    def before(frame: int) -> None:
        if frame == 5:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        make_video(film(), tmp_path / "a.mp4", Pool(before))
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.mp4.job"]
    pool = Pool()
    make_video(film(), tmp_path / "a.mp4", pool, keep_frames=True)
    assert min(pool.made) >= 4
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.mp4", "a.mp4.job"]
    again = Pool()
    first = (tmp_path / "a.mp4").read_bytes()
    make_video(film(), tmp_path / "a.mp4", again)
    assert (again.made, (tmp_path / "a.mp4").read_bytes()) == ([], first)


def test_video_with_a_failed_frame_is_not_written(tmp_path: Path) -> None:
    def before(frame: int) -> None:
        if frame == 5:
            raise JobError("odd")

    with raises(JobError, code="failed_frames"):
        make_video(film(), tmp_path / "a.mp4", Pool(before))
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.mp4.job"]


def test_last_shard_writes_the_video(tmp_path: Path) -> None:
    assert make_video(film(), tmp_path / "a.mp4", Pool(), shard=(2, 2)) is None
    assert not (tmp_path / "a.mp4").exists()
    assert make_video(film(), tmp_path / "a.mp4", Pool(), shard=(1, 2)) == 8
    assert (tmp_path / "a.mp4").exists()


def test_video_job_supports_transparency_and_sound(tmp_path: Path) -> None:
    sound = write_wave(tmp_path / "a.wav", tone(0.5))
    one = film(transparent_background=True)
    assert make_video(one, tmp_path / "a.mkv", Pool(), audio=sound, keep_frames=True) == 8
    with av.open(str(tmp_path / "a.mkv")) as file:
        pictures = [frame.to_ndarray(format="rgba") for frame in file.decode(video=0)]
    np.testing.assert_array_equal(pictures, [one.frame(number).to_srgba8() for number in range(8)])
    assert len(heard(tmp_path / "a.mkv")) == 0.8 * RATE
    # Sound and codec belong to the file, not to the frames, which are already finished.
    pool = Pool()
    (tmp_path / "a.mkv.job").rename(tmp_path / "a.mov.job")
    make_video(one, tmp_path / "a.mov", pool, lossless=True)
    assert pool.made == []
    (tmp_path / "text.wav").write_text("none")
    with raises(FormatError, code="damaged_data", mentions=["text.wav"]):
        make_video(one, tmp_path / "b.mov", pool, audio=tmp_path / "text.wav")
    assert (pool.made, (tmp_path / "b.mov.job").exists()) == ([], False)


def meanwhile(make: Callable[[], object]) -> tuple[Pool, list[object]]:
    """A pool that calls a function once between its frames, and the function's result."""
    gave: list[object] = []

    def before(frame: int) -> None:
        if not gave:
            gave.append(None)
            gave[0] = make()

    return Pool(before), gave


def test_last_of_concurrent_shards_writes_the_video(tmp_path: Path) -> None:
    (tmp_path / "one").mkdir()
    make_video(film(), tmp_path / "one/a.mkv", Pool())
    path = tmp_path / "a.mkv"
    pool, gave = meanwhile(lambda: make_video(film(), path, Pool(), shard=(2, 2)))
    assert make_video(film(), path, pool, shard=(1, 2)) == 8
    assert gave == [None]
    assert path.read_bytes() == (tmp_path / "one/a.mkv").read_bytes()
    assert sorted(os.listdir(tmp_path)) == ["a.mkv", "one"]

    plan = tiled_picture.job_package(world(), tile=8, samples=1)
    pool, gave = meanwhile(lambda: tiled_picture.render_tiled(plan, tmp_path / "tiles", Pool(), shard=(2, 2)))
    assert tiled_picture.render_tiled(plan, tmp_path / "tiles", pool, shard=(1, 2)) is not None
    assert gave == [None]


# The command line ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("workers", "count"), [(["--workers", "2"], 3), ([], 1)])
def test_low_priority_applies_to_every_worker(here: Path, workers: list[str], count: int) -> None:
    # In a separate process, because a lowered priority cannot be raised again.
    command = [
        sys.executable,
        "-m",
        "raycam",
        *shlex.split("video box.toml -o frames --samples 100000 --low-priority"),
    ]
    process = subprocess.Popen([*command, *workers], stderr=subprocess.DEVNULL)
    try:
        until(lambda: [19] * count == [niceness(pid) for pid in (process.pid, *children(process.pid))])
    finally:
        process.terminate()
        process.wait()


def children(pid: int) -> list[int]:
    texts = [path.read_text() for path in Path(f"/proc/{pid}/task").glob("*/children")]
    return [int(number) for text in texts for number in text.split()]


def niceness(pid: int) -> int:
    return os.getpriority(os.PRIO_PROCESS, pid)


def test_job_commands_report_and_finish_shards(
    here: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    video = "video box.toml -o frames --samples 1 --integrator flat"
    assert run(f"{video} --shard 1/2") == 0
    assert run(f"{video} --shard 2/2 --workers 1") == 0
    capsys.readouterr()
    assert run("status frames") == 0
    out = capsys.readouterr().out
    assert "frames    8 of 8 finished" in out
    assert "running   no" in out
    assert run("verify frames") == 0
    assert "8 of 8 frames finished, all files intact" in capsys.readouterr().out
    Path("frames/frame_0003.png").write_bytes(b"x" * Path("frames/frame_0003.png").stat().st_size)
    assert run("verify frames") == 1
    told = capsys.readouterr()
    assert told.out.startswith("frames/frame_0003.png: the result was created with")
    assert "frames: 1 file damaged or missing" in told.err
    whole = results(here / "frames")
    assert run(video) == 0
    capsys.readouterr()
    book = Path("frames/.raycam/journal-1-of-2.jsonl")
    book.write_bytes(b"x" + book.read_bytes()[1:])
    assert run("status frames") == 0
    out = capsys.readouterr().out
    assert "frames    7 of 8 finished" in out
    assert f"damaged   1\n  {book}: the line at byte 0 is damaged" in out
    assert run("verify frames") == 1
    assert "line at byte 0 is damaged" in capsys.readouterr().out
    assert run(video) == 0
    assert "line at byte 0 is damaged" in capsys.readouterr().err
    assert run("verify frames") == 0
    assert len(results(here / "frames")) == len(whole) + 1

    assert run(f"{video} --samples 2") == 1
    assert "settings.render.samples was 1, is 2" in capsys.readouterr().err
    assert run(f"{video} --samples 2 --no-resume") == 0
    for wrong in ("--shard 3", "--shard 0/2", "--workers 0", "--cluster nowhere"):
        assert run(f"{video} {wrong}") == 2, wrong
    with monkeypatch.context() as short:
        short.setattr(memory_limits, "available_bytes", lambda share: -1)
        assert run("video box.toml -o few --samples 1 --integrator flat --workers 2") == 0
    assert "raycam: notice: only 1 of 2 workers were started" in capsys.readouterr().err
    assert run("status .") == 1
    assert ".raycam/job.json" in capsys.readouterr().err
    assert run("video box.toml -o a.gif --samples 1 --integrator flat --shard 1/2") == 0
    assert run("status a.gif") == 0  # `status` reads the folder of the video that is being written
    assert "frames    4 of 8 finished" in capsys.readouterr().out
    Path("a.gif").write_bytes(b"")
    assert run("status a.gif") == 0
    assert run("video box.toml -o b.gif --samples 1 --integrator flat --keep-frames") == 0
    assert run("verify b.gif") == 0
    Path("b.gif").write_bytes(Path("b.gif").read_bytes()[:-1])
    capsys.readouterr()
    assert run("verify b.gif") == 1
    assert capsys.readouterr().out.startswith("b.gif: the result was created with")
    Job(here / "a.gif.job").remove()
    assert run("verify a.gif") == 1
    assert "a.gif: the file is complete" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("number", "workers"),
    [(signal.SIGINT, ""), (signal.SIGTERM, "--workers 2"), (signal.SIGINT, "--cluster local:1")],
)
def test_interrupted_command_stops_cleanly_and_resumes(
    here: Path, number: signal.Signals, workers: str
) -> None:
    command = [sys.executable, "-m", "raycam"]
    command += shlex.split(f"video box.toml -o a.mp4 --size 320x240 --samples 64 --seconds 40 {workers}")
    process = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True
    )
    while len(list(here.glob("a.mp4.job/*.png"))) < 3:
        time.sleep(0.02)
        assert process.poll() is None
    os.killpg(process.pid, number)  # terminals and batch systems send signals to the whole group
    _, error = process.communicate(timeout=PATIENCE)
    assert process.returncode == 130
    assert error.splitlines()[-1] == "raycam: stopped"
    assert "Traceback" not in error
    assert sorted(path.name for path in here.iterdir()) == ["a.mp4.job", "box.toml"]
    assert Job(here / "a.mp4.job").status().finished >= 2
