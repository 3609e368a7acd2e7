"""Result files of a job: unchanged, and inside its folder."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from raycam.errors import JobError
from raycam.io import atomic_files
from raycam.jobs import Job
from support.job_frames import Pool, package, results
from support.raises import raises


@pytest.mark.parametrize("name", ["../a", "/a", "", ".raycam/x", "a/../../b"])
def test_results_outside_of_the_folder_are_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    job = Job(tmp_path / "a", package())
    monkeypatch.setattr("raycam.video.video.picture_name", lambda _: name)
    with raises(JobError, code="invalid_value"):
        job.run(Pool(), frames=[0])
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a"]


def test_frame_may_write_files_in_subfolders(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("raycam.video.video.picture_name", lambda number: f"left/{number}/a.png")
    job = Job(tmp_path / "a", package())
    job.run(Pool(), frames=[0, 3])
    assert list(results(tmp_path / "a")) == ["left/0/a.png", "left/3/a.png"]
    atomic_files.write(tmp_path / "a/left/mine.txt", b"")
    job.remove()
    assert [path.relative_to(tmp_path).as_posix() for path in sorted(tmp_path.rglob("*"))] == [
        "a",
        "a/left",
        "a/left/mine.txt",
    ]


def test_file_names_of_frames_are_not_kept_in_memory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    # pathlib interns the parts of a path: the table of interned strings would grow with a long job.
    kept: list[str] = []
    monkeypatch.setattr(sys, "intern", lambda text: kept.append(text) or text)
    job = Job(tmp_path / "a", package())
    job.run(Pool())
    assert dict(job.finished()).keys() == set(range(8))
    assert not job.verify()
    assert not [text for text in kept if "frame_" in text]
